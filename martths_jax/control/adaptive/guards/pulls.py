"""Pulls of a fit towards given coefficients, added to the normal equations."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import MappingProxyType

import jax

from martths_jax.algebra import least_squares as ls
from martths_jax.control.adaptive.arguments import (
    MATRICES,
    check_positive,
    check_shape,
    per_coefficient,
    per_part,
)
from martths_jax.control.adaptive.base import Guard


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Pull(Guard):
    """Adds lambda |C - anchor|^2 to what the fit minimises.

    Attributes:
        weight: lambda, the same for all regressors [mm^2].
        anchor: (n, 2) coefficients to pull to; None is the controller's start.
    """

    weight: jax.Array | float = 0.0
    anchor: jax.Array | None = None

    weighs = True
    shared_axes = MappingProxyType({"weight": 0, "anchor": 2})

    def prepare(self, benchmark, controller):
        return replace(self, anchor=_anchor(self.anchor, controller))

    def problems(self, controller):
        return [
            *check_shape("weight", self.weight, controller.parts, ("number",)),
            *check_positive("weight", self.weight, zero=True),
            *check_shape("anchor", self.anchor, controller.parts, ("coefficients",)),
        ]

    def weigh(self, part, rows, last):
        return ls.pulled(rows, self.weight, part.columns(self.anchor))


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class ShapedPull(Guard):
    """Adds tr (C - anchor)' L (C - anchor): some regressors are pulled more than others.

    Attributes:
        weight: L [mm^2]: n numbers of a diagonal, a symmetric matrix (n, n), or (parts, n, n).
        anchor: as of ``Pull``.
    """

    weight: jax.Array
    anchor: jax.Array | None = None

    weighs = True
    shared_axes = MappingProxyType({"weight": 3, "anchor": 2})

    def prepare(self, benchmark, controller):
        weight = per_part(self.weight, *controller.sizes)
        return replace(self, weight=weight, anchor=_anchor(self.anchor, controller))

    def problems(self, controller):
        return [
            *check_shape("weight", self.weight, controller.parts, MATRICES),
            *check_shape("anchor", self.anchor, controller.parts, ("coefficients",)),
        ]

    def weigh(self, part, rows, last):
        return ls.weighted(rows, self.weight[part.number], part.columns(self.anchor))


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class PullToLast(Guard):
    """Adds lambda |C - C_last|^2: a fit stays near the one before it.

    Attributes:
        weight: lambda [mm^2].
    """

    weight: jax.Array | float = 0.0

    weighs = True
    shared_axes = MappingProxyType({"weight": 0})

    def problems(self, controller):
        return [
            *check_shape("weight", self.weight, controller.parts, ("number",)),
            *check_positive("weight", self.weight, zero=True),
        ]

    def weigh(self, part, rows, last):
        return ls.pulled(rows, self.weight, last)


def _anchor(given, controller) -> jax.Array:
    anchor = controller.start if given is None else given
    return per_coefficient(anchor, *controller.sizes)
