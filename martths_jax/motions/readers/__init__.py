"""Readers of ground-motion files, one format a module, behind one function."""

from __future__ import annotations

import hashlib
import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...errors import InputError, argument_error
from ..checks import check_memory, file_bytes, finite_values
from ..plausible import plausibility
from ..record import Record
from ..units import TO_SI, parse_unit
from .arrays import from_array, real_numbers
from .contents import Contents
from .formats import READERS, reader_of

__all__ = ["READERS", "read_record", "record_of_array"]


def read_record(
    path: Path,
    *,
    name: str = "",
    units: str | None = None,
    dt: float | None = None,
    variable: str | int | None = None,
) -> Record:
    """The unscaled `Record` in a file; every failing is an `InputError`.

    Args:
        path: the file; what it holds and its ending pick the reader.
        name: name of the record (default: the file name without its ending).
        units: unit of the numbers, where the file does not say it.
        dt: time step [s], where the file has no time.
        variable: column of a table, channel of a file with several, by name or number from 1; array
            of a MATLAB file (``struct.field``, or ``array:3`` for its third column).
    """
    _check_arguments(dt, variable)
    content = file_bytes(path)
    reader = reader_of(path, content)
    found = reader(path, content, variable=None if variable is None else str(variable), dt=dt)
    digest = hashlib.sha256(content).hexdigest()
    return _settled(found, name or path.stem, str(path), digest, units, dt)


def record_of_array(
    array: object,
    *,
    units: str | None = None,
    dt: float | None = None,
    variable: str | int | None = None,
    name: str = "array",
) -> Record:
    """The unscaled `Record` in a vector, in 2 x N or N x 2, or in a column (`variable`)."""
    where = "Array"
    _check_arguments(dt, variable)
    numbers = real_numbers(array, where)
    check_memory(numbers.size, where)
    found = from_array(numbers, where, variable=None if variable is None else str(variable), dt=dt)
    plain = np.ascontiguousarray(numbers, dtype="<f8")
    digest = hashlib.sha256(repr(plain.shape).encode() + plain.tobytes()).hexdigest()
    return _settled(found, name, "array", digest, units, dt)


def _check_arguments(dt: float | None, variable: object) -> None:
    number = isinstance(dt, (int, float, np.integer, np.floating)) and not isinstance(dt, bool)
    if dt is not None and not (number and math.isfinite(dt) and dt > 0):
        raise argument_error("dt", "be a positive time step [s] (--dt)", repr(dt))
    if variable is not None and (not isinstance(variable, (str, int)) or variable == ""):
        raise argument_error("variable", "be a name or a number (--variable)", repr(variable))


def _settled(
    found: Contents, name: str, source: str, digest: str, units: str | None, dt: float | None
) -> Record:
    """The record of what a reader found and what was asked, where they do not contradict."""
    unit = _unit_of(found, units)
    values = finite_values(found.values, found.where, found.lines)
    step = found.dt if found.dt is not None else dt
    if step is None:
        raise InputError(
            f"{found.where} has no time column and no time step; give the time step in `dt` "
            "(--dt 0.005)."
        )
    if found.dt is not None and dt is not None and abs(found.dt / dt - 1) > 1e-3:
        raise InputError(
            f"{found.where} has the time step {found.dt:.6g} s, but `dt` (--dt) says {dt:.6g} s; "
            "leave it out, or correct the file's times."
        )
    with np.errstate(over="ignore"):
        acceleration = values * TO_SI[unit]
    if not np.all(np.isfinite(acceleration)):
        raise InputError(f"{found.where} overflows in m/s^2; check its numbers and its unit.")
    record = Record(name, acceleration, float(step), source, digest, found.notices)
    return replace(record, notices=(*record.notices, *plausibility(record, unit)))


def _unit_of(found: Contents, asked: str | None) -> str:
    wanted = parse_unit(asked, "Argument `units` (--units)") if asked else None
    if found.unit is None:
        if wanted is None:
            raise InputError(
                f"{found.where} does not say the unit of its acceleration, which could be "
                f"{', '.join(TO_SI)}; give it in `units` (--units m/s2)."
            )
        return wanted
    if wanted is not None and wanted != found.unit:
        raise InputError(
            f"{found.where} says that its unit is {found.unit}, but `units` (--units) says "
            f"{wanted}; leave it out, or correct the file."
        )
    return found.unit
