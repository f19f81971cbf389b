"""Options of the command line: each name is declared once, for all commands that have it.

    Trial = option(int, "--trial", help="Number of the trial; 0 is the nominal plant", min=0)

    @takes(STUDY, DEFAULTS)          # an option for each of these settings of a study
    def sweep(nb: ..., settings: dict): ...

A list may be given by repeating its option or with commas.  Names, types and help texts of a
study's settings are those of ``campaign.fields``.
"""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, get_args

import typer
from rich.markup import escape

from martths_jax.campaign.config import StudyConfig, as_settings
from martths_jax.campaign.fields import BY_NAME, Field
from martths_jax.campaign.given import split_list
from martths_jax.errors import InputError, argument_error
from martths_jax.indices import GROUPS

#: Types of the settings that are no text.
_TYPES = {"trials": int, "seed": int, "case": int, "spread": float, "plants": Path, "records": Path,
          "scale": float, "dt": float, "fs": float, "noise_power": float, "noise_shared": bool,
          "out": Path, "signals": bool, "devices": int, "memory_gb": float, "max_failed": int,
          "controllers": list[str], "motions": list[str], "indices": list[str],
          "keep": list[str]}  # fmt: skip
#: Settings whose option is not just their name.
_NAMES = {"controllers": ("--controller", "--controllers"), "motions": ("--motion", "--motions"),
          "memory_gb": ("--memory",), "signals": ("--signals/--no-signals",),
          "noise_shared": ("--noise-shared/--noise-apart",)}  # fmt: skip
_METAVARS = {"controllers": "[NAME=]KIND[{KEY=VALUE,...}]", "motions": "NAME|FILE", "out": "PATH",
             "plants": "FILE", "records": "DIR", "dt": "S", "variable": "NAME|NUMBER",
             "keep": "TRIAL", "indices": "NAME", "case": "N"}  # fmt: skip
#: Texts with more to say than a line of a configuration file has room for.
_HELP = {
    "motions": "Built-in motion (elcentro-like, kobe-like, morganhill-like), name under --records, "
    "or path of a file (.mat, .npy, .AT2, .V2, .smc, .csv ...); repeated or with commas",
    "controllers": "A name such as lqg or adfc, package.module:Class or path/file.py:Class, also "
    "with settings: 'slow=adfc{nb=2048,no=2047}'; repeated or with commas",
    "indices": f"What is evaluated: {', '.join(GROUPS)}, names such as J2_1 or TI, "
    "package.module:NAME or path/file.py:NAME; repeated or with commas",
    "out": "Where the results go",
    "plants": "CSV file of the uncertain parameters of each plant",
    "signals": "Signals of chosen trials too",
    "memory_gb": "Bound on the memory of the noise of a chunk of trials [GB]",
}

#: Settings of a study that say what is run and where; every campaign has them.
STUDY = ("problem", "case", "trials", "seed", "controllers", "indices", "motions", "records",
         "scale", "pga", "sa", "units", "dt", "variable", "resample", "spread", "fs", "integrator",
         "partition", "force_from", "noise_power", "noise_shared", "out", "devices")  # fmt: skip
#: Settings of how its plants are drawn.
DRAWN = ("draws", "plants", "plants_as")


def option(kind: Any, *names: str, help: str, default: str = "", **more) -> Any:
    """Type of a parameter that is an option.

    Args:
        kind: of its value; a list is split at commas.
        names: of the option, the first is the one that help texts show.
        help: what it means, the same for all commands.
        default: what is taken if it is left out, where that is not the parameter's default.
        more: arguments of ``typer.Option``.
    """
    if str(kind).startswith("list"):
        more.setdefault("callback", _split)
    text = help.rstrip(".")
    # Square brackets are markup in help texts.
    text = escape(f"{text} [default: {default}]." if default else f"{text}.")
    return Annotated[kind, typer.Option(*names, help=text, **more)]


def words(texts: Sequence[str] | None) -> list[str] | None:
    """Words of an option that may be repeated and hold several, separated by commas.

    The path of a file is one word, whatever signs it has.
    """
    if not texts:
        return None
    found = [[t] if "," not in t or _is_file(t) else split_list(t) for t in map(str, texts)]
    return [word for some in found for word in some]


def _is_file(text: str) -> bool:
    try:
        return Path(text).exists()
    except OSError:  # a name longer than any file's
        return False


def _split(texts):
    found = words(texts)
    kind = type(texts[0]) if texts else str
    return found and [word if kind is str else kind(word) for word in found]


def trial_list(texts: Sequence[str] | None) -> list[int] | None:
    """Trial numbers of ``--keep 1,617``.

    Raises:
        InputError: if they are no numbers.
    """
    found = words(texts)
    odd = [word for word in found or () if not re.fullmatch(r"\d+", word)]
    if odd:
        raise argument_error("keep", "be trial numbers such as 1,617", repr(odd[0]))
    return found and [int(word) for word in found]


def setting(name: str, default: Any = None, **more) -> Any:
    """Type of a parameter that is a setting of a study.

    Args:
        name: of the setting.
        default: what is taken if it is left out.
        more: as of ``option``.
    """
    kind = _TYPES.get(name, str)
    if name == "keep":
        more["callback"] = trial_list
    names = _NAMES.get(name, (f"--{name.replace('_', '-')}",))
    text = _HELP.get(name) or _with_choices(BY_NAME[name])
    if isinstance(default, (tuple, list)):
        default = ", ".join(map(str, default))
    shown = "" if default is None else str(default)
    return option(
        kind | None, *names, help=text, default=shown, metavar=_METAVARS.get(name), **more
    )


def _with_choices(field: Field) -> str:
    """Its help, with the words that it may be if that does not name them."""
    start, text = "be one of ", field.help.rstrip(".")
    if not field.wanted.startswith(start):
        return text
    choices = field.wanted.removeprefix(start)
    return text if all(c in text for c in choices.split(", ")) else f"{text}: {choices}"


def required(name: str, default: str = "") -> Any:
    """The same for a setting that must be given."""
    kind, info = get_args(setting(name, default or None))
    return Annotated[get_args(kind)[0], info]


def one_of(name: str, found: Sequence | None):
    """The one value of a list where there may be only one; None where it is not given.

    Raises:
        InputError: if there are more.
    """
    if found and len(found) > 1:
        raise InputError(f"Option {name} takes one value here, but got {', '.join(found)}.")
    return found[0] if found else None


def takes(names: Sequence[str], defaults: Mapping[str, Any] = MappingProxyType({})) -> Callable:
    """Decorator: a command whose parameter `settings` holds the settings of a study that were given
    on the command line, by name.

    Args:
        names: of the settings, each of which becomes an option.
        defaults: what the command takes where that is not a study's default, for help texts.
    """
    shown = as_settings(StudyConfig()) | dict(defaults)

    def decorate(command):
        parameters = []
        for own in inspect.signature(command, eval_str=True).parameters.values():
            if own.name != "settings":
                parameters.append(own.replace(kind=inspect.Parameter.KEYWORD_ONLY))
                continue
            parameters += [
                inspect.Parameter(
                    name, inspect.Parameter.KEYWORD_ONLY, default=None,
                    annotation=setting(name, shown[name]),
                )
                for name in names
            ]  # fmt: skip

        @functools.wraps(command)
        def run(**given):
            settings = {name: given.pop(name) for name in names}
            found = {name: value for name, value in settings.items() if value not in (None, [])}
            return command(**given, settings=found)

        run.__signature__ = inspect.Signature(parameters)
        return run

    return decorate


Trial = option(int, "--trial", min=0, help="Which trial; 0 is the nominal plant")
