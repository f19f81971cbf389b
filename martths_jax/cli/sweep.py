"""``martths sweep``: a study repeated on a grid of design parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from martths_jax.campaign.config import read_toml
from martths_jax.campaign.provenance import command_line
from martths_jax.cli.console import console
from martths_jax.cli.motion_options import (
    Dt,
    Motions,
    Pga,
    Records,
    Resample,
    Sa,
    Scale,
    Units,
    Variable,
)
from martths_jax.cli.run_options import (
    AllowMixed,
    Config,
    Controllers,
    Devices,
    Figures,
    Indices,
    Memory,
    MotionList,
    Quiet,
    given_settings,
    reporter_for,
    say_what_is_kept,
    set_devices,
    words,
)
from martths_jax.sweep import make_sweep, run_sweep
from martths_jax.sweep.axes import split_axis
from martths_jax.sweep.config import SHOWN

#: A longer table than this is not printed; it is in the folder.
MOST_ROWS = 60


def _axis(name: str, what: str):
    return typer.Option(name, metavar="VALUES", help=f"Axis: {what}.")


def sweep(
    nb: Annotated[str | None, _axis("--nb", "buffer length Nb, as 128,256,512")] = None,
    no: Annotated[str | None, _axis("--no", "overlap No in samples")] = None,
    no_fraction: Annotated[
        str | None, _axis("--no-fraction", "overlap as a share of Nb; 1 is every sample")
    ] = None,
    hop: Annotated[str | None, _axis("--hop", "Nb - No in samples, instead of No")] = None,
    fb: Annotated[str | None, _axis("--fb", "update rate in Hz, instead of No")] = None,
    axis: Annotated[
        list[str] | None,
        typer.Option(
            "--axis",
            metavar="NAME=VALUES",
            help="Any axis: lambda=1e-8:1e-4:log9, scale=0.1:1:lin5, q=1e-6,1e-5; also "
            "noise_power, fs, alpha, p, spread; may be repeated.",
        ),
    ] = None,
    config: Config = None,
    trials: Annotated[
        int | None, typer.Option("--trials", help="Uncertain plants; 200 if left out.")
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", help="Seed of all draws; 1 if left out.")
    ] = None,
    controllers: Controllers = None,
    motions: Motions = None,
    motion_list: MotionList = None,
    records: Records = None,
    scale: Scale = None,
    pga: Pga = None,
    sa: Sa = None,
    units: Units = None,
    dt: Dt = None,
    variable: Variable = None,
    resample: Resample = None,
    indices: Indices = None,
    index: Annotated[
        list[str] | None,
        typer.Option(
            "--index", help=f"Indices of figures and summary; {','.join(SHOWN)} if left out."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder of the results; sweep if left out.")
    ] = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Start over: delete the sweep in the folder.")
    ] = False,
    figures: Figures = True,
    devices: Devices = None,
    memory_gb: Memory = None,
    allow_mixed: AllowMixed = False,
    quiet: Quiet = False,
) -> None:
    """Repeat a study on a grid of parameters, the same plants and noise in every cell."""
    flags = {"nb": nb, "no": no, "no_fraction": no_fraction, "hop": hop, "fb": fb}
    axes = [(k, v) for k, v in flags.items() if v is not None]
    axes += [split_axis(text) for text in axis or ()]
    given = given_settings(
        motions, motion_list, trials=trials, seed=seed, controllers=controllers, indices=indices,
        records=records,
        scale=scale, pga=pga, sa=sa, units=units, dt=dt, variable=variable, resample=resample,
        out=out, devices=devices, memory_gb=memory_gb,
    )  # fmt: skip
    settings = {} if config is None else read_toml(config)
    chosen = make_sweep(
        axes,
        settings | given,
        shown=words(index) or SHOWN,
    )
    if chosen.study.devices is not None:
        set_devices(chosen.study.devices)
    try:
        done = run_sweep(
            chosen, reporter=reporter_for(quiet), fresh=fresh, figures=figures,
            allow_mixed=allow_mixed, command_line=command_line(),
        )  # fmt: skip
    except KeyboardInterrupt:
        say_what_is_kept(chosen.study.out)
        raise
    if quiet:
        return
    found = done.summary(chosen.shown)
    console.print(f"[bold]{escape(found.heading)}", highlight=False, soft_wrap=True)
    for table in found.tables:
        if len(table.rows) <= MOST_ROWS:
            console.print(table)
    console.print(
        f"Results are in {escape(str(done.folder))}: sweep.nc, sweep.csv, summary.md"
        f"{', figures' if figures else ''}", highlight=False, soft_wrap=True,
    )  # fmt: skip
