"""Command laws."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

import jax
import jax.numpy as jnp

from martths_jax.control.adaptive.arguments import check_positive, check_shape
from martths_jax.control.adaptive.base import Law


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Linear(Law):
    """u = C' phi(x_a), cut at a limit if there is one.

    Attributes:
        limit_mm: largest command [mm]; None lets all pass.
    """

    limit_mm: jax.Array | float | None = None

    shared_axes = MappingProxyType({"limit_mm": 0})

    def problems(self, controller):
        return [
            *check_positive("limit_mm", self.limit_mm),
            *check_shape("limit_mm", self.limit_mm, controller.parts, ("number",)),
        ]

    def command(self, coefficients, phi):
        commands = tuple(
            sum(c * p for c, p in zip(column, own, strict=True))
            for column, own in zip(coefficients, phi, strict=True)
        )
        if self.limit_mm is None:
            return commands
        return tuple(jnp.clip(u, -self.limit_mm, self.limit_mm) for u in commands)
