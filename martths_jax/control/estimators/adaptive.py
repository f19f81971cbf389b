"""Kalman filter on the nominal plant whose measurement noise is adapted from its innovations.

    nu(k) = x_m(k) - C x_pred(k),   s(k) = s(k-1) + (|nu(k)|^2 / 2 - s(k-1)) / M
    r(k)  solves  s(k) = tr(C P(r) C') / 2 + r,   L(k) = P C' (C P C' + r I)^-1

the covariance matching of Mehra 1972 (IEEE Transactions on Automatic Control 17(5)) with a memory
that fades: an innovation's variance is that of what was predicted and that of the noise, and their
mean square over the last M samples tells the second.  Process noise stays what it was given as;
from innovations alone the two can hardly be told apart, and a plant far from the nominal one reads
as noise.

What is chosen here: P(r) is the steady state of the Riccati equation, as r hardly changes within
the filter's own memory, so that L is a function of s alone.  It is tabulated over r / r_0 from 0.01
to 100 on the host, and the loop interpolates it over log s.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.algebra.riccati import dare, solve
from martths_jax.control.base import Estimator
from martths_jax.errors import argument_error, as_numbers
from martths_jax.runtime import check_precision
from martths_jax.structure.modal import (
    ModalSystem,
    advance,
    output,
    spread,
    to_dense,
    trailing,
)

#: r / r_0 of the table; the middle one is 1.
FACTORS = np.geomspace(0.01, 100.0, 33)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class AdaptiveKalmanFilter(Estimator):
    """The filter above, from ``design_adaptive``.

    Attributes:
        model: nominal plant, m slots.
        gains: (F, 2, m, 2) or (F, 2, m, 2, T) L of each r of the table, slot by slot.
        knots: (F,) or (F, T) log s of each.
        logs: (F,) log r of each.
        memory: M [samples], a number or (T,).
    """

    model: ModalSystem
    gains: jax.Array
    knots: jax.Array
    logs: jax.Array
    memory: jax.Array

    shared_axes = MappingProxyType({"gains": 4, "knots": 1, "logs": 1, "memory": 0})

    def init(self, trials):
        """Prediction for k = 0, the plant at rest, and s as r_0 has it."""
        at_rest = jnp.zeros(self.model.a.shape[:2] + (trials,))
        s = jnp.broadcast_to(jnp.exp(self.knots[len(FACTORS) // 2]), (trials,))
        return {"z": at_rest, "s": s}

    def correct(self, predicted, x_m):
        z, s = predicted["z"], predicted["s"]
        innovation = x_m - output(self.model, z)
        square = 0.5 * (innovation[0] ** 2 + innovation[1] ** 2)
        s = s + (square - s) / self.memory
        shape = self.gains.shape[1:4] + (-1,)
        shares = self.shares(s)
        gain = sum(
            g.reshape(shape) * trailing(w, 4) for g, w in zip(self.gains, shares, strict=True)
        )
        z = z + spread(gain, innovation)
        return {"z": z, "s": s}, output(self.model, z)

    def predict(self, state, u):
        return {"z": advance(self.model, state["z"], u), "s": state["s"]}

    def noise(self, state) -> jax.Array:
        """r(k) (T,) [mm^2] of what ``correct`` gave."""
        shares = self.shares(state["s"])
        return jnp.exp(sum(one * w for one, w in zip(self.logs, shares, strict=True)))

    def shares(self, s) -> list[jax.Array]:
        """What each entry of the table counts (T,), by straight lines between neighbours."""
        at = jnp.clip(jnp.log(s), self.knots[0], self.knots[-1])
        steps = self.knots[1:] - self.knots[:-1]
        # How far each interval is passed, from 0 to 1.
        passed = [
            jnp.clip((at - a) / d, 0.0, 1.0) for a, d in zip(self.knots[:-1], steps, strict=True)
        ]
        one = jnp.ones_like(at)
        return [a - b for a, b in zip([one, *passed], [*passed, 0.0 * one], strict=True)]


def design_adaptive(model: ModalSystem, q, r: float, memory) -> AdaptiveKalmanFilter:
    """The filter of a plant.

    Args:
        model: nominal plant (T = 1).
        q: process noise through the plant's input [mm^2], one for all trials or one a trial (T,);
            may be traced.
        r: r_0, measurement noise that it starts from [mm^2].
        memory: M [samples], likewise; above 1.

    Raises:
        InputError: if one of them is out of its range.
    """
    check_precision()
    for name, value, least, wanted in (
        ("q", q, 0.0, "be positive and finite (mm^2)"),
        ("r", r, 0.0, "be positive and finite (mm^2)"),
        ("memory", memory, 1.0, "be above 1 (samples)"),
    ):
        if isinstance(value, jax.core.Tracer):
            continue
        number = as_numbers(value)
        if not np.all(np.isfinite(number) & (number > least)):
            raise argument_error(name, wanted, f"{value!r:.80}")
    A, B, C, _ = to_dense(model)
    noises = r * jnp.asarray(FACTORS)

    def entry(q, noise):
        """L (2, m, 2) and log s of one r."""
        both = jnp.eye(2)
        P = dare(jnp.asarray(A.T), jnp.asarray(C.T), q * jnp.asarray(B @ B.T), noise * both)
        S = C @ P @ C.T + noise * both
        L = solve(S, C @ P).T
        return jnp.transpose(L.reshape(-1, 2, 2), (1, 0, 2)), jnp.log(0.5 * jnp.trace(S))

    table = lambda one: jax.vmap(entry, (None, 0))(one, noises)  # noqa: E731
    q = jnp.asarray(q, dtype=float)
    gains, knots = jax.vmap(table, out_axes=-1)(q) if q.ndim else table(q)
    return AdaptiveKalmanFilter(
        model, gains, knots, jnp.log(noises), jnp.asarray(memory, dtype=float)
    )
