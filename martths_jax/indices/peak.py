"""Largest error in percent of the largest target: 100 max|e| / max|t|."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp

from martths_jax.indices.base import TINY, Kind, joined, library
from martths_jax.indices.norm import Norm


@dataclass(frozen=True, kw_only=True)
class Peak(Kind):
    """J3, J6, J9, J10 of the benchmark [%]."""

    def init(self, trials):
        return self.blank(trials, 2)

    def add(self, state, signals, reference, k, valid):
        found = []
        for (errors, targets), (value, target) in zip(
            state, self.compared(signals, reference), strict=True
        ):
            error = jnp.where(valid, value - target, 0.0)
            target = jnp.where(valid, target, 0.0)
            found.append(
                (jnp.maximum(errors, jnp.abs(error)), jnp.maximum(targets, jnp.abs(target)))
            )
        return tuple(found)

    def finish(self, state):
        return joined(state, ("error_peak", "target_peak"))

    def smooth(self):
        return Norm()

    def result(self, state):
        errors, targets = state["error_peak"], state["target_peak"]
        missing = (targets * targets < TINY) | ~library(errors).isfinite(errors)
        return {"": (100 * errors / targets, missing)}
