"""The command line ``martths``.  Each group of commands has its own file; this one joins them."""

from __future__ import annotations

import os
import signal
import sys
from typing import Annotated

import typer
from rich.markup import escape

from martths_jax import __version__
from martths_jax.cli import (
    check_controller,
    export,
    figures,
    motions,
    nominal,
    problem,
    sensitivity,
    study,
    sweep,
    tune,
)
from martths_jax.cli.console import accept_any_text, error_console
from martths_jax.errors import InputError
from martths_jax.runtime import check_devices

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    help="Virtual multi-axial real-time hybrid simulation (v-maRTHS): runs, studies, tables.",
)
app.command("modes")(nominal.modes)
app.command("run")(nominal.run)
app.command("table4")(nominal.table4)
app.command("study")(study.study)
app.command("init-config")(study.init_config)
app.command("merge")(study.merge)
app.command("summary")(study.summary)
app.command("export")(export.command())
app.command("sweep")(sweep.sweep)
app.command("sensitivity")(sensitivity.sensitivity)
app.command("figures")(figures.figures)
app.command("tune")(tune.tune)
app.command("check-controller")(check_controller.check_controller)
app.command("table")(figures.table)
app.command("report")(figures.report)
app.command("replay")(figures.replay)
app.add_typer(motions.app, name="motions")
app.add_typer(problem.app, name="problem")


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"martths {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    check_devices()


def main() -> None:
    """Run the command line: user errors are one message and exit code 2, Ctrl-C is 130."""
    accept_any_text()
    try:
        app()
    except InputError as error:
        _fail(str(error))
    except MemoryError as error:
        _fail(f"There is not enough memory ({error or 'nothing more can be taken'}).")
    except KeyboardInterrupt:
        # A second one, while Python and JAX clean up, ends the process at once and without a word.
        signal.signal(signal.SIGINT, lambda *_: os._exit(130))
        error_console.print("Interrupted; no half-written file was left.")
        sys.exit(130)


def _fail(text: str) -> None:
    error_console.print(f"[bold red]Error:[/] {escape(text)}", highlight=False, soft_wrap=True)
    sys.exit(2)
