"""Options that every command which runs many trials has, and what they do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import jax

from martths_jax.campaign.config import read_toml
from martths_jax.cli.console import error_console
from martths_jax.cli.options import option
from martths_jax.indices import NAMES
from martths_jax.study import Bars, Lines, Reporter

Config = option(
    Path | None, "--config", metavar="FILE",
    help="TOML file of a study, see init-config; options override it",
)  # fmt: skip
Figures = option(bool, "--figures/--no-figures", help="Draw figures")
Fresh = option(bool, "--fresh", help="Start over: delete the run in the folder")
AllowMixed = option(bool, "--allow-mixed", help="Mix results of machines whose last digits differ")
Quiet = option(bool, "--quiet", help="Say nothing but errors")


def shown_indices(default) -> type:
    """Option for the indices that figures and summary show."""
    return option(
        list[str] | None, "--index", metavar="INDEX", default=", ".join(default),
        help=f"Indices of figures and summary, {NAMES[0]} to {NAMES[-1]}; repeated or with commas",
    )  # fmt: skip


def settings_of(config: Path | None, given: Mapping) -> dict:
    """A study's settings by name: those given on the command line, else those of a file.

    Raises:
        InputError: a file that cannot be used.
    """
    return ({} if config is None else read_toml(config)) | dict(given)


def set_devices(count: int | None) -> None:
    """Let JAX start so many CPU devices, if it has not started yet."""
    if count is None or count < 1:  # what cannot be used is refused where it is
        return
    try:
        jax.config.update("jax_num_cpu_devices", count)
    except RuntimeError:  # JAX runs already (a program that calls this command)
        pass


def reporter_for(quiet: bool) -> Reporter:
    """Bars on a terminal, lines elsewhere, or nothing."""
    if quiet:
        return Reporter()
    return Bars(error_console) if error_console.is_terminal else Lines(error_console)


@contextmanager
def kept(folder) -> Iterator[None]:
    """After Ctrl-C, say that what is finished is kept in a folder."""
    try:
        yield
    except KeyboardInterrupt:
        error_console.print(
            f"What is finished is kept in {folder}; repeat the command to go on.",
            highlight=False,
            soft_wrap=True,
            markup=False,
        )
        raise
