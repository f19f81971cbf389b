"""`load_motion`: a name or a path in, a `Motion` at the simulation's rate out."""

from __future__ import annotations

import math
import os

import numpy as np

from ..errors import InputError, argument_error
from .catalogue import find_file, short_name
from .motion import Motion
from .readers import read_record
from .record import Record
from .resampling import resample as resample_to
from .units import parse_acceleration

#: Scale of the records in the benchmark and in the paper's study.
DEFAULT_SCALE = 0.40


def load_record(
    path_or_name: str | os.PathLike,
    *,
    records: str | os.PathLike | None = None,
    units: str | None = None,
    dt: float | None = None,
    variable: str | None = None,
) -> Record:
    """The unscaled record behind a name or path, at its own time step (see `load_motion`)."""
    path = find_file(os.fspath(path_or_name), records)
    return read_record(path, name=short_name(path), units=units, dt=dt, variable=variable)


def load_motion(
    path_or_name: str | os.PathLike,
    *,
    scale: float = DEFAULT_SCALE,
    fs: float = 1024,
    records: str | os.PathLike | None = None,
    units: str | None = None,
    pga: float | str | None = None,
    resample: str = "linear",
    dt: float | None = None,
    variable: str | None = None,
) -> Motion:
    """A ground motion, scaled and sampled for a simulation.

    Args:
        path_or_name: path of a file, or the name of one in the folder of records.
        scale: factor on the unscaled record; the benchmark's is 0.40.
        fs: sampling rate [Hz]; N = floor(duration fs) + 1 samples at k/fs.
        records: folder of records (default: ``$MARTHS_RECORDS``).
        units: unit of the file's numbers (``g``, ``m/s2``, ``cm/s2``), where it does not say it.
        pga: scale to this peak instead: m/s^2, or text such as ``0.4g``.
        resample: ``linear`` (the benchmark's).
        dt: time step [s] of a file without time.
        variable: array of a MATLAB file that holds several.

    Raises:
        InputError: for anything that cannot be found, read, scaled or held in memory.
    """
    if not (math.isfinite(fs) and fs > 0):
        raise argument_error("fs", "be a positive sampling rate [Hz]", repr(fs))
    record = load_record(path_or_name, records=records, units=units, dt=dt, variable=variable)
    factor = scale_factor(record, scale, pga)
    where = f"Motion `{record.name}` ({record.source})"
    with np.errstate(over="ignore"):
        samples = factor * resample_to(record.acceleration, record.dt, fs, resample, where)
    if not np.all(np.isfinite(samples)):
        raise InputError(f"{where} overflows when scaled by {factor:.6g}; check units and scale.")
    return Motion(
        name=record.name,
        acceleration=samples,
        fs=float(fs),
        scale=float(factor),
        source=record.source,
        sha256=record.sha256,
        notices=record.notices,
    )


def scale_factor(record: Record, scale: float, pga: float | str | None = None) -> float:
    """The factor on an unscaled record that `load_motion`'s scaling arguments ask for."""
    if pga is not None and scale != DEFAULT_SCALE:
        raise InputError("Arguments `scale` and `pga` exclude each other; give one of them.")
    if pga is not None:
        return parse_acceleration(pga, "pga") / record.pga
    if not (math.isfinite(scale) and scale != 0):
        raise argument_error("scale", "be a finite factor other than zero", repr(scale))
    return float(scale)
