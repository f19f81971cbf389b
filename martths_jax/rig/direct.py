"""No coupler: each actuator moves one degree of freedom."""

from __future__ import annotations

from dataclasses import dataclass, field

import jax
import jax.numpy as jnp

MM = 1e3  # mm per m


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Direct:
    """x_i = 1000 q_i [mm, m].

    Attributes:
        actuators: number n of them.
    """

    actuators: int = field(metadata={"static": True})

    def to_actuators(self, interface: jax.Array) -> jax.Array:
        """(n, T) strokes [mm] of an interface motion (n, T) [m]."""
        return interface * MM

    def to_frame(self, strokes_mm: jax.Array) -> jax.Array:
        """(n, T) interface motion [m] of strokes (n, T) [mm]."""
        return strokes_mm * (1 / MM)

    def jacobian(self) -> jax.Array:
        """(n, n) strokes per motion [mm/m]."""
        return MM * jnp.eye(self.actuators)
