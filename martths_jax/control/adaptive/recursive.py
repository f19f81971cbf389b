"""Coefficients that every sample corrects: recursive least squares, and a Kalman filter on them.

    g = P phi / (mu R + phi' P phi),  C += g (u - phi' C)',  P = (P - g phi' P) / mu + Q

with R = 1 and Q = 0 for recursive least squares with forgetting factor mu, and mu = 1 for the
Kalman filter of coefficients on a random walk.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType

import jax
import jax.numpy as jnp

from martths_jax.control.adaptive.arguments import (
    MATRICES,
    check_positive,
    check_shape,
    complaint,
    known,
    per_part,
)
from martths_jax.control.adaptive.base import Fit, Fitted, choose


class _Corrected(Fit):
    """What both have in common: state is P, the upper triangle row by row."""

    def prepare(self, benchmark, controller):
        sizes = controller.sizes
        made = {
            n: per_part(getattr(self, n), *sizes) for n in ("prior", "walk") if hasattr(self, n)
        }
        return replace(self, **made)

    def init(self, part, trials):
        return upper(self.prior[part.number], trials)

    def due(self, k, reach):
        return k >= self.wait + reach

    def keep(self, use, new, old):
        """Where the coefficients are held, their covariance is too."""
        return choose(use, new, old)

    def correct(self, P, pair, last, mu, r):
        """C and (P - g phi' P) after a pair."""
        n = len(pair.phi)
        at = lambda i, j: P[min(i, j)][abs(i - j)]  # noqa: E731
        Pphi = [sum(at(i, j) * pair.phi[j] for j in range(n)) for i in range(n)]
        inverse = 1.0 / (mu * r + sum(p * f for p, f in zip(Pphi, pair.phi, strict=True)))
        gain = [p * inverse for p in Pphi]
        errors = [
            u - sum(row[s] * f for row, f in zip(last, pair.phi, strict=True))
            for s, u in enumerate(pair.values)
        ]
        coefficients = tuple(
            tuple(c + g * e for c, e in zip(row, errors, strict=True))
            for row, g in zip(last, gain, strict=True)
        )
        left = tuple(tuple(P[i][j - i] - gain[i] * Pphi[j] for j in range(i, n)) for i in range(n))
        return coefficients, left


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Recursive(_Corrected):
    """Recursive least squares with forgetting.

    Attributes:
        prior: P_0 [1/mm^2]: a number, n numbers, (n, n), or (parts, n, n).
        forgetting: factor mu a sample, at most 1.
        most: largest trace of P, which grows without end where nothing moves and mu < 1; None is
            no limit [1/mm^2].
        wait: samples before the first correction, beyond those that make a whole row.
    """

    prior: jax.Array | float = 1.0
    forgetting: jax.Array | float = 1.0
    most: jax.Array | float | None = None
    wait: int = field(default=0, metadata={"static": True})

    shared_axes = MappingProxyType({"prior": 3, "forgetting": 0, "most": 0})

    def problems(self, controller):
        mu = known(self.forgetting)
        return [
            *complaint(mu is None or ((mu > 0) & (mu <= 1)), "forgetting",
                       "be above 0 and at most 1", self.forgetting),
            *check_shape("prior", self.prior, controller.parts, MATRICES),
            *check_positive("most", self.most),
            *check_positive("wait", self.wait, zero=True),
        ]  # fmt: skip

    def step(self, state, part, pair, last, weigh):
        coefficients, left = self.correct(state, pair, last, self.forgetting, 1.0)
        P = jax.tree.map(lambda x: x / self.forgetting, left)
        if self.most is not None:
            share = jnp.minimum(1.0, self.most / sum(row[0] for row in P))
            P = jax.tree.map(lambda x: x * share, P)
        return P, Fitted(coefficients)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class RandomWalk(_Corrected):
    """Kalman filter of coefficients that walk at random.

    Attributes:
        prior: P_0, covariance of the start coefficients: a number, n numbers, (n, n), or
            (parts, n, n).
        walk: Q, covariance that they gain a sample, likewise.
        r: variance R of what the model does not say of a command [mm^2].
        wait: samples before the first correction, beyond those that make a whole row.
    """

    prior: jax.Array | float = 1.0
    walk: jax.Array | float = 0.0
    r: jax.Array | float = 1.0
    wait: int = field(default=0, metadata={"static": True})

    shared_axes = MappingProxyType({"prior": 3, "walk": 3, "r": 0})

    def problems(self, controller):
        return [
            *check_shape("prior", self.prior, controller.parts, MATRICES),
            *check_shape("walk", self.walk, controller.parts, MATRICES),
            *check_positive("r", self.r),
            *check_positive("wait", self.wait, zero=True),
        ]

    def step(self, state, part, pair, last, weigh):
        coefficients, left = self.correct(state, pair, last, 1.0, self.r)
        gained = upper(self.walk[part.number])
        return jax.tree.map(jnp.add, left, gained), Fitted(coefficients)


def upper(matrix: jax.Array, trials: int | None = None):
    """Upper triangle of a symmetric matrix (n, n) or (n, n, T), row by row.

    Each number is (T,) for a number of trials, and as it comes without.
    """
    n = matrix.shape[0]
    number = lambda x: x if trials is None else jnp.broadcast_to(x, (trials,))  # noqa: E731
    return tuple(tuple(number(matrix[i, j]) for j in range(i, n)) for i in range(n))
