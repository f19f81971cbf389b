"""Two ways down: quasi-Newton steps (L-BFGS) and Adam, each evaluation a step of its own.

All that a method knows is a dict of numbers, lists and texts, which JSON holds to the bit: a
descent that is stored after each evaluation goes on as if it had never been interrupted.  A point
at which a trial diverges has no value; both treat it as infinitely bad and come nearer.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping

import numpy as np

#: Share of the first step below which coming nearer has failed.
SHORTEST = 1e-3


class Method(ABC):
    """A way down from a start.

    Args:
        names: coordinates that move.
        rate: length of the first step, in the units of the coordinates.
    """

    def __init__(self, names: tuple[str, ...], rate: float):
        self.names, self.rate = names, rate

    @abstractmethod
    def init(self, start: Mapping[str, float]) -> dict:
        """What it knows before the first evaluation; ``trial`` is where that is."""

    @abstractmethod
    def advance(self, known: dict, loss: float, slope: Mapping[str, float], good: bool) -> bool:
        """Take in the evaluation at ``known["trial"]`` and choose the next trial.

        Args:
            known: is changed; ``ended`` says why there is no further trial, if there is none.
            loss, slope: there; without meaning unless `good`.
            good: whether both are finite and no trial diverged.

        Returns:
            whether the descent goes on from there.
        """


class Adam(Method):
    """Steps of the length `rate` in each coordinate, by running means of slope and its square
    (Kingma & Ba 2015); half the way back and shorter steps after a point that is not good."""

    DECAYS = (0.9, 0.999)
    TINY = 1e-8

    def init(self, start):
        blank = [0.0] * len(self.names)
        return {"trial": dict(start), "here": dict(start), "means": [blank, blank], "count": 0,
                "length": self.rate, "ended": ""}  # fmt: skip

    def advance(self, known, loss, slope, good):
        if not good:
            known["length"] /= 2
            here = known["here"]
            known["trial"] = {n: (x + here[n]) / 2 for n, x in known["trial"].items()}
            if known["length"] < SHORTEST * self.rate:
                known["ended"] = "steps became too short: every direction is unstable"
            return False
        g = np.array([slope[name] for name in self.names])
        known["count"] += 1
        unbiased = []
        for i, (decay, x) in enumerate(zip(self.DECAYS, (g, g**2), strict=True)):
            mean = decay * np.array(known["means"][i]) + (1 - decay) * x
            known["means"][i] = mean.tolist()
            unbiased.append(mean / (1 - decay ** known["count"]))
        move = unbiased[0] / (np.sqrt(unbiased[1]) + self.TINY)
        known["here"] = dict(known["trial"])
        for name, by in zip(self.names, move.tolist(), strict=True):
            known["trial"][name] -= known["length"] * by
        return True


class LBFGS(Method):
    """Quasi-Newton steps by the last pairs of moves and changes of slope (Nocedal 1980).

    A step is taken where the objective has fallen enough and its slope has flattened (weak Wolfe
    conditions), found by bisection with cubic interpolation; a point that is not good bounds the
    search like one that is too high.  If a search fails, the memory is dropped and the next goes
    straight down; if that fails too, the descent has ended.
    """

    MEMORY = 10
    FALL, FLAT = 1e-4, 0.9
    #: Longest change of a coordinate in one step, in units of the coordinates.
    LONGEST = 1.0
    #: Evaluations on one line.
    MOST = 20

    def init(self, start):
        return {"trial": dict(start), "here": dict(start), "loss": None, "slope": [], "pairs": [],
                "direction": [], "length": 0.0, "low": [], "high": [], "count": 0,
                "ended": ""}  # fmt: skip

    def advance(self, known, loss, slope, good):
        g = np.array([slope[name] for name in self.names]) if good else np.zeros(len(self.names))
        if known["loss"] is None:
            if good:
                self._accept(known, loss, g)
            else:
                known["ended"] = "it does not begin at a good point"
            return good
        return self._on_line(known, loss, g, good)

    def _on_line(self, known: dict, loss: float, g: np.ndarray, good: bool) -> bool:
        """Accept a point on the line, or move its bounds and choose another."""
        direction, length = np.array(known["direction"]), known["length"]
        fall = float(np.dot(known["slope"], direction))
        along = float(np.dot(g, direction))
        known["count"] += 1
        lowest = known["low"][1] if known["low"] else known["loss"]
        if not good or loss > known["loss"] + self.FALL * length * fall or loss > lowest:
            known["high"] = [length, loss, along] if good else [length]
        elif along < self.FLAT * fall:
            # Still steep: the best point so far, kept whole in case nothing better is found.
            known["low"] = [length, loss, along, g.tolist()]
        else:
            self._accept(known, loss, g)
            return True
        if self._exhausted(known, direction):
            return self._give_up(known)
        known["length"] = self._between(known, direction, fall)
        self._place(known)
        return False

    def _between(self, known: dict, direction: np.ndarray, fall: float) -> float:
        """Next length on the line: inside the bounds, or twice as far where there is no end."""
        low = known["low"][:3] if known["low"] else [0.0, known["loss"], fall]
        if not known["high"]:
            return min(2 * known["length"], self.LONGEST / float(np.max(np.abs(direction))))
        high = known["high"]
        width = high[0] - low[0]
        if len(high) == 1:
            return low[0] + width / 4 if low[0] == 0 else low[0] + width / 2
        where = _cubic(*low, *high)
        return float(np.clip(where, low[0] + width / 10, high[0] - width / 10))

    def _exhausted(self, known: dict, direction: np.ndarray) -> bool:
        """Whether the line holds nothing more worth an evaluation."""
        reach = float(np.max(np.abs(direction)))
        if known["high"]:
            low = known["low"][0] if known["low"] else 0.0
            small = reach * (known["high"][0] - low) < SHORTEST * self.rate
        else:
            small = reach * known["length"] >= self.LONGEST
        return small or known["count"] >= self.MOST

    def _give_up(self, known: dict) -> bool:
        """Take the best point of the line if there is one; else go straight down, or end."""
        if known["low"]:
            length, loss, _, g = known["low"]
            known["length"] = length
            self._place(known)
            self._accept(known, loss, np.array(g))
        elif known["pairs"]:
            known["pairs"] = []
            self._aim(known)
        else:
            known["ended"] = "no step improves it"
        return False

    def _accept(self, known: dict, loss: float, g: np.ndarray) -> None:
        """Move to the trial, remember the curvature on the way and aim from there."""
        if known["loss"] is not None:
            x, before = (self._point(known[k]) for k in ("trial", "here"))
            s, y = x - before, g - np.array(known["slope"])
            if np.dot(s, y) > 1e-10 * np.dot(y, y):
                known["pairs"] = [*known["pairs"], [s.tolist(), y.tolist()]][-self.MEMORY :]
        known["here"], known["loss"], known["slope"] = dict(known["trial"]), loss, g.tolist()
        if not np.any(g):
            known["ended"] = "the slope is zero"
            return
        self._aim(known)

    def _aim(self, known: dict) -> None:
        """Choose the direction from here, and the first trial on it."""
        g = np.array(known["slope"])
        direction = -self._times_inverse(known["pairs"], g)
        if not np.dot(direction, g) < 0:  # rounding, after very uneven pairs
            known["pairs"], direction = [], -g
        reach = float(np.max(np.abs(direction)))
        first = 1.0 if known["pairs"] else self.rate / reach
        known["direction"], known["count"] = direction.tolist(), 0
        known["low"], known["high"] = [], []
        known["length"] = min(first, self.LONGEST / reach)
        self._place(known)

    @staticmethod
    def _times_inverse(pairs: list, g: np.ndarray) -> np.ndarray:
        """The inverse of the curvature that the pairs tell, times a slope (two loops)."""
        pairs = [tuple(map(np.array, pair)) for pair in pairs]
        q, weights = g.copy(), []
        for s, y in reversed(pairs):
            weights.append(np.dot(s, q) / np.dot(s, y))
            q -= weights[-1] * y
        if pairs:
            s, y = pairs[-1]
            q *= np.dot(s, y) / np.dot(y, y)
        for (s, y), weight in zip(pairs, reversed(weights), strict=True):
            q += (weight - np.dot(y, q) / np.dot(s, y)) * s
        return q

    def _place(self, known: dict) -> None:
        """Set the trial to a length on the line."""
        known["trial"] = dict(known["here"])
        for name, by in zip(self.names, known["direction"], strict=True):
            known["trial"][name] += known["length"] * by

    def _point(self, coordinates: dict) -> np.ndarray:
        return np.array([coordinates[name] for name in self.names])


def _cubic(a: float, fa: float, da: float, b: float, fb: float, db: float) -> float:
    """Minimum of the cubic through values and slopes at a and b; the middle where it has none."""
    with np.errstate(all="ignore"):
        d1 = da + db - 3 * (fa - fb) / (a - b)
        d2 = np.sign(b - a) * np.sqrt(d1**2 - da * db)
        found = b - (b - a) * (db + d2 - d1) / (db - da + 2 * d2)
    return float(found) if np.isfinite(found) else (a + b) / 2


METHODS = {"lbfgs": LBFGS, "adam": Adam}
