"""MATLAB files, version 5 (SciPy) and 7.3 (HDF5, h5py)."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..checks import check_memory, uniform_step
from .contents import Contents

#: Arrays of the benchmark's companion package: in m/s^2, though their files do not say so.
BENCHMARK_ARRAYS = ("ElCentroAccel", "KobeAccel", "MorganAccel")

_TIME_NAMES = re.compile(r"(^|\.)(t|time|tt|time_s|times)$", re.IGNORECASE)
_STEP_NAMES = re.compile(r"(^|\.)(dt|delta_?t|time_?step|step)$", re.IGNORECASE)
_HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"


def read_matlab(path: Path, content: bytes, *, variable=None, dt=None) -> Contents:
    """Acceleration of a ``.mat`` file.

    Accepted: an array 2 x N or N x 2 (time [s], acceleration); a vector with a time vector
    (``t``, ``time``) or a step (``dt``) beside it, or with the time step given; the same inside a
    struct.  With several candidates `variable` must pick one.
    """
    arrays = _read_arrays(path, content)
    tables = {k: a for k, a in arrays.items() if _is_table(a)}
    vectors = {k: a for k, a in arrays.items() if _is_vector(a) and not _TIME_NAMES.search(k)}
    name = _choose(path, arrays, tables or vectors, variable)
    where = f"File {path}, array `{name}`"
    array = arrays[name]
    if array.size == 0:
        raise InputError(f"{where} is empty; pick another array (--variable) or file.")
    unit = "m/s2" if name in BENCHMARK_ARRAYS else None
    if _is_table(array):
        time, values = array if array.shape[0] == 2 else array.T
        if np.any(np.diff(time) <= 0) and np.all(np.diff(values) > 0):
            time, values = values, time
        return Contents(values, uniform_step(time, where), unit, where)
    if not _is_vector(array):
        raise InputError(
            f"{where} has the shape {' x '.join(map(str, array.shape))}, but 2 x N, N x 2 (time, "
            "acceleration) or a vector is wanted; pick another array with --variable."
        )
    values = array.ravel()
    return Contents(values, _step_beside(arrays, name, values.size, where), unit, where)


def _is_table(array: np.ndarray) -> bool:
    return array.ndim == 2 and 2 in array.shape and min(array.shape) > 1


def _is_vector(array: np.ndarray) -> bool:
    return array.size > 1 and array.size == max(array.shape)


def _choose(path: Path, arrays: dict, candidates: dict, variable: str | None) -> str:
    listed = ", ".join(
        f"{name} ({' x '.join(map(str, array.shape))})" for name, array in list(arrays.items())[:12]
    )
    if variable is not None:
        if variable in arrays:
            return variable
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
        f"{', '.join(list(candidates)[:12])}; pick one with --variable."
    )


def _step_beside(arrays: dict, name: str, size: int, where: str) -> float | None:
    """Time step from a time vector or a step stored next to the acceleration vector."""
    folder = name.rpartition(".")[0]
    for other, array in arrays.items():
        if other == name or other.rpartition(".")[0] != folder:
            continue
        if _TIME_NAMES.search(other) and array.size == size:
            return uniform_step(array.ravel(), where)
        if _STEP_NAMES.search(other) and array.size == 1:
            step = float(array.ravel()[0])
            if not (np.isfinite(step) and step > 0):
                raise InputError(f"{where}: its time step `{other}` is {step}, not positive.")
            return step
    return None


def _read_arrays(path: Path, content: bytes) -> dict[str, np.ndarray]:
    """Every real numeric array of the file by its (dotted) name, as float64."""
    try:
        if content[:8] == _HDF5_MAGIC or content[512:520] == _HDF5_MAGIC:
            return _read_hdf5(path, content)
        return _read_version5(path, content)
    except InputError:
        raise
    except MemoryError:
        raise InputError(f"File {path} holds an array that does not fit in memory.") from None
    except Exception as error:  # damaged files make SciPy and h5py raise nearly anything
        reason = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        raise InputError(
            f"File {path} cannot be read as a MATLAB file ({reason}); save it again from MATLAB, "
            "or export it as CSV."
        ) from None


def _as_numbers(value: object) -> np.ndarray | None:
    array = np.asarray(value)
    if array.dtype.kind not in "fiu" or array.ndim > 2:
        return None
    return array.astype(np.float64)


def _read_version5(path: Path, content: bytes) -> dict[str, np.ndarray]:
    from scipy.io import loadmat, whosmat

    for name, shape, _ in whosmat(io.BytesIO(content)):
        check_memory(np.prod(np.asarray(shape, dtype=np.float64)), f"File {path}, array `{name}`")
    loaded = loadmat(io.BytesIO(content), struct_as_record=False, squeeze_me=False)
    arrays: dict[str, np.ndarray] = {}

    def collect(name: str, value: object, depth: int = 0) -> None:
        if depth > 4:
            return
        if isinstance(value, np.ndarray) and value.dtype == object and value.size == 1:
            value = value.ravel()[0]
        if hasattr(value, "_fieldnames"):
            for field in value._fieldnames:
                collect(f"{name}.{field}", getattr(value, field), depth + 1)
        elif (numbers := _as_numbers(value)) is not None:
            arrays[name] = numbers

    for name, value in loaded.items():
        if not name.startswith("__"):
            collect(name, value)
    return arrays


def _read_hdf5(path: Path, content: bytes) -> dict[str, np.ndarray]:
    import h5py

    arrays: dict[str, np.ndarray] = {}
    with h5py.File(io.BytesIO(content), "r") as file:

        def collect(name: str, item: object) -> None:
            if not isinstance(item, h5py.Dataset) or name.startswith("#"):
                return
            if item.dtype.kind not in "fiu" or item.ndim > 2:
                return
            if item.attrs.get("MATLAB_class", b"double") in (b"char", b"cell", b"logical"):
                return
            dotted = name.replace("/", ".")
            if item.attrs.get("MATLAB_empty", 0):
                arrays[dotted] = np.empty((0, 0))
                return
            check_memory(float(item.size), f"File {path}, array `{dotted}`")
            arrays[dotted] = np.asarray(item[()], dtype=np.float64)

        file.visititems(collect)
    return arrays
