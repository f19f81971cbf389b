"""Proportional-integral control behind a phase lead: the uniaxial benchmark's sample controller."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import jax
import jax.numpy as jnp

from martths_jax.control.base import Controller, Decision
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.estimators.direct import DirectMeasurement
from martths_jax.control.uncoupled import as_arrays, out_of_range

NUMBERS = ("proportional", "integral", "lead_gain", "lead_zero", "lead_pole")


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class LeadAndPI(Controller):
    """U = (P + I / s) (L X_a - X_m) with L = g (s + z) / (s + p), by the bilinear rule.

    With s = c (z - 1) / (z + 1), c = 2 / dt, a filter (b_1 s + b_0) / (a_1 s + a_0) becomes

        (a_1 c + a_0) y(k) = (b_1 c + b_0) x(k) + (b_0 - b_1 c) x(k-1) - (a_0 - a_1 c) y(k-1).

    Every actuator has the same numbers, each of which may be one value a trial.

    Attributes:
        proportional, integral: P [-] and I [1/s].
        lead_gain, lead_zero, lead_pole: g [-], z and p [1/s].
        actuators: how many there are, by ``prepare``.
        estimator: what is measured, as it is; by ``prepare``.
    """

    proportional: jax.Array | float = 2.0
    integral: jax.Array | float = 95.0
    lead_gain: jax.Array | float = 50.8
    lead_zero: jax.Array | float = 168.6
    lead_pole: jax.Array | float = 8570.0
    actuators: int = field(default=1, metadata={"static": True})
    estimator: Any = None

    name = "pi-lead"
    first_lag_range = 1
    shared_axes = MappingProxyType(dict.fromkeys(NUMBERS, 0))

    def problems(self, benchmark):
        return out_of_range(self, ENTRY)

    def prepare(self, benchmark):
        n = len(benchmark.layout.actuators)
        return replace(as_arrays(self, NUMBERS), actuators=n, estimator=DirectMeasurement())

    def init(self, trials):
        """x_a(k-1), its lead, error and command, at rest before the first sample."""
        return (jnp.zeros((self.actuators, trials)),) * 4

    @property
    def _numbers(self) -> list[jax.Array]:
        return [jnp.asarray(getattr(self, name), float) for name in NUMBERS]

    def step(self, state, seen):
        target, led, error, command = state
        c = 2.0 / seen.dt
        # One value a trial stands beside all actuators.
        P, I, g, z, p = (x[None] if x.ndim else x for x in self._numbers)
        led = (g * ((c + z) * seen.x_a + (z - c) * target) - (p - c) * led) / (c + p)
        late = led - seen.x_m
        command = (P + I / c) * late + (I / c - P) * error + command
        return (seen.x_a, led, late, command), Decision(u=command)


ENTRY = Entry(
    name="pi-lead",
    controller=LeadAndPI,
    label="PI with lead",
    paper="Silva et al. 2020, sample controller of the uniaxial benchmark",
    problem="uniaxial",
    parameters=(
        Parameter("proportional", "P", "proportional gain", 2.0, "1", 0.0, kind="tunable"),
        Parameter("integral", "I", "integral gain", 95.0, "1/s", 0.0, kind="tunable"),
        Parameter("lead_gain", "g", "gain of the lead", 50.8, "1", 0.0, kind="tunable"),
        Parameter("lead_zero", "z", "zero of the lead", 168.6, "1/s", 0.0, kind="tunable"),
        Parameter("lead_pole", "p", "pole of the lead", 8570.0, "1/s", 0.0, above=True,
                  kind="tunable"),
    ),
)  # fmt: skip
