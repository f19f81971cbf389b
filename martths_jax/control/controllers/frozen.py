"""Feedforward with coefficients that stay: an adaptive controller without its identification."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import jax
import jax.numpy as jnp

from martths_jax.control.adaptive.base import Coefficients, Law, Regressor
from martths_jax.control.adaptive.differences import BackwardDifferences
from martths_jax.control.adaptive.law import Linear
from martths_jax.control.base import Controller, Decision


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class FrozenFeedforward(Controller):
    """u(k) = C' phi_a(k), phi_a the regressors of all target strokes.

    Attributes:
        coefficients: (n, actuators) or (n, actuators, T).
        estimator: the filter that runs with it.
        regressor: of the targets; by default backward differences, scaled derivatives dt^j x^(j).
        joint: whether a command depends on all strokes.
        law: the command from coefficients and target.
    """

    coefficients: jax.Array
    estimator: Any = None
    regressor: Regressor = field(default=BackwardDifferences(), metadata={"static": True})
    joint: bool = field(default=True, metadata={"static": True})
    law: Law = field(default_factory=Linear)

    name = "frozen"
    shared_axes = MappingProxyType({"coefficients": 2})

    def init(self, trials):
        return self.regressor.init(trials, self.coefficients.shape[1])

    def step(self, state, seen):
        state, phi = self.regressor.step(state, seen.x_a)
        C = self.coefficients
        rows = tuple(tuple(C[j, i] for i in range(C.shape[1])) for j in range(C.shape[0]))
        return state, Decision(u=jnp.stack(command(self.law, rows, phi, self.joint)))


def command(law: Law, coefficients: Coefficients, phi: Sequence, joint: bool) -> tuple:
    """Commands (T,) of a law.

    Args:
        law: which.
        coefficients: n rows, one number an actuator.
        phi: for each stroke its regressors of the target.
        joint: whether a command depends on all strokes.
    """
    columns = [[row[i] for row in coefficients] for i in range(len(phi))]
    return law.command(columns, [sum(phi, ())] * len(phi) if joint else phi)
