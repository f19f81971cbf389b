"""From a record's own time step to the sampling rate of the simulation."""

from __future__ import annotations

import math

import numpy as np

from ..errors import InputError, argument_error
from .checks import check_memory

METHODS = ("linear", "bandlimited")

#: Windowed sinc: zero crossings a side, and Kaiser's beta (stop band 80 dB down).
_HALF_WIDTH, _BETA = 32, 7.86
_BLOCK = 1 << 20


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
        method: ``linear`` interpolates between samples, as the benchmark does; ``bandlimited``
            keeps the record's spectrum up to the lower of the two Nyquist frequencies, and adds
            nothing above it, by interpolation with a windowed sinc.
        where: what an error calls the motion.

    Raises:
        InputError: unknown method, or more samples than memory allows.
    """
    if method not in METHODS:
        raise argument_error("resample", f"be one of {', '.join(METHODS)}", repr(method))
    count = sample_count((acceleration.size - 1) * dt, fs)
    if count < 2:
        raise InputError(
            f"{where} lasts {(acceleration.size - 1) * dt:.3g} s, less than two samples at {fs:g} "
            "Hz; check its time step [s]."
        )
    check_memory(count, where)
    time = np.arange(int(count)) / fs
    if method == "bandlimited":
        return _windowed_sinc(acceleration, dt, time, cutoff=min(1.0, fs * dt))
    return np.interp(time, np.arange(acceleration.size) * dt, acceleration)


def _windowed_sinc(values: np.ndarray, dt: float, time: np.ndarray, cutoff: float) -> np.ndarray:
    """Values at `time` [s] of the band-limited function through samples at step `dt` [s].

    Sinc of bandwidth `cutoff` times the record's Nyquist frequency, under a Kaiser window of
    `_HALF_WIDTH` zero crossings a side (Oppenheim & Schafer, Discrete-Time Signal Processing, 7.6).
    Outside the record the motion is taken to be zero.
    """
    reach = math.ceil(_HALF_WIDTH / cutoff)
    check_memory(float(values.size + 2 * reach), "Band-limited resampling")
    padded = np.concatenate([np.zeros(reach), values, np.zeros(reach + 1)])
    out = np.empty(time.size)
    block = max(1, _BLOCK // (2 * reach))
    taps = np.arange(1 - reach, reach + 1)
    for first in range(0, time.size, block):
        place = time[first : first + block] / dt
        base = np.floor(place).astype(int)
        away = place[:, None] - base[:, None] - taps
        inside = np.clip(1 - (away / reach) ** 2, 0.0, None)
        kernel = cutoff * np.sinc(cutoff * away) * np.i0(_BETA * np.sqrt(inside)) / np.i0(_BETA)
        out[first : first + block] = np.sum(padded[base[:, None] + taps + reach] * kernel, axis=1)
    return out
