"""Feedforward with coefficients that stay: an adaptive controller without its identification."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import jax
import jax.numpy as jnp

from martths_jax.control.adaptive.differences import TAPS, regress
from martths_jax.control.base import Controller, Decision


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class FrozenFeedforward(Controller):
    """u(k) = C' phi_a(k), phi_a the backward differences of both target strokes (``regress``).

    Attributes:
        coefficients: (8, 2) or (8, 2, T), in scaled derivatives dt^j x^(j).
        estimator: the filter that runs with it.
    """

    coefficients: jax.Array
    estimator: Any = None

    name = "frozen"
    shared_axes = MappingProxyType({"coefficients": 2})

    def init(self, trials):
        return ((jnp.zeros(trials),) * (TAPS - 1),) * 2

    def step(self, state, seen):
        state, phi = regress(state, seen.target_mm)
        C = self.coefficients
        command = [sum(C[j, i] * p for j, p in enumerate(phi)) for i in range(2)]
        return state, Decision(command_mm=jnp.stack(command))
