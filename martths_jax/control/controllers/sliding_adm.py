"""Sliding mode with an adaptive discrete model (after Shangguan et al.).

An inner loop takes the coupling out, a discrete model in front of it the delay that is left:

    r(k) = theta' (x_a, s D x_a, s^2 D^2 x_a)(k+1)                     ``discrete_model``
    X = (z', e),   e = r - x,   X' = A* X + B* u',   A* = [[A, 0], [-C, 0]],   B* = [B; 0]
    s = Lambda X,  u' = -Lambda A* X - eta s                           so that s' = -eta s

with the nominal plant z' = A z + B u, x = C z.  The surface is Lambda = (P B*)^-1 P with P = B*' S,
S from the Riccati equation of the cost |e|^2 weighted by Q_e, plus |u'|^2; then its zeros are
stable, and s is in millimetres.  The law has no switching term; integrated it is state feedback,

    u(k) = -K z_hat(k) + K_e sum dt (r - x_hat),   [K, -K_e] = Lambda A* + eta Lambda.

x_a(k+1), when r(k) is first felt, is 2 x_a(k) - x_a(k-1).  The discrete model learns from the
measured strokes, which r has caused through the inner loop.  It begins at the lead that makes up
for that loop's lag behind a ramp of unit slope, L = K_e^-1 (I - K A^-1 B) H(0)^-1.

What is chosen here: with the published reaching law (1e-9) s hardly returns, which leaves two
integrators at the edge of stability; a rate eta takes its place.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.algebra.riccati import care, solve
from martths_jax.control.adaptive.arguments import complaint
from martths_jax.control.base import Controller, Decision, Signal
from martths_jax.control.controllers import discrete_model as model
from martths_jax.control.controllers.ats import COLUMN_S
from martths_jax.control.controllers.feedforward import SIGNALS, AdaptiveFeedforward
from martths_jax.control.controllers.frozen import FrozenFeedforward
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.estimators import design_kalman
from martths_jax.control.uncoupled import as_arrays, numbers, out_of_range
from martths_jax.structure.modal import contract, to_dense

#: Weights of the errors [1/s^2] and reaching rate [1/s]: the nominal loop has poles from 5 Hz on.
#: Half and twice the rate, a tenth and ten times the weights track alike on 64 drawn plants.
WEIGHTS, REACH = (1e7, 1e7), 60.0
#: Process noise of the Kalman filter [mm^2]: ten times as much and more of the noise is followed,
#: a tenth and the filter sees less of a plant that is not the nominal one.
Q = 3e-4


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class SlidingADM(Controller):
    """The equations above.

    Attributes:
        e: (2,) Q_e, weights of the errors against u'^2 [1/s^2].
        reach: eta [1/s].
        spread, walk, error, threshold, cutoff: see ``discrete_model``.
        q: process noise of the Kalman filter that feedback and force are made from [mm^2].
        K: (2, 2, m) gain on z_hat, slot by slot; K_e: (2, 2) on the integral [1/s]; made by
            ``prepare``, as what follows.
        outer: the discrete model, or one that stays.
        estimator: the filter.
    """

    e: Any = WEIGHTS
    reach: jax.Array | float = REACH
    spread: jax.Array | float = model.SPREAD
    walk: jax.Array | float = model.WALK
    error: jax.Array | float = model.ERROR_MM
    threshold: jax.Array | float = model.THRESHOLD_MM
    cutoff: float = field(default=model.CUTOFF_HZ, metadata={"static": True})
    q: jax.Array | float = Q
    K: jax.Array | None = None
    K_e: jax.Array | None = None
    outer: AdaptiveFeedforward | FrozenFeedforward | None = None
    estimator: Any = None

    actuators_needed = 2
    name = "sliding-adm"
    adapts = True
    signals = (*SIGNALS, Signal("r", ("actuator",), "mm", "reference of the inner loop"))
    shared_axes = numbers("reach", *model.FIELDS[:-1]) | {"e": 1, "K": 3, "K_e": 2}

    @property
    def entry(self) -> Entry:
        """Its entry."""
        return ENTRY

    @property
    def rate(self):
        """At which s returns where the law is linear [1/s]."""
        return self.reach

    def ramp_lag(self, benchmark) -> jax.Array:
        """L (2, 2) [s]: e = L r' once the nominal plant follows a ramp.

        z' = w with C w = r', so w = -A^-1 B H(0)^-1 r' and u' = H(0)^-1 r' = K_e e - K w.
        """
        K, K_e = law(benchmark, self.e, self.reach)
        w, rest = ramp(benchmark)
        return solve(K_e, rest + K @ w)

    def problems(self, benchmark):
        found = out_of_range(self, self.entry) or model.check_low_pass(self, benchmark)
        if found or np.ndim(self.rate):
            return found or complaint(False, "reach", "be one number", f"{self.reach!r:.80}")
        size = largest_pole(benchmark, *law(benchmark, self.e, self.rate))
        wanted = f"give an inner loop that is stable at {benchmark.fs:g} Hz"
        return complaint(size < 1, "e, reach", wanted, f"one with a pole of magnitude {size:.4g}")

    def prepare(self, benchmark):
        K, K_e = law(benchmark, self.e, self.reach)
        made = replace(
            as_arrays(self, ("e", "reach")),
            K=jnp.swapaxes(K.reshape(2, -1, 2), 1, 2),
            K_e=K_e,
            estimator=design_kalman(benchmark.plant_model, self.q, benchmark.r_mm2),
        )
        lead = jnp.diag(self.ramp_lag(benchmark)) / COLUMN_S
        start = jnp.stack([jnp.ones(2), lead, jnp.zeros(2)])
        return replace(made, outer=model.discrete_model(made, benchmark, start))

    def frozen(self, benchmark, coefficients):
        """The same loop behind a model with (3, 2) or (3, 2, T) theta that stay."""
        made, theta = self.prepare(benchmark), jnp.asarray(coefficients, dtype=float)
        outer = replace(made.outer.frozen(benchmark, theta), estimator=None)
        return Settled(theta, made, outer, made.estimator)

    def init(self, trials):
        return {
            "before": jnp.zeros((2, trials)),  # x_a(k-1)
            "outer": self.outer.init(trials),
            "inner": self.init_inner(trials),
        }

    def step(self, state, seen):
        ahead = replace(seen, x_a=2.0 * seen.x_a - state["before"])
        outer, led = self.outer.step(state["outer"], ahead)
        inner, u = self.follow(state["inner"], led.u, seen)
        state = {"before": seen.x_a, "outer": outer, "inner": inner}
        return state, Decision(u=u, signals=led.signals | {"r": led.u})

    def init_inner(self, trials):
        """State of the inner loop: the integral of r - x_hat (2, T)."""
        return jnp.zeros((2, trials))

    def follow(self, state, r, seen):
        """The inner loop after a sample with its reference r (2, T): its state, and u (2, T)."""
        error = state + seen.dt * (r - seen.x_hat)
        return error, contract(self.K_e, error) - contract(self.K, seen.state, axes=2)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Settled(Controller):
    """A sliding controller whose discrete model does not adapt any more.

    Attributes:
        coefficients: (3, 2) or (3, 2, T) theta.
        moving: the controller, prepared.
        outer: the discrete model, whose coefficients are those.
        estimator: the filter.
    """

    coefficients: jax.Array
    moving: SlidingADM
    outer: FrozenFeedforward
    estimator: Any

    name = "settled"
    shared_axes = MappingProxyType({"coefficients": 2})

    @property
    def whole(self) -> SlidingADM:
        """The controller with the model that stays."""
        return replace(self.moving, outer=replace(self.outer, coefficients=self.coefficients))

    def init(self, trials):
        return self.whole.init(trials)

    def step(self, state, seen):
        return self.whole.step(state, seen)


def augmented(benchmark) -> tuple[np.ndarray, np.ndarray]:
    """A* (10, 10) and B* (10, 2) of the nominal plant."""
    A, B, C = benchmark.plant_continuous
    n = len(A)
    return np.block([[A, np.zeros((n, 2))], [-C, np.zeros((2, 2))]]), np.r_[B, np.zeros((2, 2))]


def surface(benchmark, e) -> jax.Array:
    """Lambda (2, 10), with Lambda B* = I."""
    A, B = augmented(benchmark)
    Q = jnp.diag(jnp.concatenate([jnp.zeros(len(A) - 2), jnp.asarray(e, dtype=float)]))
    P = B.T @ care(jnp.asarray(A), jnp.asarray(B), Q, jnp.eye(2))
    return solve(P @ B, P)


def law(benchmark, e, reach) -> tuple[jax.Array, jax.Array]:
    """K (2, 8), states as in ``to_dense``, and K_e (2, 2) of the integrated law."""
    A, _ = augmented(benchmark)
    L = surface(benchmark, e)
    G = L @ A + reach * L
    return G[:, :-2], -G[:, -2:]


def ramp(benchmark) -> tuple[np.ndarray, np.ndarray]:
    """z' (8, 2) and u' (2, 2) of the nominal plant where its strokes rise at unit rates."""
    A, B, C = benchmark.plant_continuous
    rest = np.linalg.solve(A, B)
    inverse = np.linalg.inv(-C @ rest)
    return -rest @ inverse, inverse


def largest_pole(benchmark, K, K_e) -> float:
    """Magnitude of the sampled inner loop's largest pole on the nominal plant."""
    A, B, C, _ = to_dense(benchmark.plant_model)
    K, K_e = np.asarray(K), np.asarray(K_e)
    # The integral takes in e(k) before u(k) is made of it.
    summed = -benchmark.dt * C
    whole = np.block([[A + B @ (K_e @ summed - K), B @ K_e], [summed, np.eye(2)]])
    return float(np.abs(np.linalg.eigvals(whole)).max())


ENTRY = Entry(
    name="sliding-adm",
    controller=SlidingADM,
    label="Sliding mode + ADM",
    paper="after Shangguan et al. 2024, Front. Built Environ. 10:1393710",
    parameters=(
        Parameter("e", "Q_e", "weights of the errors", WEIGHTS, "1/s^2", 0.0, above=True, size=2),
        Parameter("reach", "eta", "reaching rate", REACH, "1/s", 0.0, above=True),
        *model.PARAMETERS,
        Parameter("q", "q", "process noise", Q, "mm^2", 0.0, above=True),
    ),
)  # fmt: skip
