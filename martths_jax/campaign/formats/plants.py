"""The uncertain plants of a campaign as CSV."""

from __future__ import annotations

import json
from pathlib import Path

import xarray as xr

from martths_jax.campaign.assembly import Results
from martths_jax.campaign.dataset import problem_of
from martths_jax.campaign.draws import write_plants
from martths_jax.campaign.formats.base import Format
from martths_jax.errors import InputError


def export_plants(dataset: xr.Dataset, path: Path) -> None:
    """The uncertain plants, trials 1 ... N, as CSV, for ``--plants`` to read back exactly."""
    about = json.loads(dataset.attrs["identity"])
    problem = problem_of(dataset)
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
    export_plants(done.dataset, path)


PLANTS = Format("plants", "CSV file of the uncertain parameters of each plant", _write)
