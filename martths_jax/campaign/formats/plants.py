"""The uncertain plants of a campaign as CSV."""

from __future__ import annotations

import json
from pathlib import Path

import xarray as xr

from martths_jax.campaign.assembly import Results
from martths_jax.campaign.draws import write_plants
from martths_jax.campaign.formats.base import Format
from martths_jax.errors import InputError
from martths_jax.guests import kept
from martths_jax.problem import find_problem


def export_plants(dataset: xr.Dataset, path: Path, folder: Path | str = ".") -> None:
    """The uncertain plants, trials 1 ... N, as CSV, for ``--plants`` to read back exactly.

    Args:
        dataset: results of a run; path: of the CSV file.
        folder: of the run, which keeps a problem that was read from a file.
    """
    about = json.loads(dataset.attrs["identity"])
    problem = find_problem(kept(about["problem"], Path(folder)), about["case"])
    plants = problem.plants(
        dataset.draw.values[1:], dataset.trial.values[1:], float(about["spread"])
    )
    write_plants(plants, Path(path), problem)


def _write(done: Results, path: Path, signals: bool) -> None:
    if "draw" not in done.dataset:
        raise InputError(
            f"{done.folder} holds a sensitivity analysis, whose design draws the plants; give the "
            "folder of a study or a sweep."
        )
    export_plants(done.dataset, path, done.folder)


PLANTS = Format("plants", "CSV file of the uncertain parameters of each plant", _write)
