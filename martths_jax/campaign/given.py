"""How a controller is named where a study is set up: ``lqg``, ``slow=adfc{nb=2048, no=2047}``, ...

    KIND                    a kind with its defaults, or a name with a table of its own; a name of
                            ours, package.module:Class or path/file.py:Class (``registry``)
    KIND{KEY=VALUE, ...}    with settings
    NAME=KIND{...}          under a name of its own, so that one kind can stand there twice

Values are written as in TOML; words need no quotes.
"""

from __future__ import annotations

import copy
import re
import tomllib
from collections.abc import Mapping

from martths_jax.control.base import Controller
from martths_jax.control.registry import find
from martths_jax.errors import InputError
from martths_jax.text import shortened

_TEXT = re.compile(r"(?:(?P<name>[^{}=]+)=)?(?P<kind>[^{}=]+)(?:\{(?P<inside>.*)\})?", re.DOTALL)
_PAIRS = {"{": "}", "[": "]", "(": ")"}
EXAMPLE = "'slow=adfc{nb=2048,no=2047}'"


def split_list(text: str) -> list[str]:
    """Words between commas; a comma in brackets or quotes parts nothing.

    Raises:
        InputError: a bracket or a quote that is not closed.
    """
    words, closing, quote = [""], [], ""
    for sign in text:
        if quote:
            quote = "" if sign == quote else quote
        elif sign in "\"'":
            quote = sign
        elif sign in _PAIRS:
            closing.append(_PAIRS[sign])
        elif closing and sign == closing[-1]:
            closing.pop()
        elif sign == "," and not closing:
            words.append("")
            continue
        words[-1] += sign
    if closing or quote:
        raise InputError(
            f"{shortened(text)} lacks a closing {closing[-1] if closing else quote}; write "
            f"settings as in {EXAMPLE}, and in quotes, since shells take braces for themselves."
        )
    return [word.strip() for word in words if word.strip()]


def expand(controllers, tables: Mapping) -> tuple[tuple, dict]:
    """Names and objects, and the tables that say what the names are.

    Args:
        controllers: texts and ``Controller`` objects; or a mapping from names to a kind, to
            settings with their ``kind``, or to an object, which then goes by that name.
        tables: settings of controllers by name; those of a text go on top.

    Raises:
        InputError: a text that is none of the forms above.
    """
    tables = {name: dict(table) for name, table in tables.items()}
    if isinstance(controllers, Mapping):
        return _from_mapping(controllers, tables), tables
    if not isinstance(controllers, (tuple, list)):
        return controllers, tables
    return tuple(
        _from_text(given, tables) if isinstance(given, str) else given for given in controllers
    ), tables


def _is_place(kind: str) -> bool:
    """Whether a kind says where a class is; its entry then says what it is called."""
    return ":" in kind or kind.endswith(".py")


def _from_mapping(controllers: Mapping, tables: dict) -> tuple:
    found = []
    for name, given in controllers.items():
        if isinstance(given, Controller):
            # A copy: the same object may stand elsewhere under its own name.
            found.append(named(copy.copy(given), name))
            continue
        table = {"kind": given} if isinstance(given, str) else given
        if not isinstance(table, Mapping):
            raise InputError(
                f"Argument `controllers` must map {name!r} to a kind, to settings or to a "
                f"Controller, but got {shortened(given)}."
            )
        _add(tables, name, dict(table).get("kind", name), table)
        found.append(name)
    return tuple(found)


def named(controller: Controller, name: str) -> Controller:
    """A controller under another name, which is no field, so that it shares a compiled program."""
    object.__setattr__(controller, "name", name)
    return controller


def _from_text(text: str, tables: dict) -> str:
    plain = not set("={") & set(text)
    if text in tables or (plain and not _is_place(text)):
        return text
    match = _TEXT.fullmatch(text.strip())
    if not match:
        raise InputError(
            f"Controller {shortened(text)} cannot be read; write KIND, KIND{{KEY=VALUE,...}} or "
            f"NAME=KIND{{...}}, as in {EXAMPLE}, and in quotes, since shells take braces for "
            "themselves."
        )
    kind = match["kind"].strip()
    name = (match["name"] or (find(kind).entry.name if _is_place(kind) else kind)).strip()
    _add(tables, name, kind, _settings(match["inside"] or "", text))
    return name


def _add(tables: dict, name: str, kind: str, settings: Mapping) -> None:
    before = tables.get(name, {})
    if before.get("kind", name) != kind:
        before = {}  # settings of another kind mean nothing here
    tables[name] = {**before, **settings, **({} if kind == name else {"kind": kind})}


def _settings(inside: str, text: str) -> dict:
    found = {}
    for word in split_list(inside):
        key, sign, value = (part.strip() for part in word.partition("="))
        if not (key and sign and value):
            raise InputError(
                f"Controller {shortened(text)} must have settings of the form KEY=VALUE, but got "
                f"{word!r}; write them as in {EXAMPLE}."
            )
        if key in found:
            raise InputError(f"Controller {shortened(text)} has the setting {key!r} twice.")
        try:
            found[key] = tomllib.loads(f"value = {value}")["value"]
        except (ValueError, RecursionError):
            found[key] = value
    return found
