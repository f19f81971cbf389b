"""Results for other tools: tidy CSV, MATLAB file, plants as CSV."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.io import savemat

from martths_jax.errors import InputError
from martths_jax.plant import Plants
from martths_jax.study.draws import write_plants
from martths_jax.study.files import writing
from martths_jax.text import csv_field
from martths_jax.watch import Status


def write_csv(dataset: xr.Dataset, path: Path) -> None:
    """One row a controller, motion and trial: status, indices, peak volts.

    Numbers have all their digits; an index of a trial that diverged is empty.
    """
    names = [str(n) for n in dataset["index"].values]
    heads = ["controller", "motion", "trial", "status", *names, "volt_peak_1", "volt_peak_2"]
    words = {int(s): s.name.lower() for s in Status}
    with writing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(heads) + "\n")
        for controller in dataset.controller.values:
            for motion in dataset.motion.values:
                cell = dataset.sel(controller=controller, motion=motion)
                start = f"{csv_field(controller)},{csv_field(motion)}"
                numbers = np.hstack([cell.value.values, cell.volt_peak.values]).tolist()
                for trial, status, row in zip(
                    cell.trial.values, cell.status.values, numbers, strict=True
                ):
                    cells = ",".join("" if x != x else repr(x) for x in row)
                    file.write(f"{start},{trial},{words[int(status)]},{cells}\n")


def write_mat(dataset: xr.Dataset, path: Path) -> None:
    """MATLAB file: every variable under its name, dimensions in the order of ``dims``.

    Names are cell arrays of text; ``attributes`` and ``dims`` are structs.

    Raises:
        InputError: if the results are beyond what this format holds (4 GB a variable).
    """
    found = {}
    for name, variable in dataset.variables.items():
        values = variable.values
        if values.nbytes >= 2**32 - 2**16:
            raise InputError(
                f"Variable `{name}` is too large for a MATLAB 5 file; read study.nc with ncread."
            )
        found[name] = values.astype(object) if values.dtype.kind == "U" else values
    found["dims"] = {
        name: np.array(v.dims, dtype=object) for name, v in dataset.variables.items() if v.dims
    }
    found["attributes"] = {k: v for k, v in dataset.attrs.items()}
    with writing(path) as temporary, temporary.open("wb") as file:
        savemat(file, found, long_field_names=True, oned_as="column")


def export_plants(dataset: xr.Dataset, path: Path) -> None:
    """The uncertain plants, trials 1 ... N, as CSV, for ``--plants`` to read back exactly."""
    write_plants(
        Plants(dataset.draw.values[1:], dataset.trial.values[1:], _spread(dataset)), Path(path)
    )


def _spread(dataset: xr.Dataset) -> float:
    return float(json.loads(dataset.attrs["identity"])["spread"])
