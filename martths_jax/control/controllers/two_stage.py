"""Two-stage compensation: a polynomial takes the main delay, an adaptive discrete model the rest.

    x_p(k) = p(tau)                                     first stage, p through the targets' past
    u(k)   = theta_0 x_p(k) + theta_1 s D x_p(k) + theta_2 s^2 D^2 x_p(k)           second stage

D is the backward difference over dt, s = 0.02 s: three taps written as columns that are equally
large for a motion near 2 Hz, as neighbouring samples are almost collinear.  theta walks at random
and is tracked by a Kalman filter that must see the same chain.  What the first stage makes of the
measured strokes, y = P[x_m], takes the place of x_p:

    F[u](k-1) = theta' (F[y], s D F[y], s^2 D^2 F[y])(k) + error,   theta = (1, 0, 0) at first

Taught by x_m itself, theta would make up for the delay once more.  F is a low-pass on both sides.

After the two stages of Wang and others, of which abstracts were at hand: the architecture is
theirs, equations and numbers are choices of this project.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.base import ACTUATORS
from martths_jax.control.adaptive.differences import BackwardDifferences
from martths_jax.control.adaptive.guards import MotionThreshold
from martths_jax.control.adaptive.lowpass import butterworth
from martths_jax.control.adaptive.recursive import RandomWalk
from martths_jax.control.adaptive.taps import TapMap, fir
from martths_jax.control.base import Controller
from martths_jax.control.controllers.ats import COLUMN_S
from martths_jax.control.controllers.feedforward import SIGNALS, AdaptiveFeedforward
from martths_jax.control.controllers.frozen import FrozenFeedforward
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.extrapolation import MOST_SPACING, Extrapolation, unusable
from martths_jax.control.uncoupled import FILTER, both, numbers, out_of_range, per_actuator, ready
from martths_jax.errors import argument_error

#: Highest difference of the second stage.
ORDER = 2
#: Poles of the low-pass.
POLES = 6


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class TwoStage(Controller):
    """The equations above, actuator by actuator.

    The numbers of actuator 1 and 2 end in _1 and _2.

    Attributes:
        tau_1, tau_2: delay that the first stage makes up for [s]; one value a trial too.
        order: degree of its polynomial.
        spacing: of the points that it goes through [s], rounded to whole samples.
        spread: standard deviation of each theta at first [-].
        walk: by which each walks in a second, its root [1/sqrt(s)].
        error: standard deviation of what the second stage does not say of a command [mm].
        threshold: no correction while |F[y](k)| is smaller [mm].
        cutoff: of the low-pass, Butterworth of order 6 [Hz].
        q: process noise of the Kalman filter that the force is made from [mm^2].
        estimate: strokes that are handed on: that filter's (``kalman``), or ``measured``.
        estimator, shape, second: made by ``prepare``: filter, polynomial and second stage.
    """

    tau_1: jax.Array | float = 40 / 1024
    tau_2: jax.Array | float = 26 / 1024
    order: int = field(default=1, metadata={"static": True})
    spacing: float = field(default=26 / 1024, metadata={"static": True})
    spread: jax.Array | float = 0.3
    walk: jax.Array | float = 1e-3
    error: jax.Array | float = 0.03
    threshold: jax.Array | float = 0.02
    cutoff: float = field(default=20.0, metadata={"static": True})
    q: jax.Array | float = 3e-5
    estimate: str = field(default="kalman", metadata={"static": True})
    estimator: Any = None
    shape: Extrapolation | None = field(default=None, metadata={"static": True})
    second: AdaptiveFeedforward | None = None

    name = "two-stage"
    adapts = True
    first_lag_range = 1
    signals = SIGNALS
    shared_axes = numbers(*both("tau"), "spread", "walk", "error", "threshold")

    def problems(self, benchmark):
        found = out_of_range(self, ENTRY)
        if not found and not self.cutoff < benchmark.fs / 2:
            wanted = f"lie below {benchmark.fs / 2:g} Hz, half the sampling rate"
            found = [str(argument_error("cutoff", wanted, f"{self.cutoff:g}"))]
        return found or unusable("", self.order, None, self.spacing, benchmark.fs)

    def prepare(self, benchmark):
        fs = benchmark.fs
        made = replace(
            ready(self, benchmark), shape=Extrapolation.of(self.order, None, self.spacing, fs)
        )
        each = lambda x: _diagonals(jnp.asarray(x, dtype=float))  # noqa: E731
        second = AdaptiveFeedforward(
            regressor=columns(fs),
            fit=RandomWalk(each(made.spread**2), each(made.walk**2 / fs), made.error**2),
            guards=(MotionThreshold(made.threshold),),
            start=jnp.zeros((ORDER + 1, ACTUATORS)).at[0].set(1.0),
            joint=False,
            learns_from="measurement",
            low_pass=butterworth(POLES, self.cutoff, fs),
            estimator=made.estimator,
        )
        return replace(made, second=second.prepare(benchmark))

    def frozen(self, benchmark, coefficients):
        """Both stages as one FIR filter, with (3, 2) or (3, 2, T) theta that stay."""
        made, theta = self.prepare(benchmark), jnp.asarray(coefficients, dtype=float)
        shape, rows = made.shape, made.second.regressor.matrix
        stage = jnp.tensordot(jnp.asarray(rows.T), theta, axes=1)
        taps = jnp.zeros((shape.reach + len(stage), *stage.shape[1:]))
        for i, tau in enumerate(per_actuator(made, "tau")):
            for j, weight in enumerate(shape.weights(tau * benchmark.fs)):
                at = slice(j * shape.spacing, j * shape.spacing + len(stage))
                taps = taps.at[at, i].add(weight * stage[:, i])
        return FrozenFeedforward(taps, made.estimator, fir(len(taps)), joint=False)

    def delay_line(self, trials):
        return self.second.delay_line(trials)

    def init(self, trials):
        past = tuple(self.shape.init(trials) for _ in range(ACTUATORS))
        return {"target": past, "measured": past, "second": self.second.init(trials)}

    def step(self, state, seen):
        target, x_p = self.first(state["target"], seen.x_a, seen.dt)
        measured, y = self.first(state["measured"], seen.x_m, seen.dt)
        second, decision = self.second.step(state["second"], replace(seen, x_a=x_p, x_m=y))
        return {"target": target, "measured": measured, "second": second}, decision

    def first(self, past, x, dt):
        """Memory of the first stage, and what it makes of strokes (2, T)."""
        kept, ahead = [], []
        for own, one, tau in zip(past, x, per_actuator(self, "tau"), strict=True):
            own, c = self.shape.step(own, one)
            kept.append(own)
            ahead.append(self.shape.value(c, tau / dt))
        return tuple(kept), jnp.stack(ahead)


def columns(fs: float) -> TapMap:
    """x, s D x, s^2 D^2 x of a stroke, s = 0.02 s."""
    scale = (COLUMN_S * fs) ** np.arange(ORDER + 1.0)
    rows = BackwardDifferences(order=ORDER, accuracy=1).matrix * scale[:, None]
    return TapMap(tuple(map(tuple, rows.tolist())))


def _diagonals(value: jax.Array) -> jax.Array:
    """(2, n, n) or (2, n, n, T): for each actuator the same number on a diagonal."""
    n = ORDER + 1
    one = jnp.eye(n).reshape(n, n, *(1,) * value.ndim) * value
    return jnp.broadcast_to(one, (ACTUATORS, *one.shape))


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
        Parameter("spread", "", "spread of theta at first", 0.3, "1", 0.0, above=True,
                  kind="tunable"),
        Parameter("walk", "", "random walk of theta", 1e-3, "1/sqrt(s)", 0.0, above=True,
                  kind="tunable"),
        Parameter("error", "", "error of the second stage", 0.03, "mm", 0.0, above=True,
                  kind="tunable"),
        Parameter("threshold", "x_min", "stroke below which it holds", 0.02, "mm", 0.0),
        Parameter("cutoff", "f_c", "cutoff of the low-pass", 20.0, "Hz", 0.0, above=True,
                  kind="static"),
        *FILTER,
    ),
)  # fmt: skip
