"""Two-stage compensation: a polynomial takes the main delay, an adaptive discrete model the rest.

    x_p(k) = p(tau + dt)                                first stage, p through the targets' past
    u(k)   = theta_0 x_p(k) + theta_1 s D x_p(k) + theta_2 s^2 D^2 x_p(k)           second stage

The sample beyond tau is that until the command is felt.  The second stage is a ``discrete_model``,
which must see the same chain: it learns from y(k) = p(tau), p through the past of the measured
strokes, and begins at theta = (1, 0, 0).  Taught by x_m itself it would make up for the delay once
more.

After the two stages of Wang and others, of which abstracts were at hand: the architecture is
theirs, equations and numbers are choices of this project.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import jax
import jax.numpy as jnp

from martths_jax.control.adaptive.base import ACTUATORS
from martths_jax.control.adaptive.taps import fir
from martths_jax.control.base import Controller
from martths_jax.control.controllers import discrete_model as model
from martths_jax.control.controllers.feedforward import SIGNALS, AdaptiveFeedforward
from martths_jax.control.controllers.frozen import FrozenFeedforward
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.extrapolation import MOST_SPACING, Extrapolation, unusable
from martths_jax.control.uncoupled import (
    FILTER,
    both,
    numbers,
    out_of_range,
    per_actuator,
    ready,
)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class TwoStage(Controller):
    """The equations above, actuator by actuator.

    The numbers of actuator 1 and 2 end in _1 and _2.

    Attributes:
        tau_1, tau_2: delay that the first stage makes up for [s]; one value a trial too.
        order: degree of its polynomial.  Of the second degree it raises the gain of faster motion
            so much that three numbers do not make up for it.
        spacing: of the points that it goes through [s], rounded to whole samples.
        spread, walk, error, threshold, cutoff: see ``discrete_model``.
        q: process noise of the Kalman filter that the force is made from [mm^2].
        estimate: strokes that are handed on: that filter's (``kalman``), or ``measured``.
        estimator, shape, second: made by ``prepare``: filter, polynomial and second stage.
    """

    tau_1: jax.Array | float = 40 / 1024
    tau_2: jax.Array | float = 26 / 1024
    order: int = field(default=1, metadata={"static": True})
    spacing: float = field(default=26 / 1024, metadata={"static": True})
    spread: jax.Array | float = model.SPREAD
    walk: jax.Array | float = model.WALK
    error: jax.Array | float = model.ERROR_MM
    threshold: jax.Array | float = model.THRESHOLD_MM
    cutoff: float = field(default=model.CUTOFF_HZ, metadata={"static": True})
    q: jax.Array | float = 3e-5
    estimate: str = field(default="kalman", metadata={"static": True})
    estimator: Any = None
    shape: Extrapolation | None = field(default=None, metadata={"static": True})
    second: AdaptiveFeedforward | None = None

    actuators_needed = 2
    name = "two-stage"
    adapts = True
    first_lag_range = 1
    signals = SIGNALS
    shared_axes = numbers(*both("tau"), *model.FIELDS[:-1])

    def problems(self, benchmark):
        found = out_of_range(self, ENTRY) or model.check_low_pass(self, benchmark)
        return found or unusable("", self.order, None, self.spacing, benchmark.fs)

    def prepare(self, benchmark):
        shape = Extrapolation.of(self.order, None, self.spacing, benchmark.fs)
        made = replace(ready(self, benchmark), shape=shape)
        start = jnp.zeros((model.ORDER + 1, ACTUATORS)).at[0].set(1.0)
        return replace(made, second=model.discrete_model(made, benchmark, start))

    def frozen(self, benchmark, coefficients):
        """Both stages as one FIR filter, with (3, 2) or (3, 2, T) theta that stay."""
        made, theta = self.prepare(benchmark), jnp.asarray(coefficients, dtype=float)
        shape, rows = made.shape, made.second.regressor.matrix
        stage = jnp.tensordot(jnp.asarray(rows.T), theta, axes=1)
        taps = jnp.zeros((shape.reach + len(stage), *stage.shape[1:]))
        for i, tau in enumerate(per_actuator(made, "tau")):
            for j, weight in enumerate(shape.weights(tau * benchmark.fs + 1)):
                at = slice(j * shape.spacing, j * shape.spacing + len(stage))
                taps = taps.at[at, i].add(weight * stage[:, i])
        return FrozenFeedforward(taps, made.estimator, fir(len(taps)), joint=False)

    def init(self, trials):
        past = tuple(self.shape.init(trials) for _ in range(ACTUATORS))
        return {"target": past, "measured": past, "second": self.second.init(trials)}

    def step(self, state, seen):
        target, x_p = self.first(state["target"], seen.x_a, seen.dt, 1)
        measured, y = self.first(state["measured"], seen.x_m, seen.dt)
        second, decision = self.second.step(state["second"], replace(seen, x_a=x_p, x_m=y))
        return {"target": target, "measured": measured, "second": second}, decision

    def first(self, past, x, dt, more=0):
        """Memory of the first stage, and strokes (2, T) ahead by tau and some more samples."""
        kept, ahead = [], []
        for own, one, tau in zip(past, x, per_actuator(self, "tau"), strict=True):
            own, c = self.shape.step(own, one)
            kept.append(own)
            ahead.append(self.shape.value(c, tau / dt + more))
        return tuple(kept), jnp.stack(ahead)


ENTRY = Entry(
    name="two-stage",
    controller=TwoStage,
    label="Two-stage",
    paper="after Wang et al., polynomial extrapolation and an adaptive discrete model",
    parameters=(
        Parameter("tau_1", "tau_1", "delay of actuator 1", 40 / 1024, "s", 0.0, 0.08,
                  kind="tunable"),
        Parameter("tau_2", "tau_2", "delay of actuator 2", 26 / 1024, "s", 0.0, 0.08,
                  kind="tunable"),
        Parameter("order", "n", "degree of the polynomial", 1, "1", 1, 3, whole=True,
                  kind="static"),
        Parameter("spacing", "h", "spacing of its points", 26 / 1024, "s", 1e-4, MOST_SPACING,
                  kind="static"),
        *model.PARAMETERS,
        *FILTER,
    ),
)  # fmt: skip
