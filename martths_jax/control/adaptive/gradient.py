"""Coefficients that follow the gradient of their error."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType

import jax

from martths_jax.control.adaptive.arguments import (
    SHAPES,
    check_positive,
    check_shape,
    per_coefficient,
)
from martths_jax.control.adaptive.base import Fit, Fitted


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class NormalisedGradient(Fit):
    """C += dt Gamma phi e' / (1 + phi' phi), e = u - C' phi.

    Attributes:
        gain: Gamma [1/s], one number for all coefficients, n numbers, or (n, 2).
        wait: samples before the first correction, beyond those that make a whole row.
    """

    gain: jax.Array | float = 10.0
    wait: int = field(default=0, metadata={"static": True})

    shared_axes = MappingProxyType({"gain": 2})

    def prepare(self, benchmark, controller):
        sizes = controller.sizes
        return replace(self, gain=per_coefficient(self.gain, *sizes))

    def problems(self, controller):
        return [
            *check_positive("gain", self.gain, zero=True),
            *check_shape("gain", self.gain, controller.parts, SHAPES),
            *check_positive("wait", self.wait, zero=True),
        ]

    def init(self, part, trials):
        return ()

    def due(self, k, reach):
        return k >= self.wait + reach

    def step(self, state, part, pair, last, weigh):
        gain = part.columns(self.gain)
        share = pair.dt / (1.0 + sum(f * f for f in pair.phi))
        errors = [
            share * (u - sum(row[s] * f for row, f in zip(last, pair.phi, strict=True)))
            for s, u in enumerate(pair.values)
        ]
        coefficients = tuple(
            tuple(c + gain[j][s] * f * errors[s] for s, c in enumerate(row))
            for j, (row, f) in enumerate(zip(last, pair.phi, strict=True))
        )
        return state, Fitted(coefficients)
