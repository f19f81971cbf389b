"""Value and derivatives of strokes by backward differences: regressors of feedforward models."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import comb

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.arguments import complaint
from martths_jax.control.adaptive.base import ACTUATORS, Regressor, weighted
from martths_jax.once import once

#: Highest order of a derivative, and of its accuracy: beyond, the numbers are all cancellation.
MOST = 8


@dataclass(frozen=True)
class BackwardDifferences(Regressor):
    """phi = x, dt x', dt^2 x'', ... by backward differences, scaled so that columns are comparable.

    In powers of the difference D x(k) = x(k) - x(k-1) the j-th derivative is

        dt^j x^(j) = (D + D^2/2 + D^3/3 + ...)^j,  cut after `accuracy` terms.

    Order 3 of accuracy 2 is the C_D of Calayir, Tao & Mercan 2025 (x, D + D^2/2, D^2 + D^3,
    D^3 + 3/2 D^4, five samples); accuracy 1 is D^j, of j + 1 samples.

    Attributes:
        order: highest derivative; n = order + 1 regressors a stroke.
        accuracy: order of the error in dt.
    """

    order: int = 3
    accuracy: int = 2

    @cached_property
    def powers(self) -> tuple[tuple[float, ...], ...]:
        """Row j: weights of D^0, D^1, ... in regressor j."""
        rows = [(1.0,)]
        series = np.array([0.0] + [1 / m for m in range(1, self.accuracy + 1)])
        for j in range(1, self.order + 1):
            power = np.array([1.0])
            for _ in range(j):
                power = np.convolve(power, series)
            rows.append(tuple(power[: j + self.accuracy].tolist()))
        return tuple(rows)

    @cached_property
    def matrix(self) -> np.ndarray:
        taps = max(map(len, self.powers))
        each = np.array([[comb(m, i) * (-1.0) ** i for i in range(taps)] for m in range(taps)])
        weights = [(*row, *(0.0,) * (taps - len(row))) for row in self.powers]
        return np.array(weights) @ each

    def init(self, trials, actuators=ACTUATORS):
        """For each stroke D^0 x, D^1 x, ... of the sample before."""
        return ((jnp.zeros(trials),) * self.reach,) * actuators

    def step(self, before, newest_mm):
        """D^n at a sample is D^(n-1) less D^(n-1) of the sample before."""
        return _stage(self.powers)(before, newest_mm)

    def problems(self, controller):
        return [
            text
            for name, least in (("order", 0), ("accuracy", 1))
            for text in complaint(
                type(getattr(self, name)) is int and least <= getattr(self, name) <= MOST,
                name, f"be a whole number from {least} to {MOST}", getattr(self, name),
            )
        ]  # fmt: skip


@lru_cache(maxsize=64)
def _stage(powers):
    """The function that takes the differences of all strokes, computed once a sample."""
    reach = max(map(len, powers)) - 1

    @once
    def regress(before, newest: jax.Array):
        kept, phi = [], []
        for actuator, earlier in enumerate(before):
            differences = [newest[actuator]]
            for one in earlier:
                differences.append(differences[-1] - one)
            phi.append(tuple(weighted(row, differences) for row in powers))
            kept.append(tuple(differences[:reach]))
        return tuple(kept), tuple(phi)

    return regress


#: Matrix of the paper's differences, from samples k, k-1, ..., k-4.
BACKWARD_DIFFERENCES = BackwardDifferences().matrix
TAPS = BACKWARD_DIFFERENCES.shape[1]
