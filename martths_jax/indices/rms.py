"""Root-mean-square error in percent of the target: 100 sqrt(sum e^2 / sum t^2)."""

from __future__ import annotations

from dataclasses import dataclass

from martths_jax.indices.base import TINY, Running, library


@dataclass(frozen=True, kw_only=True)
class Rms(Running):
    """J2, J5, J7, J8 of the benchmark [%]."""

    held = ("error_square", "target_square")

    @staticmethod
    def more(total, x):
        return total + x * x

    def result(self, state):
        errors, targets = state["error_square"], state["target_square"]
        xp = library(errors)
        missing = (targets < TINY) | ~xp.isfinite(errors)
        return {"": (100 * xp.sqrt(errors / targets), missing)}
