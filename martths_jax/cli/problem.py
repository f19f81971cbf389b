"""``martths problem``: write, check and draw problems that are given by files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.markup import escape

from martths_jax.cli.console import console
from martths_jax.cli.options import option, required
from martths_jax.problem.file.figure import draw_problem
from martths_jax.problem.file.problem import FileProblem, read_problem, turns
from martths_jax.problem.file.template import write_template
from martths_jax.screen import ScreenTable
from martths_jax.structure.modes import effective_masses, natural_modes

app = typer.Typer(
    help="Problems of your own: frame, laboratory, actuators and plants in a TOML file.",
    no_args_is_help=True,
)
File = Annotated[Path, typer.Argument(help="Problem file.", metavar="FILE", show_default=False)]
MOST_MODES = 8


@app.command()
def init(
    file: File,
    overwrite: option(bool, "--overwrite", help="Write over a file that is there") = False,
) -> None:
    """Write a commented problem file to start from; it runs as it is."""
    write_template(file, overwrite)
    console.print(f"Wrote {escape(str(file))}; run it with `martths study --problem {file}`.",
                  soft_wrap=True)  # fmt: skip


@app.command()
def check(file: File) -> None:
    """Read a problem file, list all faults by line, or what it holds."""
    made = read_problem(file)
    console.print(_modes(made))
    console.print(_rig(made))
    for note in made.structure.notes:
        console.print(f"[yellow]Note:[/] {escape(note)}", highlight=False, soft_wrap=True)
    console.print(f"{escape(str(file))} can be used: `martths study --problem {file}`.",
                  soft_wrap=True)  # fmt: skip


@app.command()
def show(file: File, out: required("out", "a picture: .png, .pdf or .svg")) -> None:
    """Draw the frame with its names, the partition in two colours, and the actuators."""
    draw_problem(read_problem(file), out)
    console.print(f"Wrote {escape(str(out))}", soft_wrap=True)


def _modes(made: FileProblem) -> ScreenTable:
    reference = made.structure.reference
    omega, shapes = natural_modes(reference.M, reference.K)
    frequency = omega / (2 * np.pi)
    share = effective_masses(reference.M, shapes, reference.influence)
    whole = float(reference.influence @ reference.M @ reference.influence)
    rows = [
        (str(i + 1), f"{f:.4g}", f"{100 * m / whole:.1f}")
        for i, (f, m) in enumerate(zip(frequency[:MOST_MODES], share, strict=False))
    ]
    title = f"Modes of the whole structure, {len(reference.dofs)} degrees of freedom"
    return ScreenTable(title, ("mode", "frequency [Hz]", "effective mass [%]"), rows)


def _rig(made: FileProblem) -> ScreenTable:
    at_rest = np.asarray(made.rig.coupler.jacobian())
    rows = [
        (name, *(f"{x:.4g}" for x in row))
        for name, row in zip(made.rig.actuators, at_rest, strict=True)
    ]
    heads = ("actuator", *(f"{dof} [mm/{'rad' if turns(dof) else 'm'}]"
                           for dof in made.structure.interface))  # fmt: skip
    return ScreenTable("Strokes by interface motion, at rest", heads, rows, text=("actuator",))
