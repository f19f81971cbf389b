"""`load_motion`: a name or a path in, a `Motion` at the simulation's rate out."""

from __future__ import annotations

import math
import os
from dataclasses import replace

import numpy as np

from ..errors import InputError, argument_error
from .builtin import BUILTIN_NAMES, builtin_record
from .catalogue import find_file, short_name
from .checks import check_memory
from .measures import spectral_acceleration
from .motion import Motion
from .readers import read_record, record_of_array
from .record import Record
from .resampling import resample as resample_to
from .units import parse_acceleration, parse_spectral_target

#: Scale of the records in the benchmark and in the paper's study.
DEFAULT_SCALE = 0.40

#: Quiet time at the end of the benchmark's records [s].
QUIET_TAIL = 5.0


def load_record(
    path_or_name: str | os.PathLike | np.ndarray,
    *,
    records: str | os.PathLike | None = None,
    units: str | None = None,
    dt: float | None = None,
    variable: str | int | None = None,
) -> Record:
    """The unscaled record behind a name, path or array, at its own step (see `load_motion`)."""
    if isinstance(path_or_name, (np.ndarray, list, tuple)):
        return record_of_array(path_or_name, units=units, dt=dt, variable=variable)
    if not isinstance(path_or_name, (str, os.PathLike)):
        raise argument_error(
            "path_or_name",
            "be the name of a motion, the path of its file, or an array",
            repr(path_or_name)[:60],
            f"Built-in names are {', '.join(BUILTIN_NAMES)}.",
        )
    if os.fspath(path_or_name) in BUILTIN_NAMES:
        return builtin_record(os.fspath(path_or_name))
    path = find_file(os.fspath(path_or_name), records)
    return read_record(path, name=short_name(path), units=units, dt=dt, variable=variable)


def load_motion(
    path_or_name: str | os.PathLike | np.ndarray,
    *,
    scale: float = DEFAULT_SCALE,
    fs: float = 1024,
    records: str | os.PathLike | None = None,
    units: str | None = None,
    pga: float | str | None = None,
    sa: str | tuple[float | str, float] | None = None,
    resample: str = "linear",
    tail: float = QUIET_TAIL,
    dt: float | None = None,
    variable: str | int | None = None,
) -> Motion:
    """A ground motion, scaled and sampled for a simulation.

    Args:
        path_or_name: name of a built-in motion (``elcentro-like``), path of a file, or name of one
            in the folder of records; or an array, a vector or 2 x N or N x 2 (time, acceleration).
        scale: factor on the unscaled record; the benchmark's is 0.40.
        fs: sampling rate [Hz]; N = floor(duration fs) + 1 samples at k/fs.
        records: folder of records (default: ``$MARTHS_RECORDS``).
        units: unit of the file's numbers (``g``, ``m/s2``, ``cm/s2``), where it does not say it.
        pga: scale to this peak instead: m/s^2, or text such as ``0.4g``.
        sa: scale to this 5 %-damped pseudo-acceleration instead, as ``0.3g@2.29Hz``,
            ``0.3g@0.44s`` or (0.3 * 9.80665, 2.29).
        resample: ``linear`` (the benchmark's) or ``bandlimited``.
        tail: quiet time at the end [s]; a record that has less of it gets zeros appended, and a
            notice.  The structure comes to rest in it, as with the benchmark's records.
        dt: time step [s] of a file without time.
        variable: column of a table or channel of a file that holds several, by its name or its
            number from 1; array of a MATLAB file (``struct.field``; ``array:3`` for a column).

    Raises:
        InputError: for anything that cannot be found, read, scaled or held in memory.
    """
    if not (math.isfinite(fs) and fs > 0):
        raise argument_error("fs", "be a positive sampling rate [Hz]", repr(fs))
    record = load_record(path_or_name, records=records, units=units, dt=dt, variable=variable)
    factor = scale_factor(record, scale, pga, sa)
    record = with_quiet_tail(record, tail)
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


def scale_factor(
    record: Record,
    scale: float = DEFAULT_SCALE,
    pga: float | str | None = None,
    sa: str | tuple[float | str, float] | None = None,
) -> float:
    """The factor on an unscaled record that `load_motion`'s scaling arguments ask for."""
    given = [("scale", scale != DEFAULT_SCALE), ("pga", pga is not None), ("sa", sa is not None)]
    names = [name for name, is_given in given if is_given]
    if len(names) > 1:
        listed = " and ".join(f"`{name}`" for name in names)
        raise InputError(f"Arguments {listed} exclude each other; give one of them.")
    if pga is not None:
        return parse_acceleration(pga, "pga") / record.pga
    if sa is not None:
        wanted, frequency = parse_spectral_target(sa)
        return wanted / spectral_acceleration(record.acceleration, record.dt, frequency)
    if not (math.isfinite(scale) and scale != 0):
        raise argument_error("scale", "be a finite factor other than zero", repr(scale))
    return float(scale)


def with_quiet_tail(record: Record, tail: float = QUIET_TAIL) -> Record:
    """`record` with at least `tail` seconds at its end in which it stays below 0.1 % of its PGA."""
    if not (math.isfinite(tail) and tail >= 0):
        raise argument_error("tail", "be zero or positive [s]", repr(tail))
    moving = np.flatnonzero(np.abs(record.acceleration) > 1e-3 * record.pga)
    own = (record.acceleration.size - 1 - moving[-1]) * record.dt
    if own >= tail - record.dt:
        return record
    missing = math.ceil(round((tail - own) / record.dt, 6))
    check_memory(record.acceleration.size + missing, f"Motion `{record.name}` with its quiet tail")
    notice = (
        f"Motion `{record.name}` ends {own:.3g} s after its last movement; "
        f"{missing * record.dt:.3g} s of zeros were appended so that the structure comes to rest."
    )
    return replace(
        record,
        acceleration=np.concatenate([record.acceleration, np.zeros(missing)]),
        notices=(*record.notices, notice),
    )
