"""A controller of somebody's own: proportional lead by a filtered velocity, one file, one entry."""

from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp

from martths_jax import Controller, Decision, DirectMeasurement, Entry, Parameter, Signal


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Lead(Controller):
    """u = gain (x_a + lead v), v the velocity of the target behind a low-pass.

    Attributes:
        gain: on the target [-].
        lead: time by which it is led [s].
        corner: of the low-pass [1/s].
    """

    gain: float = 1.0
    lead: float = 0.02
    corner: float = 300.0
    estimator: Any = None

    name = "lead"
    signals = (Signal("v", ("actuator",), "mm/s", "velocity of the target"),)

    def prepare(self, benchmark):
        return replace(self, estimator=DirectMeasurement())

    def init(self, trials):
        return jnp.zeros((2, trials)), jnp.zeros((2, trials))

    def step(self, state, seen):
        before, v = state
        v = v + self.corner * seen.dt * ((seen.x_a - before) / seen.dt - v)
        command = self.gain * (seen.x_a + self.lead * v)
        return (seen.x_a, v), Decision(u=command, signals={"v": v})


ENTRY = Entry(
    name="lead",
    controller=Lead,
    label="Lead",
    paper="proportional lead, a test's own",
    parameters=(
        Parameter("gain", "g", "gain", 1.0, "1", 0.0, above=True, kind="tunable"),
        Parameter("lead", "tau", "lead", 0.02, "s", 0.0, 0.08, kind="tunable"),
        Parameter("corner", "c", "corner", 300.0, "1/s", 0.0, above=True),
    ),
)
