"""The motion in a MATLAB file: which array it is, its time and its unit."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..timeaxis import uniform_step
from ..units import is_unit, looks_like_unit, parse_unit
from .arrays import from_array, is_table, is_vector
from .columns import pick, several, time_column
from .contents import Contents
from .mat_files import Variables, is_hdf5, read_variables

#: Arrays of the benchmark's companion package: in m/s^2, though their files do not say so.
BENCHMARK_ARRAYS = ("ElCentroAccel", "KobeAccel", "MorganAccel")

_TIME_NAMES = re.compile(r"(^|\.)(t|time|tt|time_s|times|tout)$", re.IGNORECASE)
_STEP_NAMES = re.compile(r"(^|\.)(dt|delta_?t|time_?step|step)$", re.IGNORECASE)
_UNIT_NAMES = re.compile(r"(^|\.)(units?|unit_?acc\w*)$", re.IGNORECASE)
_SIGNALS = re.compile(r"\.signals(\(\d+\))?$")


def is_matlab(content: bytes) -> bool:
    """Whether a file says that it is MATLAB's (version 5) or HDF5 (version 7.3)."""
    return content[:10] == b"MATLAB 5.0" or is_hdf5(content)


def read_matlab(path: Path, content: bytes, *, variable=None, dt=None) -> Contents:
    """Acceleration of a ``.mat`` file.

    Accepted: an array 2 x N or N x 2 (time [s], acceleration); a vector with a time vector
    (``t``, ``time``) or a step (``dt``) beside it, or with the time step given; the same inside a
    struct, and Simulink's structure with time (``time`` beside ``signals.values``).  With several
    candidates `variable` must pick one, and ``array:3`` its third column.
    """
    held = read_variables(path, content)
    arrays = held.arrays
    variable, _, column = (variable or "").partition(":")
    tables = {k: a for k, a in arrays.items() if _is_timed(a)}
    vectors = {k: a for k, a in arrays.items() if is_vector(a) and not _TIME_NAMES.search(k)}
    name = _choose(path, held, tables or vectors, variable or None)
    where = f"File {path}, array `{name}`"
    array = arrays[name]
    if array.size == 0:
        raise InputError(
            f"{where} is empty; pick another array in `variable` (--variable) or another file."
        )
    if not (is_vector(array) or (array.ndim == 2 and min(array.shape) > 1)):
        raise InputError(
            f"{where} has the shape {' x '.join(map(str, array.shape))}, but 2 x N, N x 2 (time, "
            "acceleration) or a vector is wanted; pick another array in `variable` (--variable)."
        )
    beside = _step_beside(arrays, name, max(array.shape), where, dt)
    upright = array if array.shape[0] >= array.shape[1] else array.T
    if beside is not None and not is_vector(array) and time_column(upright) is None:
        names = [""] * upright.shape[1]
        if not column:
            raise several(where, names, list(range(len(names))))
        values = upright[:, pick(column, names, where)]
        found = Contents(values, None, None, where)
    else:
        found = from_array(array, where, variable=column or None, dt=dt)
    if found.dt is None and beside is not None:
        found = replace(found, dt=beside[0], notices=beside[1])
    return replace(found, unit=_unit(path, held, name))


def _is_timed(array: np.ndarray) -> bool:
    """Whether an array could hold a time and an acceleration: 2 x N, N x 2, or more columns."""
    if is_table(array):
        return True
    if array.ndim != 2 or not 2 < min(array.shape) <= 12 or array.shape[0] == array.shape[1]:
        return False
    return time_column(array.T if array.shape[0] < array.shape[1] else array) is not None


def _unit(path: Path, held: Variables, name: str) -> str | None:
    """The unit in a text called ``units`` beside the array; the benchmark's arrays are known."""
    if name in BENCHMARK_ARRAYS:
        return "m/s2"
    folder = name.rpartition(".")[0]
    for other, text in held.texts.items():
        if _UNIT_NAMES.search(other) and other.rpartition(".")[0] == folder:
            if is_unit(text) or looks_like_unit(text):
                return parse_unit(text, f"File {path}, `{other}`")
    return None


def _choose(path: Path, held: Variables, candidates: dict, variable: str | None) -> str:
    arrays = held.arrays
    listed = ", ".join(
        f"{name} ({' x '.join(map(str, array.shape))})" for name, array in list(arrays.items())[:12]
    )
    if variable is not None and variable in arrays:
        return variable
    if held.objects and (variable is not None or not candidates):
        raise InputError(
            f"File {path} holds {', '.join(held.objects[:6])}, which only MATLAB can open; "
            "save its numbers there: t = ts.Time; acc = ts.Data; save('record.mat', 't', 'acc')."
        )
    if variable is not None:
        raise InputError(
            f"File {path} has no numeric array `{variable}`; it holds {listed or 'none'}."
        )
    if len(candidates) == 1:
        return next(iter(candidates))
    empty = [name for name, array in arrays.items() if array.size == 0]
    if not candidates and len(empty) == 1:
        return empty[0]
    if not candidates:
        raise InputError(
            f"File {path} has no array that could be a motion (2 x N or N x 2: time and "
            f"acceleration, or a vector); it holds {listed or 'no numeric array'}."
        )
    raise InputError(
        f"File {path} has {len(candidates)} arrays that could be the motion: "
        f"{', '.join(list(candidates)[:12])}; pick one in `variable` (--variable)."
    )


def _step_beside(arrays: dict, name: str, size: int, where: str, dt: float | None):
    """Time step and notices from a time vector or a step stored next to the acceleration.

    Simulink keeps the time one level above ``signals.values``.
    """
    folder = name.rpartition(".")[0]
    folders = [folder]
    if _SIGNALS.search(folder):
        folders.append(folder.rpartition(".")[0])
    for other, array in arrays.items():
        if other == name or other.rpartition(".")[0] not in folders:
            continue
        if _TIME_NAMES.search(other) and array.size == size:
            return uniform_step(array.ravel(), where, None, dt)
        if _STEP_NAMES.search(other) and array.size == 1:
            step = float(array.ravel()[0])
            if not (np.isfinite(step) and step > 0):
                raise InputError(f"{where}: its time step `{other}` is {step}, not positive.")
            return step, ()
    return None
