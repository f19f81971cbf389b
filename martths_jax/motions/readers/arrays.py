"""Arrays of numbers (from Python, ``.npy`` and MATLAB files) as a motion."""

from __future__ import annotations

import numpy as np

from ...errors import InputError
from ..timeaxis import is_time, uniform_step
from .columns import pick, several, time_column
from .contents import Contents

_MOST = 12


def is_table(array: np.ndarray) -> bool:
    """Whether an array is 2 x N or N x 2."""
    return array.ndim == 2 and 2 in array.shape and min(array.shape) > 1


def is_vector(array: np.ndarray) -> bool:
    """Whether an array is a row or a column of numbers."""
    return array.size > 1 and array.size == max(array.shape)


def from_array(array: np.ndarray, where: str, *, variable=None, dt=None) -> Contents:
    """Acceleration of a vector, of 2 x N or N x 2 (time [s], acceleration), or of one more column.

    With more than two rows or columns the first that is a time is it, and `variable` picks the
    acceleration by its number, counted from 1.
    """
    if array.size == 0:
        raise InputError(f"{where} is empty; give another array or file.")
    if is_vector(array):
        if variable is not None:
            raise InputError(
                f"{where} is one series, so that `variable` (--variable) picks nothing; leave it "
                "out."
            )
        return Contents(array.ravel(), None, None, where)
    if array.ndim != 2 or min(array.shape) < 2 or min(array.shape) > _MOST:
        raise InputError(
            f"{where} has the shape {' x '.join(map(str, array.shape))}, but 2 x N, N x 2 (time, "
            "acceleration) or a vector is wanted; give another array."
        )
    matrix = _upright(array)
    if is_table(array) and variable is None:
        time, values = matrix.T
        if np.any(np.diff(time) <= 0) and np.all(np.diff(values) > 0):
            time, values = values, time
        step, notices = uniform_step(time, where, None, dt)
        return Contents(values, step, None, where, None, notices)
    names = [""] * matrix.shape[1]
    k = time_column(matrix)
    if variable is None:
        raise several(where, names, [c for c in range(len(names)) if c != k])
    choice = pick(variable, names, where)
    if choice == k:
        raise InputError(
            f"{where}: column {choice + 1}, which `variable` (--variable) picks, is the time; pick "
            "an acceleration."
        )
    if k is None:
        return Contents(matrix[:, choice], None, None, where)
    step, notices = uniform_step(matrix[:, k], where, None, dt)
    return Contents(matrix[:, choice], step, None, where, None, notices)


def _upright(array: np.ndarray) -> np.ndarray:
    """The array with its series in columns, the longer way; in a square the time says which."""
    rows, columns = array.shape
    if rows == columns and not is_time(array[0]) and is_time(array[:, 0]):
        return array
    return array.T if rows <= columns else array


def real_numbers(array: object, where: str) -> np.ndarray:
    """An array as float64; `InputError` where it does not hold real numbers."""
    try:
        array = np.asarray(array)
    except ValueError:  # rows of different lengths
        array = np.asarray(None)
    if array.dtype.kind not in "fiu":
        raise InputError(
            f"{where} must hold real numbers, but holds {array.dtype}; give 2 x N, N x 2 (time, "
            "acceleration) or a vector of floats."
        )
    return array.astype(np.float64)
