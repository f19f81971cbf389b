"""From a record's own time step to the sampling rate of the simulation."""

from __future__ import annotations

import math

import numpy as np

from ..errors import argument_error
from .checks import check_memory

METHODS = ("linear", "bandlimited")


def sample_count(duration: float, fs: float) -> float:
    """Number of samples k/fs, k = 0, 1, ..., in [0, duration] (whole, but maybe not an int)."""
    # The margin keeps the last sample when duration*fs is whole but for rounding.
    samples = duration * fs * (1 + 1e-12) + 1e-9
    return math.floor(samples) + 1 if math.isfinite(samples) else math.inf


def resample(
    acceleration: np.ndarray, dt: float, fs: float, method: str = "linear", where: str = "Motion"
) -> np.ndarray:
    """(N,) samples at k/fs, k = 0 ... N - 1, N = floor(duration fs) + 1.

    Args:
        acceleration: (n,) record at the step `dt` [s].
        dt: time step [s].
        fs: wanted sampling rate [Hz].
        method: ``linear`` interpolates between samples, as the benchmark does.
        where: what an error calls the motion.

    Raises:
        InputError: unknown method, or more samples than memory allows.
    """
    if method not in METHODS:
        raise argument_error("resample", f"be one of {', '.join(METHODS)}", repr(method))
    count = sample_count((acceleration.size - 1) * dt, fs)
    check_memory(count, where)
    time = np.arange(int(count)) / fs
    return np.interp(time, np.arange(acceleration.size) * dt, acceleration)
