"""A controller from outside the package, with one number that may be negative."""

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp

from martths_jax import Controller, Decision
from martths_jax.control.estimators import DirectMeasurement


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Lead(Controller):
    """u = x_a + lead * dx_a/dt"""

    lead: float = 0.005
    estimator: object = None
    name = "lead"

    def prepare(self, benchmark):
        return replace(self, estimator=DirectMeasurement())

    def init(self, trials):
        return jnp.zeros((2, trials))

    def step(self, state, seen):
        rate = (seen.x_a - state) / seen.dt
        return seen.x_a, Decision(u=seen.x_a + self.lead * rate)
