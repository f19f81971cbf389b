"""The two filters of ``ParameterFilter``: the model by its derivatives, or at sigma points."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import MappingProxyType

import jax
import jax.numpy as jnp

from martths_jax.control.adaptive import joint
from martths_jax.control.adaptive.arguments import check_positive
from martths_jax.control.controllers.parameter_filter import ParameterFilter
from martths_jax.control.entry import Parameter
from martths_jax.structure.modal import trailing

#: The unscented ones' further parameter.
ALPHA = Parameter("alpha", "alpha", "reach of the sigma points", 1.0, "1", 0.0, 1.0, above=True)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Extended(ParameterFilter):
    """The extended filter: the model by its derivatives."""

    def predicted(self, xi, P, p, u):
        moving = *xi[: joint.MOVING], u, u[::-1]
        g = self.model.slopes(p, *moving)
        by_theta = self.p(g[joint.MOVING :])
        return joint.extended(self.model.rise(p, *moving), (*g[: joint.MOVING], *by_theta), xi, P)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Unscented(ParameterFilter):
    """The unscented filter: the model at sigma points.

    Attributes:
        alpha: how far these lie, alpha sqrt(6) standard deviations (beta = 2, kappa = 0) [-].
    """

    alpha: jax.Array | float = 1.0

    shared_axes = MappingProxyType({**ParameterFilter.shared_axes, "alpha": 0})

    def problems(self, benchmark):
        return [*super().problems(benchmark), *check_positive("alpha", self.alpha)]

    def prepare(self, benchmark):
        return replace(super().prepare(benchmark), alpha=jnp.asarray(self.alpha, dtype=float))

    def predicted(self, xi, P, p, u):
        def rise(at):
            moving, theta = at[: joint.MOVING], at[joint.MOVING :]
            return self.model.rise(self.p(theta), *moving, u, u[::-1])

        return joint.unscented(rise, xi, P, trailing(self.alpha, 2))
