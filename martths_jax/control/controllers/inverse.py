"""Inverse compensation of a first-order actuator (Chen & Ricles 2009)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp

from martths_jax.control.base import Controller, Decision
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.uncoupled import (
    FILTER,
    both,
    gain_and_time,
    numbers,
    out_of_range,
    per_actuator,
    ready,
)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Inverse(Controller):
    """u_i(k) = g_i [alpha_i x_a,i(k) - (alpha_i - 1) x_a,i(k-1)],  alpha_i = 1 + T_i / dt.

    The exact inverse of an actuator that goes the alpha-th part of its way a sample,

        x(k) = x(k-1) + (u(k) / g - x(k-1)) / alpha,

    which answers a ramp T late.  The paper gives alpha; T is the same at any sampling rate.

    The numbers of actuator 1 and 2 end in _1 and _2; each of them may be one value a trial.

    Attributes:
        gain_1, gain_2: g [-]; the paper has 1.
        delay_1, delay_2: T [s].
        q: process noise of the Kalman filter [mm^2].
        estimate: strokes that are handed on: that filter's (``kalman``), or ``measured``.
        estimator: made by ``prepare``.
    """

    gain_1: jax.Array | float = 1.0
    gain_2: jax.Array | float = 1.0
    delay_1: jax.Array | float = 48 / 1024
    delay_2: jax.Array | float = 26 / 1024
    q: jax.Array | float = 3e-5
    estimate: str = field(default="kalman", metadata={"static": True})
    estimator: Any = None

    name = "inverse"
    actuators_needed = 2
    first_lag_range = 1
    shared_axes = numbers(*both("gain"), *both("delay"))

    def problems(self, benchmark):
        return out_of_range(self, ENTRY)

    def prepare(self, benchmark):
        return ready(self, benchmark)

    def init(self, trials):
        """x_a(k-1), at rest before the first sample."""
        return jnp.zeros((2, trials))

    def step(self, state, seen):
        u = []
        for gain, delay, new, old in zip(
            per_actuator(self, "gain"), per_actuator(self, "delay"), seen.x_a, state, strict=True
        ):
            # alpha new - (alpha - 1) old, without the difference of two large numbers.
            u.append(gain * (new + delay / seen.dt * (new - old)))
        return seen.x_a, Decision(u=jnp.stack(u))


def _of_actuator(i: int, alpha: int) -> tuple[Parameter, ...]:
    """Parameters of actuator i: the alpha of 1024 Hz that tracks best with a gain of one."""
    return gain_and_time(i, 1.0, "delay", "T", "delay", (alpha - 1) / 1024)


ENTRY = Entry(
    name="inverse",
    controller=Inverse,
    label="Inverse",
    paper="Chen & Ricles 2009, inverse compensation of a first-order discrete actuator",
    parameters=(*_of_actuator(1, 49), *_of_actuator(2, 27), *FILTER),
)
