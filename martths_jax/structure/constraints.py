"""Linear constraints between degrees of freedom, as one map T from those that stay independent.

A relation says d_follower = sum c_i d_i.  Relations may name one another's followers in any order;
they are eliminated one by one, d = T q is what remains, and K_q = T' K T (virtual work).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from martths_jax.errors import InputError, argument_error
from martths_jax.structure.members import Node

#: Coefficients below this share of the largest one are what round-off leaves of a difference.
ROUND_OFF = 1e-12
#: A follower is eliminated by its own relation unless its coefficient there is smaller than this.
WEAK = 1e-3


@dataclass(frozen=True)
class Relation:
    """d_follower = sum of coefficient * d over `terms`.

    Attributes:
        follower: name of a degree of freedom, ``NODE.x``, ``NODE.y`` or ``NODE.rotation``.
        terms: name of a degree of freedom -> coefficient [1, or m and 1/m between translations and
            rotations].
    """

    follower: str
    terms: Mapping[str, float]

    def __post_init__(self):
        if not isinstance(self.follower, str):
            wanted = "be the name of a degree of freedom"
            raise argument_error("follower", wanted, repr(self.follower)[:80])
        if not isinstance(self.terms, Mapping) or not self.terms:
            wanted = "map names of degrees of freedom to coefficients"
            raise argument_error("terms", wanted, repr(self.terms)[:80])
        for name, value in self.terms.items():
            real = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
            if not (real and np.isfinite(value)):
                wanted = f"give a finite coefficient to {name}"
                raise argument_error("terms", wanted, repr(value)[:80])

    def __str__(self) -> str:
        parts = [n if c == 1 else f"{c:g} {n}" for n, c in self.terms.items()]
        return f"{self.follower} = {' + '.join(parts).replace('+ -', '- ')}"


def equal(leader: str, *followers: str) -> tuple[Relation, ...]:
    """Degrees of freedom that move as the first one does."""
    return tuple(Relation(name, {leader: 1.0}) for name in followers)


def diaphragm(nodes: Sequence[str], direction: str = "x") -> tuple[Relation, ...]:
    """A floor that is rigid in its plane: its nodes move alike in x (or in y)."""
    return equal(*(f"{node}.{direction}" for node in nodes))


def rigid_link(nodes: Mapping[str, Node], leader: str, *followers: str) -> tuple[Relation, ...]:
    """Nodes on one rigid body: motions x - h r, y + w r and r, h above and w right."""
    found = []
    for name in followers:
        dx, dy = nodes[name].x - nodes[leader].x, nodes[name].y - nodes[leader].y
        turn = f"{leader}.rotation"
        found += [
            Relation(f"{name}.x", {f"{leader}.x": 1.0, turn: -dy}),
            Relation(f"{name}.y", {f"{leader}.y": 1.0, turn: dx}),
            Relation(f"{name}.rotation", {turn: 1.0}),
        ]
    return tuple(found)


def resolve(
    relations: Iterable[Relation], dofs: Sequence[str], held: Iterable[str] = ()
) -> tuple[np.ndarray, tuple[str, ...]]:
    """The map T (n, q) of d = T q, and the names of q.

    Args:
        relations: in any order; one that follows from those before it says nothing new.
        dofs: names of all n degrees of freedom that move; the order of q is theirs.
        held: names of those that supports hold at zero.

    Raises:
        InputError: if the relations leave a degree of freedom nothing but zero.
    """
    place = {name: i for i, name in enumerate(dofs)}
    held = frozenset(held)
    follows: dict[str, dict[str, float]] = {}
    for relation in relations:
        row = _reduced(relation, follows, held)
        if not row:
            continue
        if len(row) == 1:
            raise _contradiction(relation, next(iter(row)))
        # The last of equals goes, so that the first of a floor's nodes stays.
        pivot = max(row, key=lambda name: (abs(row[name]), place[name]))
        own = row.get(relation.follower, 0.0)
        if abs(own) >= WEAK * abs(row[pivot]):
            pivot = relation.follower
        scale = row.pop(pivot)
        expression = {name: -c / scale for name, c in row.items()}
        for follower, terms in follows.items():
            if pivot in terms:
                follows[follower] = _substituted(terms, {pivot: expression})
                if not follows[follower]:
                    raise _contradiction(relation, follower)
        follows[pivot] = expression
    kept = tuple(name for name in dofs if name not in follows)
    column = {name: j for j, name in enumerate(kept)}
    T = np.zeros((len(dofs), len(kept)))
    for i, name in enumerate(dofs):
        for leader, c in follows.get(name, {name: 1.0}).items():
            T[i, column[leader]] = c
    return T, kept


def _reduced(relation: Relation, follows, held) -> dict[str, float]:
    """Coefficients of follower - sum terms = 0 over degrees of freedom that are still free."""
    row = {name: -float(c) for name, c in relation.terms.items() if name not in held}
    if relation.follower not in held:
        row[relation.follower] = row.get(relation.follower, 0.0) + 1.0
    return _substituted(row, follows)


def _substituted(terms: Mapping[str, float], follows) -> dict[str, float]:
    """Terms with every follower replaced by what it follows; what cancels is left out."""
    total: dict[str, float] = {}
    size: dict[str, float] = {}
    for name, c in terms.items():
        for leader, factor in follows.get(name, {name: 1.0}).items():
            total[leader] = total.get(leader, 0.0) + c * factor
            size[leader] = max(size.get(leader, 0.0), abs(c * factor))
    return {name: c for name, c in total.items() if abs(c) > ROUND_OFF * size[name]}


def _contradiction(relation: Relation, name: str) -> InputError:
    return InputError(
        f"The constraint {relation} contradicts the others or a support: together they hold {name} "
        "at zero. Hold it by a support if that is meant."
    )
