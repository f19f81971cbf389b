"""The nine indices of the uniaxial benchmark, as its evaluation script and as its text have them.

    J1       delay of the measured stroke behind its target [ms]
    J2, J3   its error: deviation, peak [%]
    storeys  1, 2, 3 against the reference structure, storey 1 by the measured stroke [%]

The script's J4, J6, J7 are the storeys' deviations and J5, J8, J9 their peaks, and its table is
printed by them; the text's J4 to J6 are the storeys' root mean squares and J7 to J9 their peaks.
The script takes standard deviations, about the mean, where the text has root mean squares, and
looks for delays of 0 to 49 samples only.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax.numpy as jnp

from martths_jax.indices.base import REFERENCE, TINY, Index, Kind, Pair, joined, library
from martths_jax.indices.delay import Delay
from martths_jax.indices.peak import Peak
from martths_jax.indices.rms import Rms

SCRIPT = "evaluation script of Silva et al. 2020"
TEXT = "Silva et al. 2020"
#: Delays that the script looks at [samples].
MOST_DELAY = 49
_SUMS = ("error", "error_square", "target", "target_square", "samples")


@dataclass(frozen=True, kw_only=True)
class Deviation(Kind):
    """Standard deviation of the error in percent of the target's: 100 s(e) / s(t)."""

    def init(self, trials):
        return self.blank(trials, len(_SUMS))

    def add(self, state, signals, reference, k, valid):
        found = []
        for sums, (value, target) in zip(state, self.compared(signals, reference), strict=True):
            error, target = (jnp.where(valid, x, 0.0) for x in (value - target, target))
            more = error, error * error, target, target * target, jnp.where(valid, 1.0, 0.0)
            found.append(tuple(total + x for total, x in zip(sums, more, strict=True)))
        return tuple(found)

    def finish(self, state):
        return joined(state, _SUMS)

    def result(self, state):
        xp = library(state["error"])
        n = xp.maximum(state["samples"], 1.0)
        variance = lambda of: state[f"{of}_square"] / n - (state[of] / n) ** 2  # noqa: E731
        errors, targets = variance("error"), variance("target")
        missing = ~(targets >= TINY) | ~xp.isfinite(errors)
        return {"": (100 * xp.sqrt(xp.maximum(errors, 0.0) / targets), missing)}


@dataclass(frozen=True, kw_only=True)
class ScriptDelay(Delay):
    """Delay of largest correlation among 0 ... 49 samples [ms].

    The script takes correlation coefficients of what overlaps; as records begin and end at rest,
    the largest sum of products stands at the same delay.
    """

    def on(self, pairs, fs, attempt=0):
        # Correlations to the left of zero are kept for the parabola, and not looked at.
        return replace(self, pairs=pairs, fs=fs, lags=(1, MOST_DELAY + 1))

    def result(self, state):
        r = state["correlation"]
        xp = library(r)
        best = xp.argmax(r[1:-1], axis=0)
        _, missing = super().result(state)[""]
        lag = best.astype(float)
        if self.interpolate:
            left, middle, right = (
                xp.take_along_axis(r, (best + d)[None], axis=0)[0] for d in range(3)
            )
            bend = left - 2 * middle + right
            offset = xp.where(bend < 0, (left - right) / (2 * xp.where(bend < 0, bend, 1.0)), 0.0)
            lag = lag + xp.clip(offset, -0.5, 0.5)
        return {"": (lag / self.fs * 1e3, missing)}

    def short(self, state):
        """Never: the range is the script's."""
        return False


_STROKE = Pair.of("x_m", "x_a", 0)
#: Storeys by number: 1 by the measured stroke.
_STOREYS = (
    Pair.of("est", REFERENCE, 0),
    Pair.of("num", REFERENCE, 1),
    Pair.of("num", REFERENCE, 2),
)


def _table(of_storeys: dict[int, tuple[Kind, int]], delay: Kind, spread: Kind, ending: str, source):
    words = {Peak: "peak error", Rms: "rms error", Deviation: "deviation of the error"}
    stroke = "measured stroke against its target"
    rows = {
        1: ("ms", delay, _STROKE, "delay of the measured stroke"),
        2: ("%", spread, _STROKE, f"{words[type(spread)]}, {stroke}"),
        3: ("%", Peak(), _STROKE, f"{words[Peak]}, {stroke}"),
    }
    for number, (kind, storey) in of_storeys.items():
        label = f"{words[type(kind)]}, storey {storey} against the reference"
        rows[number] = ("%", kind, _STOREYS[storey - 1], label)
    return tuple(
        Index(f"J{n}{ending}", unit, kind, pair, label, source)
        for n, (unit, kind, pair, label) in sorted(rows.items())
    )


_D, _P, _R = Deviation(), Peak(), Rms()
INDICES = _table(
    {4: (_D, 1), 5: (_P, 1), 6: (_D, 2), 7: (_D, 3), 8: (_P, 2), 9: (_P, 3)},
    ScriptDelay(), _D, "", SCRIPT,
)  # fmt: skip
IN_TEXT = _table(
    {4: (_R, 1), 5: (_R, 2), 6: (_R, 3), 7: (_P, 1), 8: (_P, 2), 9: (_P, 3)},
    Delay(), _R, "text", TEXT,
)  # fmt: skip
GROUPS = {"benchmark": INDICES, "text": IN_TEXT}
