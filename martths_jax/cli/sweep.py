"""``martths sweep``: a study repeated on a grid of design parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from martths_jax.cli.console import console, error_console
from martths_jax.cli.motion_options import Motions, Pga, Records, Resample, Sa, Scale, Units
from martths_jax.cli.study import Quiet, _reporter, _set_devices
from martths_jax.study.config import read_toml
from martths_jax.study.provenance import command_line
from martths_jax.sweep import make_sweep, run_sweep
from martths_jax.sweep.axes import split_axis
from martths_jax.sweep.config import SHOWN

#: A longer table than this is not printed; it is in the folder.
MOST_ROWS = 60


def _words(given: list[str] | None) -> list[str] | None:
    """A repeated option whose values may also be separated by commas."""
    if not given:
        return None
    return [word.strip() for text in given for word in text.split(",") if word.strip()]


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
    config: Annotated[
        Path | None, typer.Option("--config", help="TOML file of a study; flags override it.")
    ] = None,
    trials: Annotated[
        int | None, typer.Option("--trials", help="Uncertain plants; 200 if left out.")
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", help="Seed of all draws; 1 if left out.")
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
            "--index", help=f"Indices of figures and summary; {','.join(SHOWN)} if left out."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder of the results; sweep if left out.")
    ] = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Start over: delete the sweep in the folder.")
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
    """Repeat a study on a grid of parameters, the same plants and noise in every cell."""
    flags = {"nb": nb, "no": no, "no_fraction": no_fraction, "hop": hop, "fb": fb}
    axes = [(k, v) for k, v in flags.items() if v is not None]
    axes += [split_axis(text) for text in axis or ()]
    asked = (motions or []) + (_words([motion_list]) if motion_list else [])
    given = {
        "trials": trials, "seed": seed, "controllers": _words(controllers), "motions":
        asked or None, "records": records, "scale": scale, "pga": pga, "sa": sa, "units": units,
        "resample": resample, "out": out, "devices": devices, "memory_gb": memory_gb,
    }  # fmt: skip
    settings = {} if config is None else read_toml(config)
    chosen = make_sweep(
        axes,
        settings | {k: v for k, v in given.items() if v is not None},
        shown=_words(index) or SHOWN,
    )
    if chosen.study.devices is not None:
        _set_devices(chosen.study.devices)
    try:
        done = run_sweep(
            chosen, reporter=_reporter(quiet), fresh=fresh, figures=figures,
            command_line=command_line(),
        )  # fmt: skip
    except KeyboardInterrupt:
        error_console.print(
            f"What is finished is kept in {chosen.study.out}; repeat the command to go on.",
            highlight=False, soft_wrap=True, markup=False,
        )  # fmt: skip
        raise
    if quiet:
        return
    found = done.summary(chosen.shown)
    console.print(f"[bold]{escape(found.heading)}")
    for table in found.tables:
        if len(table.rows) <= MOST_ROWS:
            console.print(table)
    console.print(
        f"Results are in {escape(str(done.folder))}: sweep.nc, sweep.csv, summary.md"
        f"{', figures' if figures else ''}", highlight=False, soft_wrap=True,
    )  # fmt: skip
