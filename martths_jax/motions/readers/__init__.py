"""Readers of ground-motion files, one format a module, behind one function."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path

import numpy as np

from ...errors import InputError, argument_error
from ..checks import file_bytes, finite_values
from ..record import Record
from ..units import TO_SI, parse_unit
from .contents import Contents
from .matlab import read_matlab
from .peer import read_at2
from .table import read_table

#: File name endings that are taken for a ground motion, and who reads them.
READERS = {
    ".mat": read_matlab,
    ".at2": read_at2,
    ".csv": read_table,
    ".txt": read_table,
    ".dat": read_table,
}


def read_record(
    path: Path,
    *,
    name: str = "",
    units: str | None = None,
    dt: float | None = None,
    variable: str | None = None,
) -> Record:
    """The unscaled `Record` in a file; every failing is an `InputError`.

    Args:
        path: the file; its ending picks the reader.
        name: name of the record (default: the file name without its ending).
        units: unit of the numbers, where the file does not say it.
        dt: time step [s], where the file has no time.
        variable: array of a MATLAB file (``field`` of a struct: ``struct.field``).
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        known = ", ".join(READERS)
        raise InputError(
            f"File {path} ends in {path.suffix or 'nothing'!r}, but a ground motion must be one "
            f"of {known}; rename or convert it."
        )
    content = file_bytes(path)
    found: Contents = reader(path, content, variable=variable, dt=dt)
    unit = _unit_of(found, units)
    values = finite_values(found.values, found.where, found.lines)
    step = found.dt if found.dt is not None else dt
    if step is None:
        raise InputError(
            f"{found.where} has no time column and no time step; give the time step (--dt 0.005)."
        )
    if dt is not None and not (math.isfinite(dt) and dt > 0):
        raise argument_error("dt", "be a positive time step [s] (--dt)", repr(dt))
    if found.dt is not None and dt is not None and abs(found.dt / dt - 1) > 1e-3:
        raise InputError(
            f"{found.where} has the time step {found.dt:.6g} s, but --dt says {dt:.6g} s; "
            "leave --dt out."
        )
    with np.errstate(over="ignore"):
        acceleration = values * TO_SI[unit]
    if not np.all(np.isfinite(acceleration)):
        raise InputError(f"{found.where} overflows in m/s^2; check its numbers and its unit.")
    return Record(
        name=name or path.stem,
        acceleration=acceleration,
        dt=float(step),
        source=str(path),
        sha256=hashlib.sha256(content).hexdigest(),
        notices=found.notices,
    )


def _unit_of(found: Contents, asked: str | None) -> str:
    wanted = parse_unit(asked, "Argument `units` (--units)") if asked else None
    if found.unit is None:
        if wanted is None:
            raise InputError(
                f"{found.where} does not say the unit of its acceleration, which could be "
                f"{', '.join(TO_SI)}; give it (--units m/s2)."
            )
        return wanted
    if wanted is not None and wanted != found.unit:
        raise InputError(
            f"{found.where} says that its unit is {found.unit}, but --units says {wanted}; leave "
            "--units out, or correct the file."
        )
    return found.unit
