"""What polynomial extrapolations of a delay that is adapted on line have in common.

Command rho p(tau), p the polynomial through each target's past (``extrapolation``); how tau and rho
move is the method's own.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, field, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.base import ACTUATORS
from martths_jax.control.adaptive.taps import TapMap
from martths_jax.control.base import Controller, Decision, Signal
from martths_jax.control.controllers.frozen import FrozenFeedforward
from martths_jax.control.entry import Parameter
from martths_jax.control.extrapolation import (
    MOST_ORDER,
    MOST_SPACING,
    Extrapolation,
    unusable,
)
from martths_jax.control.uncoupled import FILTER, both, out_of_range, per_actuator, ready

#: Longest delay that is adapted to [s]: about twice that of the nominal plant's slower actuator.
MOST_DELAY = 0.08
SIGNALS = (Signal("tau", ("actuator",), "s", "adapted delay"),)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class AdaptingDelay(Controller):
    """Base: u_i(k) = rho_i(k) p_i(tau_i(k)), with tau_i within 0 ... 0.08 s.

    A subclass says how the numbers move in ``adapt``.

    Attributes:
        tau_1, tau_2: delays to start at [s]; one value a trial too.
        order: degree n of the polynomial.
        points: N points that it goes through or is fitted to; None is n + 1.
        spacing: between them [s], rounded to whole samples.
        q: process noise of the Kalman filter [mm^2].
        estimate: strokes that are learnt from and handed on: that filter's (``kalman``), or
            ``measured``.
        estimator: made by ``prepare``.
        shape: of the polynomial, made by ``prepare``.
    """

    tau_1: jax.Array | float = 40 / 1024
    tau_2: jax.Array | float = 26 / 1024
    order: int = field(default=2, metadata={"static": True})
    points: int | None = field(default=None, metadata={"static": True})
    spacing: float = field(default=26 / 1024, metadata={"static": True})
    q: jax.Array | float = 3e-5
    estimate: str = field(default="kalman", metadata={"static": True})
    estimator: Any = None
    shape: Extrapolation | None = field(default=None, metadata={"static": True})

    adapts = True
    first_lag_range = 1
    signals = SIGNALS

    @property
    @abstractmethod
    def entry(self):
        """Its entry."""

    @abstractmethod
    def learning(self, trials: int) -> Any:
        """What else an actuator's adaptation remembers before the first sample."""

    @abstractmethod
    def adapt(self, tau, learnt, x_a, x_hat, v, dt) -> tuple:
        """An actuator's delay and gain after a sample.

        Args:
            tau: (T,) delay so far [s].
            learnt: from ``learning``, or of the sample before.
            x_a, x_hat: (T,) x_a(k), x_hat(k) [mm].
            v: (T,) slope of the polynomial at k [mm/s].
            dt: sample period [s].

        Returns:
            tau (T,), not yet clamped; gain rho (T,); what it remembers.
        """

    def problems(self, benchmark):
        found = out_of_range(self, self.entry)
        return found or unusable("", self.order, self.points, self.spacing, benchmark.fs)

    def prepare(self, benchmark):
        shape = Extrapolation.of(self.order, self.points, self.spacing, benchmark.fs)
        return replace(ready(self, benchmark), shape=shape)

    def frozen(self, benchmark, coefficients):
        """The same extrapolation with delays (2,) or (2, T) [s] that stay, and a gain of one."""
        made = self.prepare(benchmark)
        shape, ahead = made.shape, jnp.asarray(coefficients, float) * benchmark.fs
        weights = jnp.stack([shape.weights(one) for one in ahead], axis=1)
        rows = np.zeros((shape.points, shape.reach + 1))
        rows[np.arange(shape.points), np.arange(shape.points) * shape.spacing] = 1.0
        taps = TapMap(tuple(map(tuple, rows.tolist())))
        return FrozenFeedforward(weights, made.estimator, taps, joint=False)

    def init(self, trials):
        return tuple(
            {
                "past": self.shape.init(trials),
                "tau": jnp.broadcast_to(tau, (trials,)),
                "learnt": self.learning(trials),
            }
            for tau in per_actuator(self, "tau")
        )

    def step(self, state, seen):
        kept, u, taus, gains = [], [], [], []
        for i in range(ACTUATORS):
            own, x_a = state[i], seen.x_a[i]
            past, c = self.shape.step(own["past"], x_a)
            v = self.shape.slope(c) / seen.dt
            tau, rho, learnt = self.adapt(own["tau"], own["learnt"], x_a, seen.x_hat[i], v, seen.dt)
            tau = jnp.clip(tau, 0.0, MOST_DELAY)
            kept.append({"past": past, "tau": tau, "learnt": learnt})
            u.append(rho * self.shape.value(c, tau / seen.dt))
            taus.append(tau)
            gains.append(rho)
        signals = {"tau": jnp.stack(taus), "rho": jnp.stack(gains)}
        return tuple(kept), Decision(
            u=jnp.stack(u), signals={s.name: signals[s.name] for s in self.signals}
        )


def parameters(order: int, points: int | None, spacing: float, tau: tuple[float, float]) -> tuple:
    """Parameters of the polynomial, with a method's own defaults; see ``AdaptingDelay``."""
    starts = tuple(
        Parameter(name, name, f"delay of actuator {i} at the start", value, "s", 0.0, MOST_DELAY,
                  kind="tunable")
        for i, name, value in zip((1, 2), both("tau"), tau, strict=True)
    )  # fmt: skip
    return (
        *starts,
        Parameter("order", "n", "order", order, "1", 1, MOST_ORDER, whole=True, kind="static"),
        Parameter("points", "N", "points", points, "1", 2, 64, whole=True, kind="static"),
        Parameter("spacing", "h", "spacing", spacing, "s", 1e-4, MOST_SPACING, kind="static"),
        *FILTER,
    )
