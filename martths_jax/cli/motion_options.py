"""The options that say which ground motions a command runs on, the same for every command.

def run(motion: Motions = DEFAULT, records: Records = None, scale: Scale = None, ...):
    for one in load_all(motion, records, scale, pga, sa, units, resample, fs): ...
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from martths_jax.cli.console import console
from martths_jax.motions import DEFAULT_SCALE, Motion, load_motion

Motions = Annotated[
    list[str],
    typer.Option(
        "--motion",
        help="Built-in motion (elcentro-like, kobe-like, morganhill-like), name under --records, "
        "or path of a file (.mat, .npy, .AT2, .V2, .smc, .csv ...); may be repeated.",
    ),
]
Records = Annotated[
    Path | None,
    typer.Option(
        "--records",
        metavar="DIR",
        help="Folder of ground motions, found by name [default: $MARTHS_RECORDS].",
    ),
]
Scale = Annotated[
    float | None,
    typer.Option("--scale", help=f"Factor on the unscaled record [default: {DEFAULT_SCALE}]."),
]
Pga = Annotated[
    str | None, typer.Option("--pga", help="Scale to this PGA instead, such as 0.4g or 3.9m/s2.")
]
Sa = Annotated[
    str | None,
    typer.Option("--sa", help="Scale to this 5 %-damped Sa instead, such as 0.3g@2.29Hz."),
]
Units = Annotated[
    str | None,
    typer.Option("--units", help="Unit of files that do not say theirs: g, m/s2 or cm/s2."),
]
Dt = Annotated[
    float | None,
    typer.Option("--dt", metavar="S", help="Time step of files that do not say theirs [s]."),
]
Variable = Annotated[
    str | None,
    typer.Option(
        "--variable",
        metavar="NAME|NUMBER",
        help="Column, channel or array of files that hold several.",
    ),
]
Resample = Annotated[
    str,
    typer.Option("--resample", help="linear (the benchmark's) or bandlimited."),
]


def load_all(
    motions: Sequence[str],
    records: Path | None = None,
    scale: float | None = None,
    pga: str | None = None,
    sa: str | None = None,
    units: str | None = None,
    resample: str = "linear",
    fs: float = 1024,
    dt: float | None = None,
    variable: str | None = None,
) -> list[Motion]:
    """Every motion of a command, from the values of its options; prints their notices."""
    found = [
        load_motion(
            motion,
            scale=DEFAULT_SCALE if scale is None else scale,
            fs=fs,
            records=records,
            units=units,
            pga=pga,
            sa=sa,
            resample=resample,
            dt=dt,
            variable=variable,
        )
        for motion in motions
    ]
    for notice in (notice for one in found for notice in one.notices):
        console.print(f"[yellow]Note:[/] {escape(notice)}", highlight=False, soft_wrap=True)
    return found
