"""Error by the p-norm over time in percent of the target's: 100 |e|_p / |t|_p.

For p = 2 that is the RMS index, for p to infinity the peak index, for which it stands in where a
gradient is wanted.
"""

from __future__ import annotations

from dataclasses import dataclass

from martths_jax.indices.base import Running, library

DOUBLINGS_OF_POWER = 4
POWER = 2**DOUBLINGS_OF_POWER


@dataclass(frozen=True, kw_only=True)
class Norm(Running):
    """The p-norm, p = ``POWER`` [%]."""

    held = ("error_power", "target_power")

    @staticmethod
    def more(total, x):
        return total + _power(x)

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
