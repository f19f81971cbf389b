"""What motions there are, and their intensity measures."""

from __future__ import annotations

import os
from dataclasses import dataclass, field

from ..errors import InputError
from .builtin import BUILTIN_NAMES
from .catalogue import record_files
from .load import load_record
from .measures import intensity_measures

#: First natural frequency of the benchmark's reference frame [Hz] (Table 1 of the paper).
FIRST_MODE = 2.2913


@dataclass(frozen=True)
class MotionInfo:
    """One line of ``martths motions``; accelerations unscaled.

    Attributes:
        name: what to give to `load_motion`.
        source: ``built-in``, or the file.
        dt, duration: time step and time of the last sample [s]; None for a file not read.
        measures: of `intensity_measures`: PGA [m/s^2], PGV [m/s], Arias [m/s], CAV [m/s],
            D5-95 [s], Sa at `FIRST_MODE`, 5 % damping [m/s^2].
        problem: why a file cannot be read, or an empty text.
        notices: sentences a user should read.
    """

    name: str
    source: str
    dt: float | None = None
    duration: float | None = None
    measures: dict[str, float] = field(default_factory=dict)
    problem: str = ""
    notices: tuple[str, ...] = ()


def motion_info(
    name: str,
    records: str | os.PathLike | None = None,
    units: str | None = None,
    dt: float | None = None,
    variable: str | int | None = None,
) -> MotionInfo:
    """`MotionInfo` of one motion; `InputError` where it cannot be read."""
    record = load_record(name, records=records, units=units, dt=dt, variable=variable)
    measures = intensity_measures(record.acceleration, record.dt, FIRST_MODE)
    return MotionInfo(
        record.name,
        record.source,
        record.dt,
        record.duration,
        measures,
        notices=record.notices,
    )


def available_motions(
    records: str | os.PathLike | None = None,
    units: str | None = None,
    dt: float | None = None,
    variable: str | int | None = None,
) -> list[MotionInfo]:
    """Built-in motions, then the files of the folder of records (or ``$MARTHS_RECORDS``).

    A file that cannot be read is listed with its problem.
    """
    found = [motion_info(name) for name in BUILTIN_NAMES]
    for name, path in record_files(records).items():
        try:
            info = motion_info(os.fspath(path), units=units, dt=dt, variable=variable)
        except InputError as error:
            info = MotionInfo(name, os.fspath(path), problem=str(error))
        found.append(info)
    return found
