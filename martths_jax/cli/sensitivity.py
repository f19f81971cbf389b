"""``martths sensitivity``: Sobol' indices against plant, noise and motion."""

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
from martths_jax.sensitivity import run_sensitivity
from martths_jax.sensitivity.results import leading
from martths_jax.sweep.config import SHOWN


def sensitivity(
    trials: Annotated[
        int | None,
        typer.Option(
            "--trials", help="Base samples N, a power of two; N (d + 2) runs; 256 if left out."
        ),
    ] = None,
    config: Config = None,
    seed: Annotated[
        int | None, typer.Option("--seed", help="Seed of the design; 1 if left out.")
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
            "--index", help=f"Indices of the tornado chart; {','.join(SHOWN)} if left out."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder of the results; sensitivity if left out.")
    ] = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Start over: delete the analysis in the folder.")
    ] = False,
    figures: Figures = True,
    devices: Devices = None,
    memory_gb: Memory = None,
    allow_mixed: AllowMixed = False,
    quiet: Quiet = False,
) -> None:
    """What drives each index: Sobol' indices of plant parameters, noise and motion."""
    given = given_settings(
        motions, motion_list, trials=trials, seed=seed, controllers=controllers, indices=indices,
        records=records,
        scale=scale, pga=pga, sa=sa, units=units, dt=dt, variable=variable, resample=resample,
        out=out, devices=devices, memory_gb=memory_gb,
    )  # fmt: skip
    if devices is not None and devices > 0:
        set_devices(devices)
    try:
        done = run_sensitivity(
            ({} if config is None else read_toml(config)) | given,
            shown=words(index) or SHOWN,
            reporter=reporter_for(quiet),
            fresh=fresh,
            figures=figures,
            allow_mixed=allow_mixed,
            command_line=command_line(),
        )
    except KeyboardInterrupt:
        say_what_is_kept(out or "sensitivity")
        raise
    if quiet:
        return
    console.print(f"[bold]{escape(done.summary().heading)}", highlight=False, soft_wrap=True)
    for controller in done.dataset.controller.values:
        console.print(leading(done, str(controller)))
    console.print(
        f"Results are in {escape(str(done.folder))}: sensitivity.nc, sensitivity.csv, summary.md"
        f"{', figures' if figures else ''}", highlight=False, soft_wrap=True,
    )  # fmt: skip
