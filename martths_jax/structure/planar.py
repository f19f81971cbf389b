"""A planar frame as data: nodes, sections, materials, members, supports, masses, constraints.

Every node owns ``NODE.x``, ``NODE.y`` [m] and ``NODE.rotation`` [rad, counter-clockwise].
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from martths_jax.errors import InputError, argument_error, raise_all
from martths_jax.structure.constraints import Relation
from martths_jax.structure.members import Material, Member, Node, member_matrices
from martths_jax.structure.sections import Section
from martths_jax.text import nearest

DIRECTIONS = ("x", "y", "rotation")
FIXED = DIRECTIONS
PINNED = ("x", "y")


def dof_name(text: str) -> str:
    """Name of a degree of freedom, ``NODE.r`` written in full as ``NODE.rotation``."""
    return f"{text[:-2]}.rotation" if text.endswith(".r") else text


@dataclass(frozen=True)
class PlanarFrame:
    """A planar frame as data.

    Attributes:
        nodes: name -> ``Node``.
        sections: name -> ``Section``.
        materials: name -> ``Material``.
        members: name -> ``Member``.
        supports: node -> directions that are held, of x, y, rotation.
        masses: degree of freedom -> point mass [kg] or moment of inertia [kg m^2]; the name of a
            node alone stands for its x and its y.
        constraints: relations between degrees of freedom, see ``constraints``.
    """

    nodes: Mapping[str, Node]
    sections: Mapping[str, Section]
    materials: Mapping[str, Material]
    members: Mapping[str, Member]
    supports: Mapping[str, Sequence[str]] = field(default_factory=dict)
    masses: Mapping[str, float] = field(default_factory=dict)
    constraints: Sequence[Relation] = ()

    def __post_init__(self):
        self._check_kinds()
        heading = "The frame cannot be built"
        raise_all(self._unknown_names(), heading)
        raise_all([*self._members_without_length(), *self._masses(), *self._loose_nodes()], heading)

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of all degrees of freedom, held ones included, node by node."""
        return tuple(f"{node}.{direction}" for node in self.nodes for direction in DIRECTIONS)

    @property
    def held(self) -> tuple[str, ...]:
        """Names of the degrees of freedom that the supports hold."""
        return tuple(f"{node}.{d}" for node, held in self.supports.items() for d in held)

    def member_matrices(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """(K, M) of a member, (6, 6) each, on x, y and rotation of its start and its end."""
        m = self.members[name]
        return member_matrices(
            m,
            self.sections[m.section],
            self.materials[m.material],
            self.nodes[m.start],
            self.nodes[m.end],
        )

    def _check_kinds(self) -> None:
        kinds = {"nodes": Node, "sections": Section, "materials": Material, "members": Member}
        for name in (*kinds, "supports", "masses"):
            given = getattr(self, name)
            if not isinstance(given, Mapping) or not all(isinstance(key, str) for key in given):
                raise argument_error(name, "map names to values", repr(given)[:80])
            for key, value in given.items():
                if not isinstance(value, kinds.get(name, object)):
                    wanted, got = f"be a {kinds[name].__name__}", type(value).__name__
                    raise argument_error(f"{name}[{key!r}]", wanted, got)
        for node in self.nodes:
            if "." in node or not node:  # a degree of freedom is NODE.x
                raise InputError(f"The name of a node must have no dot in it, but one is {node!r}.")
        for relation in self.constraints:
            if not isinstance(relation, Relation):
                raise argument_error("constraints", "be relations", repr(relation)[:80])

    def _unknown_names(self) -> Iterable[str]:
        for name, m in self.members.items():
            for what, known in (
                ("start", self.nodes), ("end", self.nodes), ("section", self.sections),
                ("material", self.materials),
            ):  # fmt: skip
                given = getattr(m, what)
                if given not in known:
                    noun = "node" if known is self.nodes else what
                    yield (
                        f"Member {name} names the {noun} {given!r}, which is unknown: "
                        f"{nearest(given, known)}."
                    )
        for node, held in self.supports.items():
            if node not in self.nodes:
                yield f"A support stands at the node {node!r}, which is unknown: " + (
                    f"{nearest(node, self.nodes)}."
                )
            listed = isinstance(held, (tuple, list))
            for word in held if listed else [held]:
                if not listed or word not in DIRECTIONS:
                    yield (
                        f"The support of node {node} must be a list of x, y and rotation, but got "
                        f"{word!r}."
                    )
        dofs = self.dofs
        for name in self.masses:
            if name not in dofs and name not in self.nodes:
                yield (
                    f"A point mass is at {name!r}, which is unknown: "
                    f"{nearest(name, [*self.nodes, *dofs])}."
                )
        for relation in self.constraints:
            for name in (relation.follower, *relation.terms):
                if name not in dofs:
                    yield (
                        f"The constraint {relation} names {name!r}, which is unknown: "
                        f"{nearest(name, dofs)}."
                    )

    def _members_without_length(self) -> Iterable[str]:
        for name in self.members:
            try:
                self.member_matrices(name)
            except InputError as error:
                yield f"Member {name} {error}"

    def _masses(self) -> Iterable[str]:
        for name, value in self.masses.items():
            real = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
            if not (real and np.isfinite(value) and value >= 0):
                unit = "kg m^2" if name.endswith(".rotation") else "kg"
                yield (
                    f"The point mass at {name} must be a number of at least zero ({unit}), but got "
                    f"{value!r}."
                )

    def _loose_nodes(self) -> Iterable[str]:
        used = {node for m in self.members.values() for node in (m.start, m.end)}
        used |= {node for node, held in self.supports.items() if set(held) == set(DIRECTIONS)}
        for relation in self.constraints:
            used |= {name.rsplit(".", 1)[0] for name in (relation.follower, *relation.terms)}
        for node in self.nodes:
            if node not in used:
                yield f"Node {node} is loose: no member and no constraint reaches it."
