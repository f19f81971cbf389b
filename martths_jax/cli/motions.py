"""``martths motions``: list, show and make ground motions."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.markup import escape
from rich.progress import Progress

from martths_jax.cli.console import console
from martths_jax.cli.motion_options import Dt, Records, Units, Variable
from martths_jax.cli.options import option, required, setting
from martths_jax.motions import MotionInfo, available_motions, load_record, write_ensemble
from martths_jax.motions.figure import draw_motion
from martths_jax.motions.overview import FIRST_MODE
from martths_jax.motions.units import G
from martths_jax.screen import ScreenTable
from martths_jax.text import counted

app = typer.Typer(help="List, show and make ground motions.")

COLUMNS = (
    ("dt [s]", lambda i: f"{i.dt:.4g}"),
    ("length [s]", lambda i: f"{i.duration:.2f}"),
    ("PGA [g]", lambda i: f"{i.measures['PGA'] / G:.3f}"),
    ("PGV [m/s]", lambda i: f"{i.measures['PGV']:.3f}"),
    ("Arias [m/s]", lambda i: f"{i.measures['Arias']:.3f}"),
    ("CAV [m/s]", lambda i: f"{i.measures['CAV']:.2f}"),
    ("D5-95 [s]", lambda i: f"{i.measures['D5-95']:.2f}"),
    (f"Sa({FIRST_MODE:.2f} Hz) [g]", lambda i: f"{i.measures['Sa'] / G:.3f}"),
)


@app.callback(invoke_without_command=True)
def motions(
    context: typer.Context,
    records: Records = None,
    units: Units = None,
    dt: Dt = None,
    variable: Variable = None,
) -> None:
    """List the motions there are, unscaled, with their intensity measures."""
    if context.invoked_subcommand is None:
        found = available_motions(records, units, dt, variable)
        console.print(_table(found))
        for notice in (notice for info in found for notice in info.notices):
            console.print(f"[yellow]Note:[/] {escape(notice)}", highlight=False, soft_wrap=True)


def _table(found: list[MotionInfo]) -> ScreenTable:
    rows = []
    for info in found:
        cells = ["?" if info.problem else text(info) for _, text in COLUMNS]
        rows.append((info.name, *cells, info.problem or info.source))
    heads = ("name", *(title for title, _ in COLUMNS), "from")
    return ScreenTable("Ground motions, unscaled; 5 % damping", heads, rows, text=("name", "from"))


@app.command()
def show(
    name: Annotated[str, typer.Argument(help="Name or path of a motion.")],
    out: required("out", "a picture: .png, .pdf or .svg"),
    records: Records = None,
    units: Units = None,
    dt: Dt = None,
    variable: Variable = None,
) -> None:
    """Draw a motion's acceleration, Arias build-up and response spectrum."""
    record = load_record(name, records=records, units=units, dt=dt, variable=variable)
    for notice in record.notices:
        console.print(f"[yellow]Note:[/] {escape(notice)}", highlight=False, soft_wrap=True)
    draw_motion(record, out)
    console.print(f"Wrote {escape(str(out))}", soft_wrap=True)


@app.command()
def make(
    like: option(str, "--like", help="Target: elcentro, kobe, morganhill, or any motion"),
    out: required("out", "a folder"),
    count: option(int, "--count", help="Number of motions") = 10,
    seed: setting("seed") = 0,
    records: Records = None,
    units: Units = None,
    dt: Dt = None,
    variable: Variable = None,
) -> None:
    """Make different motions compatible with one target spectrum, intensity and duration."""
    with Progress(console=console, transient=True) as bar:
        task = bar.add_task("making motions", total=count)
        lines = write_ensemble(
            like,
            count,
            out,
            seed=seed,
            records=records,
            units=units,
            dt=dt,
            variable=variable,
            progress=lambda done, total: bar.update(task, completed=done),
        )
    accepted = sum(line["accepted"] for line in lines)
    console.print(
        f"Wrote {counted(len(lines), 'motion')} to {escape(str(out))}; {accepted} within the "
        "limits on spectrum, PGA, Arias intensity and D5-95 (see ensemble.json).",
        soft_wrap=True,
    )
