"""Limits of the coefficients themselves, and of how fast they change."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import reduce
from types import MappingProxyType

import jax
import jax.numpy as jnp

from martths_jax.control.adaptive.arguments import (
    SHAPES,
    check_shape,
    complaint,
    known,
    per_coefficient,
)
from martths_jax.control.adaptive.base import Guard


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Bounds(Guard):
    """Every coefficient stays between two bounds.

    Attributes:
        low, high: one number for all coefficients, n numbers, or (n, 2); infinite is no bound.
        refuse: hold the last coefficients instead of cutting those that lie outside.
    """

    low: jax.Array | float = -jnp.inf
    high: jax.Array | float = jnp.inf
    refuse: bool = field(default=False, metadata={"static": True})

    shared_axes = MappingProxyType({"low": 2, "high": 2})

    def prepare(self, benchmark, controller):
        sizes = controller.sizes
        return replace(
            self, low=per_coefficient(self.low, *sizes), high=per_coefficient(self.high, *sizes)
        )

    def problems(self, controller):
        low, high = known(self.low), known(self.high)
        found = [
            *check_shape("low", self.low, controller.parts, SHAPES),
            *check_shape("high", self.high, controller.parts, SHAPES),
        ]
        if found or low is None or high is None:
            return found
        ordered = per_coefficient(low, *controller.sizes) <= (
            per_coefficient(high, *controller.sizes)
        )
        return complaint(ordered, "low", "be at most `high`", f"{low} and {high}")

    def trusts(self, state, part, fitted):
        if not self.refuse:
            return None
        low, high = part.columns(self.low), part.columns(self.high)
        inside = [
            (low[j][s] <= c) & (c <= high[j][s])
            for j, row in enumerate(fitted.coefficients)
            for s, c in enumerate(row)
        ]
        return reduce(jnp.logical_and, inside)

    def cut(self, part, proposed, last):
        low, high = part.columns(self.low), part.columns(self.high)
        return tuple(
            tuple(jnp.clip(c, low[j][s], high[j][s]) for s, c in enumerate(row))
            for j, row in enumerate(proposed)
        )


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class RateLimit(Guard):
    """No coefficient changes by more than so much from one fit to the next.

    Attributes:
        most: largest change, one number for all coefficients, n numbers, or (n, 2).
    """

    most: jax.Array | float = jnp.inf

    shared_axes = MappingProxyType({"most": 2})

    def prepare(self, benchmark, controller):
        sizes = controller.sizes
        return replace(self, most=per_coefficient(self.most, *sizes))

    def problems(self, controller):
        most = known(self.most)
        good = most is None or most > 0
        return [
            *complaint(good, "most", "be positive", f"{most}"),
            *check_shape("most", self.most, controller.parts, SHAPES),
        ]

    def cut(self, part, proposed, last):
        most = part.columns(self.most)
        return tuple(
            tuple(
                c + jnp.clip(new - c, -most[j][s], most[j][s])
                for s, (new, c) in enumerate(zip(*rows, strict=True))
            )
            for j, rows in enumerate(zip(proposed, last, strict=True))
        )
