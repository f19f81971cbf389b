"""Root-mean-square error in percent of the target: 100 sqrt(sum e^2 / sum t^2)."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp

from martths_jax.indices.base import TINY, Kind, joined, library


@dataclass(frozen=True, kw_only=True)
class Rms(Kind):
    """J2, J5, J7, J8 of the benchmark [%]."""

    def init(self, trials):
        return self.blank(trials, 2)

    def add(self, state, signals, reference, k, valid):
        found = []
        for (errors, targets), (value, target) in zip(
            state, self.compared(signals, reference), strict=True
        ):
            error = jnp.where(valid, value - target, 0.0)
            target = jnp.where(valid, target, 0.0)
            found.append((errors + error * error, targets + target * target))
        return tuple(found)

    def finish(self, state):
        return joined(state, ("error_square", "target_square"))

    def result(self, state):
        errors, targets = state["error_square"], state["target_square"]
        xp = library(errors)
        missing = (targets < TINY) | ~xp.isfinite(errors)
        return {"": (100 * xp.sqrt(errors / targets), missing)}
