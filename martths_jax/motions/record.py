"""A ground motion as its file holds it: own time step, unscaled, in m/s^2."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Record:
    """An unscaled accelerogram on its own uniform time grid, which starts at zero.

    Attributes:
        name: short name.
        acceleration: (n,) ground acceleration [m/s^2].
        dt: time step [s].
        source: the file's path, or ``built-in``.
        sha256: checksum of the file's bytes (of the samples for a built-in motion).
        notices: sentences a user should read.
    """

    name: str
    acceleration: np.ndarray
    dt: float
    source: str = ""
    sha256: str = ""
    notices: tuple[str, ...] = ()

    @property
    def duration(self) -> float:
        """Time of the last sample [s]."""
        return (self.acceleration.size - 1) * self.dt

    @property
    def pga(self) -> float:
        """Peak ground acceleration [m/s^2]."""
        return float(np.max(np.abs(self.acceleration)))
