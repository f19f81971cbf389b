"""No compensation: the command is the target."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import jax

from martths_jax.control.base import Controller, Decision
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.estimators import DirectMeasurement, design_kalman


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Passthrough(Controller):
    """u(k) = x_a(k).

    Attributes:
        q: process noise of the Kalman filter [mm^2]; None estimates nothing and takes the
            measurement as it is.
    """

    q: float | None = field(default=None, metadata={"static": True})
    estimator: Any = None

    name = "passthrough"
    first_lag_range = 1

    def prepare(self, benchmark):
        if self.q is None:
            return replace(self, estimator=DirectMeasurement())
        return replace(
            self, estimator=design_kalman(benchmark.plant_model, self.q, benchmark.r_mm2)
        )

    def init(self, trials):
        return ()

    def step(self, state, seen):
        return state, Decision(u=seen.x_a)


ENTRY = Entry(
    name="passthrough",
    controller=Passthrough,
    paper="no compensation: what every other is compared with",
    parameters=(
        Parameter("q", "q", "process noise", None, "mm^2", 0.0, above=True, kind="static"),
    ),
)
