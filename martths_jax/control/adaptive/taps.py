"""Any linear map of a stroke's newest samples; the samples themselves make an FIR filter."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.arguments import complaint
from martths_jax.control.adaptive.base import ACTUATORS, Regressor, weighted


@dataclass(frozen=True)
class TapMap(Regressor):
    """phi(k) = M (x(k), x(k-1), ..., x(k-taps+1)).

    Attributes:
        rows: M, (n, taps) as tuples of numbers.
    """

    rows: tuple[tuple[float, ...], ...]

    @cached_property
    def matrix(self) -> np.ndarray:
        return np.array(self.rows, dtype=float)

    def problems(self, controller):
        same = len({len(row) for row in self.rows}) == 1
        good = same and np.all(np.isfinite(self.matrix)) and np.all(np.any(self.matrix, axis=1))
        return complaint(good, "rows", "be rows of equally many numbers, none all zero", self.rows)

    def init(self, trials, actuators=ACTUATORS):
        """For each stroke x(k-1), x(k-2), ..."""
        return ((jnp.zeros(trials),) * self.reach,) * actuators

    def step(self, before, newest_mm):
        kept, phi = [], []
        for actuator, earlier in enumerate(before):
            samples = (newest_mm[actuator], *earlier)
            phi.append(tuple(weighted(row, samples) for row in self.rows))
            kept.append(samples[: self.reach])
        return tuple(kept), tuple(phi)


def fir(taps: int) -> TapMap:
    """phi(k) = (x(k), x(k-1), ...): the coefficients are the taps of an FIR filter."""
    return TapMap(tuple(map(tuple, np.eye(taps).tolist())))
