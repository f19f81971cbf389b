"""Error by the p-norm over time in percent of the target's: 100 |e|_p / |t|_p.

For p = 2 that is the RMS index, for p to infinity the peak index, for which it stands in where a
gradient is wanted.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp

from martths_jax.indices.base import Kind, joined, library

DOUBLINGS_OF_POWER = 4
POWER = 2**DOUBLINGS_OF_POWER


@dataclass(frozen=True, kw_only=True)
class Norm(Kind):
    """The p-norm, p = ``POWER`` [%]."""

    def init(self, trials):
        return self.blank(trials, 2)

    def add(self, state, signals, reference, k, valid):
        found = []
        for (errors, targets), (value, target) in zip(
            state, self.compared(signals, reference), strict=True
        ):
            error, target = (jnp.where(valid, x, 0.0) for x in (value - target, target))
            found.append((errors + _power(error), targets + _power(target)))
        return tuple(found)

    def finish(self, state):
        return joined(state, ("error_power", "target_power"))

    def result(self, state):
        xp = library(state["error_power"])
        missing = (state["target_power"] == 0) | ~xp.isfinite(state["error_power"])
        error, target = (
            xp.maximum(state[name], 1e-300) ** (1 / POWER)
            for name in ("error_power", "target_power")
        )
        return {"": (100 * error / target, missing)}


def _power(x):
    for _ in range(DOUBLINGS_OF_POWER):
        x = x * x
    return x
