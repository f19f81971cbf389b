"""What an index is: a row of a table, which names its kind; and what all kinds have in common."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, ClassVar, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.errors import InputError
from martths_jax.observers import Observer

#: Below this, squares have lost their digits.
TINY = np.finfo(float).tiny
#: Name under which a pair finds the response of the reference structure.
REFERENCE = "reference"
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*")


class Row(NamedTuple):
    """One row of a signal: its name and the row's number from 0."""

    signal: str
    row: int


class Pair(NamedTuple):
    """What an index compares.

    Attributes:
        value: the row that is judged.
        target: the row that it should be.
    """

    value: Row
    target: Row

    @classmethod
    def of(cls, value: str, target: str, row: int, target_row: int | None = None) -> Pair:
        """Row `row` of a signal against the same (or another) row of a signal."""
        return cls(Row(value, row), Row(target, row if target_row is None else target_row))


@dataclass(frozen=True, kw_only=True)
class Kind(Observer):
    """A way to compare two signals: what it sums up during a run, and what comes of the sums.

    A kind of one's own is a frozen dataclass that subclasses this one, with ``init``, ``add`` (or
    ``add_piece``) and ``result``; its fields are its settings.  It observes all its pairs at once.

    Attributes:
        pairs: what it observes, n pairs; empty in the table.
        fs: sampling rate [Hz]; 0 in the table.
        quantities: names of what ``result`` gives; one without a name where it is one number.
    """

    pairs: tuple[Pair, ...] = field(default=(), repr=False)
    fs: float = field(default=0.0, repr=False)
    quantities = ("",)

    def on(self, pairs: tuple[Pair, ...], fs: float, attempt: int = 0) -> Kind:
        """The observer of some pairs.

        Args:
            pairs: what it compares.
            fs: sampling rate [Hz].
            attempt: how often a run was repeated because this observer was ``short``.
        """
        return replace(self, pairs=pairs, fs=fs)

    def smooth(self) -> Kind:
        """The kind that stands in for this one where a gradient is wanted."""
        return self

    def interpolated(self) -> Kind:
        """The kind that gives values between the samples, from the same state."""
        return self

    def result(self, state: Any) -> dict[str, tuple[jax.Array, jax.Array]]:
        """What the sums come to.

        Args:
            state: as ``finish`` left it, trials on the last axis, NumPy's or JAX's.

        Returns:
            each of ``quantities`` -> (n, T) values, (n, T) whether there is none.
        """
        raise NotImplementedError

    def short(self, state: Any) -> jax.Array | bool:
        """(T,) whether the run has to be repeated with a wider observer."""
        return False

    def join(self, blocks: Sequence[tuple[Kind, Any]]) -> tuple[Kind, Any]:
        """One observer and state of several blocks of trials, each with its own."""
        states = [state for _, state in blocks]
        return self, jax.tree.map(lambda *x: np.concatenate(x, axis=-1), *states)

    def groups(self) -> list[tuple[str, slice, str, slice]]:
        """(signal, rows, target's signal, rows) of runs of pairs that lie side by side."""
        ends = [
            i + 1
            for i, (one, other) in enumerate(pairwise(self.pairs))
            if other != Pair(*(Row(r.signal, r.row + 1) for r in one))
        ]
        found = []
        for first, last in pairwise([0, *ends, len(self.pairs)]):
            value, target = self.pairs[first].value, self.pairs[first].target
            n = last - first
            found.append((value.signal, slice(value.row, value.row + n),
                          target.signal, slice(target.row, target.row + n)))  # fmt: skip
        return found

    def blank(self, trials: int, number: int):
        """Zeros (rows, T) for each of ``groups``, `number` of them a group."""
        sizes = [rows.stop - rows.start for _, rows, _, _ in self.groups()]
        return tuple((jnp.zeros((n, trials)),) * number for n in sizes)

    def compared(self, signals: Mapping[str, jax.Array], reference: jax.Array):
        """(value, target) of a sample, each (rows, T), group by group."""
        found = []
        for value, rows, target, target_rows in self.groups():
            one = signals[value][rows]
            other = (reference if target == REFERENCE else signals[target])[target_rows]
            found.append((one, jnp.broadcast_to(other, one.shape)))
        return found


class Running(Kind):
    """Two running numbers a pair: of its errors, then of its targets.

    A subclass names them by ``held`` and says by ``more`` how a sample changes one.
    """

    held: ClassVar[tuple[str, str]]

    @staticmethod
    def more(total: jax.Array, x: jax.Array) -> jax.Array:
        """The number after a sample's x (rows, T), zero where the sample does not count."""
        raise NotImplementedError

    def init(self, trials):
        return self.blank(trials, 2)

    def add(self, state, signals, reference, k, valid):
        found = []
        for (errors, targets), (value, target) in zip(
            state, self.compared(signals, reference), strict=True
        ):
            error, target = (jnp.where(valid, x, 0.0) for x in (value - target, target))
            found.append((self.more(errors, error), self.more(targets, target)))
        return tuple(found)

    def finish(self, state):
        return joined(state, self.held)


def joined(groups, names: Sequence[str]) -> dict[str, jax.Array]:
    """(n, T) arrays by name from the groups' tuples."""
    columns = zip(*groups, strict=True)
    return {name: jnp.concatenate(c) for name, c in zip(names, columns, strict=True)}


@dataclass(frozen=True)
class Index:
    """One number a trial that says how well a run went: a row of the table.

    Attributes:
        name: of its column, letters and digits with ``_`` before what it belongs to: ``J5_28``.
        unit: of its values: ``%``, ``ms``, ``mm^2``, ...
        kind: how it comes from its pair.
        pair: what is compared.
        label: what it is, in words.
        source: where it is defined.
        of: which of the kind's ``quantities``.
    """

    name: str
    unit: str
    kind: Kind
    pair: Pair
    label: str = ""
    source: str = ""
    of: str = ""

    def __post_init__(self):
        what = f"Index {self.name!r}"
        if not (isinstance(self.name, str) and _NAME.fullmatch(self.name)):
            raise InputError(
                f"{what} must have a name of letters and digits, parted by `_`, such as J2_1."
            )
        if not isinstance(self.kind, Kind):
            raise InputError(
                f"{what} must have a Kind, such as Rms(), but got {type(self.kind).__name__}."
            )
        if self.of not in self.kind.quantities:
            known = ", ".join(map(repr, self.kind.quantities))
            raise InputError(f"{what}: `of` must be one of {known}, but got {self.of!r}.")

    @property
    def group(self) -> str:
        """What several places share: ``J5`` of ``J5_28``."""
        return self.name.split("_")[0]


def plain(place: str) -> str:
    """A name of an actuator or degree of freedom as it stands in an index's: letters and digits."""
    return re.sub(r"[^A-Za-z0-9]", "", place) or "0"


def library(*arrays):
    """NumPy for arrays on the host, which then needs no compiling; ``jax.numpy`` for others."""
    return jnp if any(isinstance(x, jax.Array) for x in arrays) else np


def trials_first(tree):
    """Arrays whose last axis counts the trials, turned so that the first does."""
    return jax.tree.map(lambda x: library(x).moveaxis(x, -1, 0), tree)


def trials_last(tree):
    """The inverse of ``trials_first``."""
    return jax.tree.map(lambda x: library(x).moveaxis(x, 0, -1), tree)


def on_host(tree):
    """Arrays of a finished run as NumPy's; a tree that is still traced as it is."""
    if any(isinstance(x, jax.core.Tracer) for x in jax.tree.leaves(tree)):
        return tree
    return jax.tree.map(np.asarray, tree)
