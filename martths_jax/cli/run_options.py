"""Options that every command which runs many trials has, and what they do."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import jax
import typer

from martths_jax.campaign.given import split_list
from martths_jax.cli.console import error_console
from martths_jax.indices import GROUPS
from martths_jax.study import Bars, Lines, Reporter

Config = Annotated[
    Path | None, typer.Option("--config", help="TOML file of a study; flags override it.")
]
Controllers = Annotated[
    list[str] | None,
    typer.Option(
        "--controllers",
        "--controller",
        metavar="[NAME=]KIND[{KEY=VALUE,...}]",
        help="Controllers, separated by commas or repeated, such as lqg or "
        "'slow=adfc{nb=2048,no=2047}'; adfc if left out.",
    ),
]
Indices = Annotated[
    list[str] | None,
    typer.Option(
        "--indices",
        metavar="NAMES",
        help=f"What is evaluated, separated by commas or repeated: {', '.join(GROUPS)}, names such "
        "as J2_1 or TI, package.module:NAME of your own; benchmark if left out.",
    ),
]
MotionList = Annotated[str | None, typer.Option("--motions", help="Motions separated by commas.")]
Figures = Annotated[bool, typer.Option("--figures/--no-figures", help="Draw figures.")]
Devices = Annotated[
    int | None, typer.Option("--devices", help="Devices to use; all, one a core, if left out.")
]
Memory = Annotated[
    float | None, typer.Option("--memory", help="Bound on the memory of the noise [GB].")
]
AllowMixed = Annotated[
    bool,
    typer.Option("--allow-mixed", help="Mix results of machines whose last digits differ."),
]
Quiet = Annotated[bool, typer.Option("--quiet", help="Say nothing but errors.")]


def words(texts: list[str] | None) -> list[str] | None:
    """Words of options that may be repeated and hold several, separated by commas."""
    if not texts:
        return None
    return [word for text in texts for word in split_list(text)]


def given_settings(motions: list[str] | None, motion_list: str | None, **settings) -> dict:
    """A study's settings that were given on the command line."""
    asked = [*(motions or []), *(words([motion_list]) or [] if motion_list else [])]
    lists = {name: words(settings.get(name)) for name in ("controllers", "indices")}
    settings |= {"motions": asked or None} | lists
    return {name: value for name, value in settings.items() if value is not None}


def set_devices(count: int) -> None:
    """Let JAX start so many CPU devices, if it has not started yet."""
    try:
        jax.config.update("jax_num_cpu_devices", count)
    except RuntimeError:  # JAX runs already (a program that calls this command)
        pass


def reporter_for(quiet: bool) -> Reporter:
    """Bars on a terminal, lines elsewhere, or nothing."""
    if quiet:
        return Reporter()
    return Bars(error_console) if error_console.is_terminal else Lines(error_console)


def say_what_is_kept(folder) -> None:
    """After Ctrl-C."""
    error_console.print(
        f"What is finished is kept in {folder}; repeat the command to go on.",
        highlight=False,
        soft_wrap=True,
        markup=False,
    )
