"""``martths sensitivity``: Sobol' indices against plant, noise and motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from martths_jax.cli.console import console, error_console
from martths_jax.cli.motion_options import Motions, Pga, Records, Resample, Sa, Scale, Units
from martths_jax.cli.study import Quiet, _reporter, _set_devices
from martths_jax.cli.sweep import _words
from martths_jax.sensitivity import run_sensitivity
from martths_jax.sensitivity.results import leading
from martths_jax.study.config import read_toml
from martths_jax.study.provenance import command_line
from martths_jax.sweep.config import SHOWN


def sensitivity(
    trials: Annotated[
        int | None,
        typer.Option(
            "--trials", help="Base samples N, a power of two; N (d + 2) runs; 256 if left out."
        ),
    ] = None,
    config: Annotated[
        Path | None, typer.Option("--config", help="TOML file of a study; flags override it.")
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", help="Seed of the design; 1 if left out.")
    ] = None,
    controllers: Annotated[
        list[str] | None,
        typer.Option(
            "--controllers",
            "--controller",
            help="Controllers, separated by commas or repeated; adfc if left out.",
        ),
    ] = None,
    motions: Motions = None,
    motion_list: Annotated[
        str | None, typer.Option("--motions", help="Motions separated by commas.")
    ] = None,
    records: Records = None,
    scale: Scale = None,
    pga: Pga = None,
    sa: Sa = None,
    units: Units = None,
    resample: Resample = None,
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
    figures: Annotated[bool, typer.Option("--figures/--no-figures", help="Draw figures.")] = True,
    devices: Annotated[
        int | None, typer.Option("--devices", help="Devices to use; all, one a core, if left out.")
    ] = None,
    memory_gb: Annotated[
        float | None, typer.Option("--memory", help="Bound on the memory of the noise [GB].")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """What drives each index: Sobol' indices of plant parameters, noise and motion."""
    asked = (motions or []) + (_words([motion_list]) if motion_list else [])
    given = {
        "trials": trials, "seed": seed, "controllers": _words(controllers), "motions":
        asked or None, "records": records, "scale": scale, "pga": pga, "sa": sa, "units": units,
        "resample": resample, "out": out, "devices": devices, "memory_gb": memory_gb,
    }  # fmt: skip
    if devices is not None and devices > 0:
        _set_devices(devices)
    try:
        done = run_sensitivity(
            ({} if config is None else read_toml(config))
            | {k: v for k, v in given.items() if v is not None},
            shown=_words(index) or SHOWN,
            reporter=_reporter(quiet),
            fresh=fresh,
            figures=figures,
            command_line=command_line(),
        )
    except KeyboardInterrupt:
        error_console.print(
            "What is finished is kept; repeat the command to go on.", highlight=False
        )
        raise
    if quiet:
        return
    console.print(f"[bold]{escape(done.summary().heading)}")
    for controller in done.dataset.controller.values:
        console.print(leading(done, str(controller)))
    console.print(
        f"Results are in {escape(str(done.folder))}: sensitivity.nc, sensitivity.csv, summary.md"
        f"{', figures' if figures else ''}", highlight=False, soft_wrap=True,
    )  # fmt: skip
