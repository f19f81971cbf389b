"""No filter: the estimate is the measurement."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp

from martths_jax.control.base import Estimator


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class DirectMeasurement(Estimator):
    """x_hat(k) = x_m(k): for ideal sensors, and for controllers that take the noise as it comes."""

    def init(self, trials):
        """Nothing to remember, (2, 0, T)."""
        return jnp.zeros((2, 0, trials))

    def correct(self, predicted, x_m):
        """The measurement itself."""
        return predicted, x_m

    def predict(self, state, u):
        """Nothing to predict."""
        return state
