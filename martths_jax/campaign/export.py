"""Results for other tools: tidy CSV, MATLAB file, plants as CSV."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.io import savemat

from martths_jax.campaign.draws import write_plants
from martths_jax.campaign.files import writing
from martths_jax.campaign.tidy import write_runs
from martths_jax.errors import InputError
from martths_jax.plant import Plants

#: Largest variable that MATLAB reads from such a file [bytes].
MOST_BYTES = 2**31 - 2**16


def write_csv(dataset: xr.Dataset, path: Path) -> None:
    """One row a controller, motion and trial: status, indices, peak volts.

    Numbers have all their digits; an index of a trial that diverged is empty.
    """
    write_runs(dataset, path, after=["volt_peak"])


def write_mat(dataset: xr.Dataset, path: Path, signals: Iterable[xr.Dataset] = ()) -> None:
    """MATLAB file: every variable under its name, dimensions in the order of ``dims``.

    Names are cell arrays of text; ``attributes`` and ``dims`` are structs.

    Args:
        dataset: of a study.
        path: of the file.
        signals: of each motion and controller, see ``study_signals``; they become the struct array
            ``signals`` with the fields ``motion``, ``controller``, ``trial``, ``role``, ``time``
            and one a signal, and the structs ``signal_dims`` and ``signal_units``.

    Raises:
        InputError: if the results are beyond what this format holds (2 GB a variable).
    """
    found = {n: _matlab(v.values) for n, v in dataset.variables.items()}
    found["dims"] = {
        name: np.array(v.dims, dtype=object) for name, v in dataset.variables.items() if v.dims
    }
    found["attributes"] = {k: v for k, v in dataset.attrs.items()}
    cells = list(signals)
    if cells:
        first = {name: v for cell in cells for name, v in cell.variables.items() if v.ndim > 1}
        found["signals"] = _struct_array(cells)
        found["signal_dims"] = {n: np.array(v.dims, dtype=object) for n, v in first.items()}
        found["signal_units"] = {n: v.attrs.get("units", "1") for n, v in first.items()}
    save_mat(path, found)


def study_signals(study) -> Iterator[xr.Dataset]:
    """Stored signals of each motion and controller of a ``Study`` with what all share on it."""
    for motion in study.dataset.motion.values:
        shared = study.signals(str(motion))
        for controller in study.dataset.controller.values:
            own = study.signals(str(motion), str(controller))
            yield own.merge(shared).assign_attrs(motion=str(motion), controller=str(controller))


def save_mat(path: Path, found: dict) -> None:
    """Write a MATLAB 5 file whole.

    Raises:
        InputError: a variable that the format does not hold, or the disk refuses.
    """
    for name, values in found.items():
        if _size(values) > MOST_BYTES:
            raise InputError(
                f"Variable `{name}` is too large for a MATLAB 5 file ({_size(values) / 1e9:.1f} GB "
                "of 2); keep the signals of fewer trials, or read study.nc and signals.nc with "
                "ncread."
            )
    with writing(path) as temporary, temporary.open("wb") as file:
        savemat(file, found, long_field_names=True, oned_as="column")


def _struct_array(cells: list[xr.Dataset]) -> np.ndarray:
    """A struct array with a field for all that some cell has, empty where another lacks it."""
    names = [name for cell in cells for name in cell.variables]
    fields = list(dict.fromkeys(["trial", "role", "time", *names]))
    kinds = [(name, object) for name in ("motion", "controller", *fields)]
    found = np.empty(len(cells), dtype=kinds)
    for i, cell in enumerate(cells):
        found[i]["motion"], found[i]["controller"] = cell.attrs["motion"], cell.attrs["controller"]
        for name in fields:
            found[i][name] = _matlab(cell[name].values) if name in cell.variables else np.empty(0)
    return found


def _matlab(values: np.ndarray) -> np.ndarray:
    return values.astype(object) if values.dtype.kind == "U" else values


def _size(values) -> int:
    if not isinstance(values, np.ndarray):
        return 0
    if values.dtype.names:
        return sum(_size(np.asarray(row[n])) for row in values for n in values.dtype.names)
    return values.nbytes


def export_plants(dataset: xr.Dataset, path: Path) -> None:
    """The uncertain plants, trials 1 ... N, as CSV, for ``--plants`` to read back exactly."""
    write_plants(
        Plants(dataset.draw.values[1:], dataset.trial.values[1:], _spread(dataset)), Path(path)
    )


def _spread(dataset: xr.Dataset) -> float:
    return float(json.loads(dataset.attrs["identity"])["spread"])
