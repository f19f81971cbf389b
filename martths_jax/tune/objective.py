"""What tuning minimises: a weighted sum of indices, each in a form that has a useful gradient.

RMS indices (J2, J5, J7, J8) are smooth as they are.  Two kinds are replaced (``Kind.smooth``):

* delays J1, J4, which are whole samples, by the vertex of the parabola through the largest
  cross-correlation and its neighbours;
* peaks J3, J6, J9, J10, 100 max|e| / max|t|, by 100 |e|_p / |t|_p with the p-norm over time,
  p = 16: for p = 2 that is the RMS index, for p to infinity the peak index.

The final numbers of a tuning are always the true indices.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cached_property

import jax
import jax.numpy as jnp

from martths_jax.benchmark import LAYOUT
from martths_jax.errors import argument_error
from martths_jax.indices import Index, IndexSums, indices_of, known_of, observers_of
from martths_jax.layout import Layout
from martths_jax.observers import Observer
from martths_jax.watch import Watcher


@dataclass(frozen=True)
class Objective:
    """Weighted sum of indices and a penalty on volts.

    Attributes:
        terms: (weight, index name) pairs.
        volt_limit: valve command above which the penalty starts [V]; the valves' own if None.
        penalty: its weight on (peak - volt_limit)^2 summed over the valves [1/V^2].
        layout: of the problem, which has the indices and the valves.
    """

    terms: tuple[tuple[float, str], ...]
    volt_limit: float | None = None
    penalty: float = 10.0
    layout: Layout = LAYOUT

    def __post_init__(self):
        if self.volt_limit is None:
            object.__setattr__(self, "volt_limit", self.layout.valves.limit)

    @classmethod
    def parse(
        cls,
        text: str,
        volt_limit: float | None = None,
        penalty: float = 10.0,
        layout: Layout = LAYOUT,
    ) -> Objective:
        """Objective from a sum such as ``j2 + 0.5*j5 + J8_26``.

        A group (``j2``) stands for the mean of its indices.

        Raises:
            InputError: for an unknown index, a weight or penalty that is not positive, or no term.
        """
        terms, known = [], known_of(layout)
        named = {name.casefold(): name for name in (*known, *(i.group for i in known.values()))}
        for part in text.split("+"):
            match = re.fullmatch(r"\s*(?:([^*\s]+)\s*\*)?\s*([A-Za-z0-9_]+)\s*", part)
            word = match[2].casefold() if match else ""
            group = [
                i.name for i in known.values() if word in (i.name.casefold(), i.group.casefold())
            ]
            if not group:
                raise argument_error(
                    "objective",
                    "be a sum of weighted indices such as j2+0.5*j5",
                    repr(part.strip()),
                    f"The groups are {', '.join(dict.fromkeys(i.group for i in known.values()))}; "
                    f"the indices {', '.join(known)}.",
                )
            wanted = f"have a positive weight on {named[word]}"
            weight = _positive("objective", match[1] or "1", wanted)
            terms += [(weight / len(group), name) for name in group]
        limit = layout.valves.limit if volt_limit is None else volt_limit
        limit = _positive("volts", limit, "be a positive limit (V)")
        weight = float(penalty)
        if not 0 <= weight < float("inf"):
            raise argument_error("penalty", "be zero or positive", penalty)
        return cls(tuple(terms), limit, weight, layout)

    @property
    def names(self) -> tuple[str, ...]:
        """The indices that count, each once."""
        return tuple(dict.fromkeys(name for _, name in self.terms))

    @property
    def weights(self) -> jax.Array:
        """Weight of each of ``names``."""
        return jnp.array([sum(w for w, n in self.terms if n == name) for name in self.names])

    @property
    def shape(self) -> tuple:
        """What a compiled program of it depends on: everything but the weights."""
        return self.names, self.volt_limit, self.penalty, self.layout

    @cached_property
    def smooth(self) -> tuple[Index, ...]:
        """The indices that count, of kinds that have a useful gradient."""
        known = known_of(self.layout)
        return tuple(replace(known[name], kind=known[name].kind.smooth()) for name in self.names)

    def observers(self, fs: float) -> tuple[Observer, ...]:
        """What has to look at a run at a sampling rate [Hz]."""
        return (*observers_of(self.smooth, fs), Watcher(self.layout))

    def evaluate(
        self, observers: tuple[Observer, ...], states, weights: jax.Array | None = None
    ) -> tuple[jax.Array, dict]:
        """Smooth objective of each trial (T,) and the smooth indices it is made of (T,).

        Args:
            observers, states: what looked at a run (``observers``), and what ``loop.run`` says of
                it.
            weights: in place of ``self.weights``; may be traced.
        """
        weights = self.weights if weights is None else weights
        *sums, watch = states
        smooth = indices_of(IndexSums(tuple(sums), observers[:-1], self.smooth))
        over = jnp.maximum(watch.volt_peak - self.volt_limit, 0.0)
        loss = sum(w * jnp.abs(smooth[name]) for w, name in zip(weights, self.names, strict=True))
        return loss + self.penalty * jnp.sum(over**2, axis=0), smooth


def _positive(name, value, wanted) -> float:
    try:
        number = float(value)
    except ValueError:
        number = float("nan")
    if not 0 < number < float("inf"):
        raise argument_error(name, wanted, value)
    return number
