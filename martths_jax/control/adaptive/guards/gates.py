"""Gates: a fit that cannot be trusted is not used, and the last coefficients stay."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import reduce
from types import MappingProxyType

import jax
import jax.numpy as jnp

from martths_jax.algebra import least_squares as ls
from martths_jax.control.adaptive.arguments import MATRICES, check_positive, check_shape, per_part
from martths_jax.control.adaptive.base import Guard
from martths_jax.control.adaptive.guards.noise import noise_covariance, noise_problems


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class ConditionGate(Guard):
    """Holds where the normal matrix is singular, or worse conditioned than a limit.

    Attributes:
        limit: largest inverse of the smallest relative pivot, a lower bound of the condition number
            of the matrix scaled to a unit diagonal.
    """

    limit: float = field(default=1e14, metadata={"static": True})

    weighs = True

    def problems(self, controller):
        return check_positive("limit", self.limit)

    def trusts(self, state, part, fitted):
        return fitted.tolerance >= 1 / self.limit  # false for NaN


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class ExcitationGate(Guard):
    """Holds unless every pivot of the normal matrix exceeds what noise alone would give.

        d_j > factor N s_j

    with the pivots d_j of the normal matrix, the number N of pairs in it, and the variance s_j of
    regressor j under sensor noise alone.

    Attributes:
        factor: how many times the noise.
        variance: (n,) s_j [mm^2], or as ``ShapedPull.weight``; None takes it from the estimator and
            the benchmark's noise (``noise_covariance``).
    """

    factor: jax.Array | float = 10.0
    variance: jax.Array | None = None
    pairs: jax.Array | float = 0.0

    weighs = True
    shared_axes = MappingProxyType({"factor": 0, "variance": 3, "pairs": 0})

    def prepare(self, benchmark, controller):
        given = noise_covariance(benchmark, controller) if self.variance is None else self.variance
        variance = per_part(given, *controller.sizes)
        return replace(self, variance=variance, pairs=controller.fit.length)

    def problems(self, controller):
        return [
            *check_positive("factor", self.factor, zero=True),
            *check_shape("variance", self.variance, controller.parts, MATRICES),
            *noise_problems("variance", self.variance, controller),
        ]

    def trusts(self, state, part, fitted):
        least = [self.factor * self.pairs * self.variance[part.number, j, j]
                 for j in range(part.unknowns)]  # fmt: skip
        pivots = ls.pivots(fitted.rows)
        return reduce(jnp.logical_and, (d > x for d, x in zip(pivots, least, strict=True)))


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class MotionThreshold(Guard):
    """Holds unless the strokes move: mean |x| of the last while above a threshold.

        m(k) = m(k-1) + (max_i |x_i(k)| - m(k-1)) / memory

    Attributes:
        least: threshold of m [mm].
        memory: samples that the mean remembers; 1 is |x(k)| itself.
    """

    least: jax.Array | float = 0.05
    memory: jax.Array | float = 1.0

    shared_axes = MappingProxyType({"least": 0, "memory": 0})

    def problems(self, controller):
        return [
            *check_positive("least", self.least, zero=True),
            *check_positive("memory", self.memory),
        ]

    def init(self, part, trials):
        return jnp.zeros(trials)

    def look(self, state, part, pair):
        largest = reduce(jnp.maximum, (jnp.abs(pair.phi[i]) for i in part.values))
        return state + (largest - state) / self.memory

    def trusts(self, state, part, fitted):
        return state > self.least
