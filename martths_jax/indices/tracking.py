"""The tracking indicator of Mercan and Ricles: the area that measured encloses over target stroke.

With the target x_a and the measured stroke x_m, sample by sample,

    A(k)  = A(k-1)  + (x_a(k) + x_a(k-1)) (x_m(k) - x_m(k-1)) / 2
    TA(k) = TA(k-1) + (x_m(k) + x_m(k-1)) (x_a(k) - x_a(k-1)) / 2
    TI(k) = (A(k) - TA(k)) / 2        [mm^2]

which is TI(k) = TI(k-1) + (x_a(k-1) x_m(k) - x_a(k) x_m(k-1)) / 2.  A lag phi at amplitude X adds
pi X^2 sin(phi) a cycle, a lead takes as much away; an error of amplitude alone adds nothing.

TI is a running sum.  Its last value is the index: it is the lag of the whole record, weighted by
the squared stroke, and noise adds to it with mean zero, while the largest value of a sum that
wanders would grow with the noise.  Lag and lead cancel in it; the rms over time tells of those.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import jax.numpy as jnp

from martths_jax.indices.base import Index, Kind, Pair, joined, library, plain
from martths_jax.indices.benchmark import ACTUATORS

NAMES = ("last", "square", "value", "target", "samples")


@dataclass(frozen=True, kw_only=True)
class TrackingIndicator(Kind):
    """``last``: TI after the last sample; ``rms``: of TI over all samples [unit of the pair^2]."""

    quantities = ("last", "rms")

    def init(self, trials):
        return self.blank(trials, len(NAMES))

    def add(self, state, signals, reference, k, valid):
        found = []
        for (last, square, *before, samples), (value, target) in zip(
            state, self.compared(signals, reference), strict=True
        ):
            area = (before[1] * value - target * before[0]) / 2
            last = last + jnp.where(valid, area, 0.0)
            square = square + jnp.where(valid, last * last, 0.0)
            found.append((last, square, value, target, samples + jnp.where(valid, 1.0, 0.0)))
        return tuple(found)

    def finish(self, state):
        sums = joined(state, NAMES)
        return {name: sums[name] for name in ("last", "square", "samples")}

    def result(self, state):
        xp = library(state["last"])
        missing = ~xp.isfinite(state["square"])
        rms = xp.sqrt(state["square"] / xp.maximum(state["samples"], 1.0))
        return {"last": (state["last"], missing), "rms": (rms, missing)}


def indices_for(actuators: Sequence[str]) -> tuple[Index, ...]:
    """Those of actuators with these names."""
    return tuple(
        Index(
            f"{name}_{plain(place)}", "mm²", TrackingIndicator(), Pair.of("x_m", "x_a", row),
            f"tracking indicator of actuator {place}, {words}",
            "Mercan and Ricles 2007, Earthquake Engineering & Structural Dynamics 36(11)", of,
        )
        for name, of, words in (("TI", "last", "at the end"), ("TIrms", "rms", "rms over time"))
        for row, place in enumerate(actuators)
    )  # fmt: skip


INDICES = indices_for(ACTUATORS)
