"""``martths export``: results for other tools."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer
import xarray as xr
from rich.markup import escape

from martths_jax.campaign.assembly import Results
from martths_jax.campaign.export import export_plants, study_signals, write_csv, write_mat
from martths_jax.cli.console import console
from martths_jax.cli.options import option
from martths_jax.cli.study import Signals
from martths_jax.errors import InputError
from martths_jax.sensitivity import open_sensitivity
from martths_jax.sensitivity.results import write_csv as write_sensitivity
from martths_jax.study import open_study
from martths_jax.sweep import open_sweep
from martths_jax.sweep.results import write_csv as write_sweep

#: The result file of a kind of campaign: what reads it, and what writes its tidy table.
KINDS: dict[str, tuple[Callable[..., Results], Callable[[xr.Dataset, Path], None]]] = {
    "sweep.nc": (open_sweep, write_sweep),
    "sensitivity.nc": (open_sensitivity, write_sensitivity),
    "study.nc": (open_study, write_csv),
}


def export(
    folder: Annotated[
        Path, typer.Argument(help="Folder of a study, a sweep or a sensitivity analysis.")
    ],
    mat: option(Path | None, "--mat", metavar="FILE", help="MATLAB file to write") = None,
    csv: option(Path | None, "--csv", metavar="FILE", help="Tidy CSV file to write") = None,
    plants: option(
        Path | None,
        "--plants",
        metavar="FILE",
        help="CSV file of the nine parameters of each plant",
    ) = None,
    signals: Signals = True,
) -> None:
    """Write finished results, signals or plants for other tools."""
    if not any((mat, csv, plants)):
        raise InputError("Say what to export: --mat FILE, --csv FILE or --plants FILE.")
    name = next((n for n in KINDS if (folder / n).is_file()), "study.nc")
    read, write = KINDS[name]
    done = read(folder)
    if plants is not None and "draw" not in done.dataset:
        raise InputError(
            f"{folder} holds a sensitivity analysis, whose design draws the plants; --plants takes "
            "those of a study or a sweep."
        )
    stored = signals and name == "study.nc" and (folder / "signals.nc").is_file()
    if mat is not None:
        write_mat(done.dataset, mat, study_signals(done) if stored else ())
    if csv is not None:
        write(done.dataset, csv)
    if plants is not None:
        export_plants(done.dataset, plants)
    for path in filter(None, (mat, csv, plants)):
        console.print(f"Wrote {escape(str(path))}", highlight=False, soft_wrap=True)
