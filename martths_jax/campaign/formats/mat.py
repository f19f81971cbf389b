"""Results as a MATLAB file."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.io import savemat

from martths_jax.campaign.assembly import Results
from martths_jax.campaign.files import writing
from martths_jax.campaign.formats.base import Format
from martths_jax.errors import InputError

#: Largest variable that MATLAB reads from such a file [bytes].
MOST_BYTES = 2**31 - 2**16


def write_mat(dataset: xr.Dataset, path: Path, signals: Iterable[xr.Dataset] = ()) -> None:
    """MATLAB file: every variable under its name, dimensions in the order of ``dims``.

    Names are cell arrays of text; ``attributes`` and ``dims`` are structs.

    Args:
        dataset: of a study.
        path: of the file.
        signals: of each motion and controller, see ``Results.stored_signals``; they become the
            struct array ``signals`` with the fields ``motion``, ``controller``, ``trial``,
            ``role``, ``time`` and one a signal; ``signal_dims`` and ``signal_units`` are structs.

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


def _write(done: Results, path: Path, signals: bool) -> None:
    write_mat(done.dataset, path, done.stored_signals() if signals else ())


MAT = Format("mat", "MATLAB file to write", _write)
