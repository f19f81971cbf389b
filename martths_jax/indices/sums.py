"""A run's indices: the observers that sum them up, and their values afterwards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import jax
import numpy as np

from martths_jax.indices.base import Index, Kind, on_host, trials_last
from martths_jax.runtime import check_runtime


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class IndexSums:
    """What a run accumulates, trials on the last axis (in a ``Result`` on the first).

    Attributes:
        states: of the observers, as their ``finish`` left them.
        observers: the kinds, each with its pairs.
        indices: what is made of them.
    """

    states: tuple[Any, ...]
    observers: tuple[Kind, ...] = field(metadata={"static": True})
    indices: tuple[Index, ...] = field(metadata={"static": True})

    def of(self, kind: type[Kind]) -> Any:
        """State of the first observer of a kind."""
        return next(
            s for o, s in zip(self.observers, self.states, strict=True) if isinstance(o, kind)
        )

    @property
    def short(self) -> Any:
        """(T,) whether an observer was too narrow."""
        found = False
        for observer, state in zip(self.observers, self.states, strict=True):
            found = found | observer.short(state)
        return found


def observers_of(indices: Sequence[Index], fs: float, attempt: int = 0) -> tuple[Kind, ...]:
    """One observer for each kind in a set of indices; arguments as of ``Kind.on``."""
    pairs: dict[Kind, list] = {}
    for index in indices:
        mine = pairs.setdefault(index.kind, [])
        if index.pair not in mine:
            mine.append(index.pair)
    return tuple(kind.on(tuple(each), fs, attempt) for kind, each in pairs.items())


def join_sums(blocks: Sequence[IndexSums]) -> IndexSums:
    """Sums of several blocks of trials, on the host, as one."""
    first = blocks[0]
    joined = [
        first.observers[i].join([(b.observers[i], b.states[i]) for b in blocks])
        for i in range(len(first.observers))
    ]
    observers, states = zip(*joined, strict=True) if joined else ((), ())
    return IndexSums(tuple(states), tuple(observers), first.indices)


def _found(sums: IndexSums, interpolate: bool) -> dict[str, tuple[Any, Any]]:
    """Index -> (T,) value, (T,) whether there is none."""
    places: dict[tuple[Kind, Any], tuple[int, int]] = {}
    results = []
    kinds = list(dict.fromkeys(index.kind for index in sums.indices))
    for i, (observer, state) in enumerate(zip(sums.observers, sums.states, strict=True)):
        asked = observer.interpolated() if interpolate else observer
        results.append(asked.result(state))
        places |= {(kinds[i], pair): (i, row) for row, pair in enumerate(observer.pairs)}
    found = {}
    for index in sums.indices:
        i, row = places[index.kind, index.pair]
        value, missing = results[i][index.of]
        found[index.name] = value[row], missing[row]
    return found


def without_value(sums: IndexSums) -> dict[str, jax.Array]:
    """Index -> (T,) whether it has no value, because its target does not move or it overflows."""
    with np.errstate(all="ignore"):
        return {name: missing for name, (_, missing) in _found(sums, False).items()}


def indices_of(sums: IndexSums, interpolate: bool = False) -> dict[str, jax.Array]:
    """The indices (T,) from the sums of a run, trials on the last axis.

    Differentiable; the delays only with `interpolate`, see ``indices``.
    """
    with np.errstate(all="ignore"):  # a trial that diverged, or a target that never moves
        return {name: value for name, (value, _) in _found(sums, interpolate).items()}


def final_indices(sums: IndexSums, lost: np.ndarray, interpolate: bool = False):
    """The indices (T,) of a finished run: NaN in trials (T,) that are `lost`, and without value.

    Args:
        sums: on the host, trials on the last axis.
    """
    with np.errstate(all="ignore"):
        found = _found(sums, interpolate)
    return {
        name: np.where(lost | missing, np.nan, value) for name, (value, missing) in found.items()
    }


def indices(result, *, interpolate: bool = False) -> dict[str, np.ndarray]:
    """The indices of every trial.

    Args:
        result: what ``simulate`` returned.
        interpolate: give J1 and J4 between the samples, by the vertex of the parabola through the
            largest cross-correlation and its neighbours.  Without it they are whole samples, as in
            the benchmark, so that their gradient is zero everywhere and says nothing; to tune or
            differentiate a delay, interpolate.

    Returns:
        Mapping from names to arrays (trials,): the benchmark's ``J1_1`` ... ``J10_27`` unless the
        run was asked for others, J1, J4 in ms, the others in percent.  Trials that diverged have
        NaN throughout, and an index whose target does not move is NaN; ``result.status`` says so.
        Under a JAX transformation the values are traced, with whatever number or infinity the sums
        give in such trials.

    Raises:
        InputError: in single precision.
    """
    check_runtime()
    sums = trials_last(on_host(result.sums))
    if any(isinstance(x, jax.core.Tracer) for x in jax.tree.leaves(sums)):
        return indices_of(sums, interpolate)
    return final_indices(sums, np.asarray(result.lost), interpolate)
