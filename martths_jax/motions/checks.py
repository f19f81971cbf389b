"""Checks that every reader shares: time axis, finite numbers, memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..errors import InputError
from ..resources import available_memory

#: Largest departure of a time stamp from the uniform grid, as a fraction of the step: wide enough
#: for times printed with few digits, far below one missing or doubled sample.
TIME_TOLERANCE = 0.02

#: Part of the memory now free that one motion may take, with the work arrays around it.
MEMORY_SHARE = 0.5
_WORK_COPIES = 6


def check_memory(samples: float, where: str) -> None:
    """Refuse `samples` float64 values (and the copies made of them) that would not fit."""
    need = 8.0 * float(samples) * _WORK_COPIES
    limit = MEMORY_SHARE * available_memory()
    if not need <= limit:
        raise InputError(
            f"{where} needs {samples:.3g} samples, about {need / 2**30:.3g} GiB, but only "
            f"{limit / 2**30:.3g} GiB may be used here; cut the motion, lower the sampling rate, "
            "or check the unit of its time column (s)."
        )


def check_file_size(path: Path, factor: float = 1.0) -> None:
    """Refuse a file whose `factor` samples a byte would not fit in memory."""
    check_memory(path.stat().st_size * factor, f"File {path}")


def finite_values(values: np.ndarray, where: str, lines: list[int] | None = None) -> np.ndarray:
    """`values` as float64 (n,), with at least two entries, all finite, not all zero."""
    values = np.asarray(values, dtype=np.float64).ravel()
    if values.size < 2:
        raise InputError(
            f"{where} holds {values.size} acceleration values, but a motion needs at least 2; "
            "check that this is the right file or array."
        )
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        first = int(bad[0])
        place = f"line {lines[first]}" if lines else f"sample {first + 1}"
        raise InputError(
            f"{where}, {place}: found {values[first]} ({bad.size} of {values.size} values are not "
            "finite), but every value must be a number; repair or cut those samples."
        )
    if not np.any(values):
        raise InputError(f"{where} holds only zeros, but a motion must move; check the file.")
    return values


def uniform_step(time: np.ndarray, where: str, lines: list[int] | None = None) -> float:
    """Time step [s] of a uniform, increasing time axis (n,) [s]."""
    time = np.asarray(time, dtype=np.float64).ravel()
    bad = np.flatnonzero(~np.isfinite(time))
    with np.errstate(all="ignore"):
        steps = np.diff(time)
        dt = (time[-1] - time[0]) / (time.size - 1)
        if not bad.size:
            bad = np.flatnonzero(~(steps > 0)) + 1
        if not bad.size and np.isfinite(dt):
            grid = time[0] + dt * np.arange(time.size)
            if np.max(np.abs(time - grid)) > TIME_TOLERANCE * dt:
                typical = np.median(steps)
                bad = np.flatnonzero(np.abs(steps - typical) > TIME_TOLERANCE * typical) + 1
                bad = bad if bad.size else np.array([time.size - 1])
    if bad.size or not (np.isfinite(dt) and dt > 0):
        first = int(bad[0]) if bad.size else 0
        place = f"line {lines[first]}" if lines else f"sample {first + 1}"
        before = f" after {time[first - 1]:.10g} s" if first else ""
        raise InputError(
            f"{where}, {place}: found the time {time[first]:.10g} s{before}, but the time step "
            "must be the same, and positive, throughout; interpolate the record to a uniform "
            "step first."
        )
    return float(dt)


def file_bytes(path: Path) -> bytes:
    """The file's content, or `InputError` when it cannot be read or is empty."""
    try:
        check_file_size(path)
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"File {path} cannot be read: {error.strerror or error}.") from None
    if not content:
        raise InputError(f"File {path} is empty, but a ground motion was expected.")
    return content
