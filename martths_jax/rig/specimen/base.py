"""The slot for a specimen: it sees the interface motion and answers with a force.

A specimen is a frozen dataclass registered as a pytree; its parameters are arrays, traced, with one
more axis at the end where each trial has its own.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class History:
    """Motion of the interface at the last samples; before the first it is that of the first.

    Attributes:
        now: (d, T) motion q(k) [m, rad].
        before: (2, d, T) motion q(k - 1), q(k - 2).
    """

    now: jax.Array
    before: jax.Array

    def velocity(self, dt: float) -> jax.Array:
        """(q(k) - q(k-1)) / dt, (d, T) [m/s, rad/s]."""
        return (self.now - self.before[0]) / dt

    def acceleration(self, dt: float) -> jax.Array:
        """(q(k) - 2 q(k-1) + q(k-2)) / dt^2, (d, T) [m/s^2, rad/s^2]."""
        return (self.now - 2 * self.before[0] + self.before[1]) / dt**2

    def moved(self) -> jax.Array:
        """What is ``before`` one sample later."""
        return jnp.stack([self.now, self.before[0]])


class Specimen(ABC):
    """Base of all specimens."""

    def init(self, trials: int) -> Any:
        """State at rest, a pytree with the trials on the last axis; none by default."""
        return ()

    @abstractmethod
    def step(self, state: Any, history: History, dt: float) -> tuple[Any, jax.Array]:
        """One sample.

        Args:
            state: after k - 1.
            history: motion of the interface.
            dt: sample period [s].

        Returns:
            state after k, of the same structure; (f, T) force that the specimen offers [N, N m].
        """
