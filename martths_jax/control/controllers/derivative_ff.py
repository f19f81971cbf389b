"""Derivative feedforward: the target ahead of time by its own derivatives (after Jung et al.)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp

from martths_jax.control.adaptive.base import ACTUATORS
from martths_jax.control.adaptive.differences import BackwardDifferences
from martths_jax.control.base import Controller
from martths_jax.control.controllers.frozen import FrozenFeedforward
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

#: Highest derivative that may be fed forward: with the third the loop of the nominal plant runs
#: away (spectral radius 2.5 at leads of 44.9 and 21.5 ms).
MOST_ORDER = 2
#: Order of the differences' error in dt.
ACCURACY = 2


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class DerivativeFeedforward(Controller):
    """u_i = g_i (x_a,i + tau_i v_i [+ tau_i^2 / 2 a_i]), the Taylor series of x_a(t + tau).

    v and a are second-order backward differences of the targets, (1.5, -2, 0.5) / dt and
    (2, -5, 4, -1) / dt^2.  Jung, Shing, Stauffer & Thoen 2007 is where reviews place the method;
    this is its general form, not checked against their equations.

    The numbers of actuator 1 and 2 end in _1 and _2; each of them may be one value a trial.

    Attributes:
        gain_1, gain_2: g [-].
        tau_1, tau_2: lead tau [s].
        order: highest derivative, 1 or 2.
        q: process noise of the Kalman filter [mm^2].
        estimate: strokes that are handed on: that filter's (``kalman``), or ``measured``.
        estimator: made by ``prepare``.
    """

    gain_1: jax.Array | float = 1.0
    gain_2: jax.Array | float = 1.0
    tau_1: jax.Array | float = 0.0469
    tau_2: jax.Array | float = 0.0254
    order: int = field(default=1, metadata={"static": True})
    q: jax.Array | float = 3e-5
    estimate: str = field(default="kalman", metadata={"static": True})
    estimator: Any = None

    name = "derivative-ff"
    actuators_needed = 2
    first_lag_range = 1
    shared_axes = numbers(*both("gain"), *both("tau"))

    def problems(self, benchmark):
        return out_of_range(self, ENTRY)

    def prepare(self, benchmark):
        return ready(self, benchmark)

    def law(self, dt) -> FrozenFeedforward:
        """The feedforward with its coefficients, g (tau / dt)^j / j! of dt^j x^(j)."""
        each = []
        for gain, tau in zip(per_actuator(self, "gain"), per_actuator(self, "tau"), strict=True):
            column = [gain]
            for j in range(1, self.order + 1):
                column.append(column[-1] * (tau / dt) / j)
            each += column
        # Number by number, since some may be one a trial, (T,), and others not.
        flat = jnp.stack(jnp.broadcast_arrays(*each))
        shape = ACTUATORS, self.order + 1, *flat.shape[1:]
        coefficients = flat.reshape(shape).swapaxes(0, 1)
        regressor = BackwardDifferences(self.order, ACCURACY)
        return FrozenFeedforward(coefficients, self.estimator, regressor, joint=False)

    def init(self, trials):
        return self.law(1.0).init(trials)

    def step(self, state, seen):
        return self.law(seen.dt).step(state, seen)


def _of_actuator(i: int, tau: float) -> tuple[Parameter, ...]:
    """Parameters of actuator i: the lead that tracks best at order 1 and a gain of one."""
    return gain_and_time(i, 1.0, "tau", "tau", "lead", tau)


ENTRY = Entry(
    name="derivative-ff",
    controller=DerivativeFeedforward,
    label="Derivative feedforward",
    paper="after Jung, Shing, Stauffer & Thoen 2007, feedforward of the target's derivatives",
    parameters=(
        *_of_actuator(1, 0.0469),
        *_of_actuator(2, 0.0254),
        Parameter("order", "n", "highest derivative", 1, "1", 1, MOST_ORDER, whole=True,
                  kind="static"),
        *FILTER,
    ),
)  # fmt: skip
