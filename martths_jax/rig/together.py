"""Several couplers side by side: any number of actuators, each at one of several plates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp

from martths_jax.errors import argument_error


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Together:
    """Couplers whose actuators and motions follow each other as rows.

    Attributes:
        parts: couplers, each with ``actuators``, ``to_actuators``, ``to_frame`` and ``jacobian``.
    """

    parts: tuple[Any, ...]

    @property
    def actuators(self) -> int:
        """Number n of all actuators."""
        return sum(part.actuators for part in self.parts)

    def to_actuators(self, motion: jax.Array) -> jax.Array:
        """(n, ...) strokes [mm] of interface motions (n, ...) [m, rad]."""
        return jnp.concatenate([part.to_actuators(x) for part, x in self._split(motion)])

    def to_frame(self, strokes_mm: jax.Array) -> jax.Array:
        """(n, ...) interface motions [m, rad] of strokes (n, ...) [mm]."""
        return jnp.concatenate([part.to_frame(x) for part, x in self._split(strokes_mm)])

    def jacobian(self) -> jax.Array:
        """(n, n) strokes per motion at rest [mm/m, mm/rad]."""
        return jax.scipy.linalg.block_diag(*[part.jacobian() for part in self.parts])

    def _split(self, rows: jax.Array):
        first = 0
        for part in self.parts:
            yield part, rows[first : first + part.actuators]
            first += part.actuators


def together(*parts) -> Together:
    """Couplers side by side, in the order of the problem's interface.

    Raises:
        InputError: for none, or one that is no coupler.
    """
    for part in parts or (None,):
        if not all(hasattr(part, name) for name in ("actuators", "to_actuators", "to_frame")):
            raise argument_error("parts", "be couplers of the rig", repr(part)[:80])
    return Together(parts)
