"""An index of a user's own: a kind that the package does not have, and two rows of a table."""

from dataclasses import dataclass

import jax.numpy as jnp

from martths_jax.indices import Index, Kind, Pair
from martths_jax.indices.base import joined


@dataclass(frozen=True, kw_only=True)
class MeanError(Kind):
    """Mean magnitude of the error, in the unit of the pair."""

    def init(self, trials):
        return self.blank(trials, 2)

    def add(self, state, signals, reference, k, valid):
        now = jnp.where(valid, 1.0, 0.0)
        return tuple(
            (total + now * jnp.abs(value - target), samples + now)
            for (total, samples), (value, target) in zip(
                state, self.compared(signals, reference), strict=True
            )
        )

    def finish(self, state):
        return joined(state, ("total", "samples"))

    def result(self, state):
        value = state["total"] / state["samples"]
        return {"": (value, value != value)}


MEAN = Index("mean_1", "mm", MeanError(), Pair.of("x_m", "x_a", 0), "mean error of stroke 1")
BOTH = (MEAN, Index("mean_2", "mm", MeanError(), Pair.of("x_m", "x_a", 1), "mean error, stroke 2"))
