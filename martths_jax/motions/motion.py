"""One ground motion, sampled at the rate the simulation runs at."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Motion:
    """A horizontal ground acceleration ready to be simulated.

    Attributes:
        name: short name, as tables and figures show it.
        acceleration: (N,) ground acceleration at ``fs``, already scaled [m/s^2].
        fs: sampling rate [Hz].
        scale: factor that was applied to the unscaled record [-].
        source: where it comes from: a path, or ``built-in``.
        sha256: checksum of the file (or of the samples of a built-in motion) before scaling.
        notices: sentences a user should read (a quiet tail appended, a unit assumed ...).
    """

    name: str
    acceleration: np.ndarray
    fs: float
    scale: float = 1.0
    source: str = ""
    sha256: str = ""
    notices: tuple[str, ...] = field(default=())

    @property
    def time(self) -> np.ndarray:
        """(N,) sample times, from zero [s]."""
        return np.arange(self.acceleration.size) / self.fs

    @property
    def duration(self) -> float:
        """Time of the last sample [s]."""
        return (self.acceleration.size - 1) / self.fs
