"""Largest error in percent of the largest target: 100 max|e| / max|t|."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp

from martths_jax.indices.base import TINY, Running, library
from martths_jax.indices.norm import Norm


@dataclass(frozen=True, kw_only=True)
class Peak(Running):
    """J3, J6, J9, J10 of the benchmark [%]."""

    held = ("error_peak", "target_peak")

    @staticmethod
    def more(total, x):
        return jnp.maximum(total, jnp.abs(x))

    def smooth(self):
        return Norm()

    def result(self, state):
        errors, targets = state["error_peak"], state["target_peak"]
        missing = (targets * targets < TINY) | ~library(errors).isfinite(errors)
        return {"": (100 * errors / targets, missing)}
