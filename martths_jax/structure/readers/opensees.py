"""The model that OpenSees writes with ``print -JSON`` (``printModel('-JSON', '-file', NAME)``).

What is read: nodes of a plane model with three degrees of freedom, their coordinates and masses,
elastic beam-columns (``ElasticBeam2d``, ``ElasticTimoshenkoBeam2d``) on linear transformations with
offsets along the element, and the constraints that some versions print.  OpenSees itself prints
neither fixities nor constraints: those are given beside the model then.  It does not say either
whether an element's mass is consistent; it is taken as lumped, OpenSees' default.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from martths_jax.errors import InputError, raise_all
from martths_jax.structure.constraints import Relation
from martths_jax.structure.members import Material, Member, Node
from martths_jax.structure.planar import DIRECTIONS
from martths_jax.structure.sections import Section
from martths_jax.structure.units import Units
from martths_jax.text import shortened

#: Ends without a moment, by the number that an element's ``release`` has.
RELEASES = {0: (), 1: ("start",), 2: ("end",), 3: ("start", "end")}
ELEMENTS = ("ElasticBeam2d", "ElasticTimoshenkoBeam2d")
#: Names of the two nodes and their degrees of freedom in a constraint, as versions print them.
_FOLLOWER = (("node", "dofs"), ("node_constrained", "constrained_dof"))
_LEADER = (("ref_node", "ref_dof"), ("node_retained", "retained_dof"))


@dataclass
class OpenSeesModel:
    """A planar frame as OpenSees printed it, in SI.

    Attributes:
        nodes, sections, materials, members, supports: as in ``PlanarFrame``; every member has a
            section and a material of its own name.
        masses: node -> (degree of freedom, mass) pairs.
        relations: of its constraints.
    """

    nodes: dict[str, Node] = field(default_factory=dict)
    sections: dict[str, Section] = field(default_factory=dict)
    materials: dict[str, Material] = field(default_factory=dict)
    members: dict[str, Member] = field(default_factory=dict)
    supports: dict[str, tuple[str, ...]] = field(default_factory=dict)
    masses: dict[str, tuple[tuple[str, float], ...]] = field(default_factory=dict)
    relations: list[Relation] = field(default_factory=list)


def read_opensees(path: Path, units: Units, member: str = "{name}") -> OpenSeesModel:
    """Read a model.

    Args:
        path: of the JSON file.
        units: of its numbers: OpenSees has none.
        member: how members are called, by the ``{name}`` (tag) of their elements.

    Raises:
        InputError: one that lists all that is not supported or wrong, by its name.
    """
    try:
        data = json.loads(path.read_text("utf-8"))
    except OSError as error:
        raise InputError(f"File {path} cannot be read ({error.strerror}).") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"File {path} is no JSON ({error}).") from None
    try:
        model = data["StructuralAnalysisModel"]
        geometry = model["geometry"]
        nodes, elements = geometry["nodes"], geometry["elements"]
        turned = model.get("properties", {}).get("crdTransformations", [])
        transformations = {str(t["name"]): t for t in turned}
    except (LookupError, TypeError, AttributeError):
        raise InputError(
            f"File {path} is no model of OpenSees: StructuralAnalysisModel with geometry, nodes "
            "and elements is missing; print it with `print -JSON -file NAME`."
        ) from None
    reading = _Reading(units, transformations, member)
    for kind, entries, read in (
        ("node", nodes, reading.node),
        ("element", elements, reading.element),
        ("constraint", geometry.get("constraints", []), reading.constraint),
    ):
        for entry in entries:
            reading.attempt(kind, entry, read)
    raise_all((f"File {path}: {p}" for p in reading.problems), f"File {path} cannot be used")
    return reading.model


class _Reading:
    """A model as it grows, and what is wrong with it."""

    def __init__(self, units: Units, transformations: Mapping[str, Any], member: str):
        self.units, self.transformations, self.member = units, transformations, member
        self.model, self.problems = OpenSeesModel(), []

    def attempt(self, kind: str, entry, read) -> None:
        """Read an entry, or note why it cannot be."""
        name = entry.get("name", "?") if isinstance(entry, dict) else "?"
        try:
            read(entry)
        except InputError as error:
            colon = ":" if str(error).startswith("Argument") else ""
            self.problems.append(f"{kind} {name}{colon} {error}")
        except KeyError as error:
            self.problems.append(f"{kind} {name} has no entry {error}.")
        except (TypeError, ValueError, IndexError, AttributeError):
            self.problems.append(f"{kind} {name} cannot be read: {shortened(entry)}.")

    def node(self, entry) -> None:
        name, place = str(entry["name"]), [float(x) for x in entry["crd"]]
        if len(place) != 2 or entry["ndf"] != 3:
            raise InputError(
                f"has {len(place)} coordinates and {entry['ndf']} degrees of freedom: only plane "
                "frames with 2 and 3 can be read."
            )
        if name in self.model.nodes:
            raise InputError("stands twice.")
        length = self.units.factor("m")
        self.model.nodes[name] = Node(*(x * length for x in place))
        units = (self.units.factor("kg"),) * 2 + (self.units.factor("kg m^2"),)
        masses = [float(m) for m in entry.get("mass", ())]
        if any(m < 0 for m in masses):
            raise InputError(f"has a negative mass, {min(masses):g}.")
        pairs = zip(DIRECTIONS, masses, units, strict=False)
        found = tuple((f"{name}.{d}", m * unit) for d, m, unit in pairs if m)
        if found:
            self.model.masses[name] = found

    def element(self, entry) -> None:
        kind = entry["type"]
        if kind not in ELEMENTS:
            raise InputError(
                f"is of type {kind}: only {' and '.join(ELEMENTS)} can be read; model what it does "
                "in the problem file, or give matrices."
            )
        start, end = (str(node) for node in entry["nodes"])
        for node in (start, end):
            if node not in self.model.nodes:
                raise InputError(f"names the node {node}, which is unknown.")
        E = float(entry["E"]) * self.units.factor("Pa")
        A = float(entry["A"]) * self.units.factor("m^2")
        I = float(entry["Iz"]) * self.units.factor("m^4")
        G, A_s = E, np.inf
        if kind == ELEMENTS[1]:
            G = float(entry["G"]) * self.units.factor("Pa")
            A_s = float(entry["Avy"]) * self.units.factor("m^2")
        name = self.member.format(name=entry["name"])
        if name in self.model.members:
            raise InputError("stands twice.")
        rigid, flexible = self.offsets(str(entry["crdTransformation"]), start, end)
        # OpenSees counts an element's mass between its rigid ends, a member's goes node to node.
        carried = float(entry.get("massperlength", 0.0)) * self.units.factor("kg/m") * flexible
        release = RELEASES[entry.get("release", 0)]
        member = Member(start, end, name, name, **rigid, release=release, carried=carried)
        self.model.sections[name] = Section(A, I, A_s)
        self.model.materials[name] = Material(E, G)
        self.model.members[name] = member

    def offsets(self, name: str, start: str, end: str) -> tuple[dict, float]:
        """Rigid ends of a member from the offsets of its transformation, and the share between."""
        if name not in self.transformations:
            raise InputError(f"names the transformation {name}, which is unknown.")
        given = self.transformations[name]
        if given["type"] != "LinearCrdTransf2d":
            raise InputError(
                f"stands on a transformation of type {given['type']}: only LinearCrdTransf2d can "
                "be read, since members stay linear."
            )
        a, b = self.model.nodes[start], self.model.nodes[end]
        chord = np.array([b.x - a.x, b.y - a.y])
        length = float(np.hypot(*chord))
        if not length > 0:
            raise InputError("has no length: both its nodes stand at the same place.")
        found = {}
        for key, rigid, sense in (("iOffset", "rigid_start", 1), ("jOffset", "rigid_end", -1)):
            offset = np.array(given.get(key, (0.0, 0.0)), float) * self.units.factor("m")
            along = sense * float(offset @ chord) / length
            if not np.isclose(along, np.hypot(*offset), rtol=1e-9, atol=1e-12 * length):
                raise InputError(
                    f"has an offset {key} that does not point along it: only rigid ends along an "
                    "element can be read."
                )
            found[rigid] = max(along, 0.0)
        flexible = 1 - sum(found.values()) / length
        if not flexible > 0:
            raise InputError("has no length left between its offsets.")
        return found | {"rigid_axially": any(found.values())}, flexible

    def constraint(self, entry) -> None:
        """A fixity ({node, dof, ref_value}) or a constraint between two nodes."""
        if "dof" in entry:
            if entry.get("ref_value", 0) != 0:
                raise InputError(f"moves its node by {entry['ref_value']:g}: only 0 can be read.")
            node = str(entry["node"])
            if node not in self.model.nodes:
                raise InputError(f"names the node {node}, which is unknown.")
            held = self.model.supports.get(node, ())
            self.model.supports[node] = (*held, DIRECTIONS[_index(entry["dof"])])
            return
        followers, leaders = self._dofs(entry, _FOLLOWER), self._dofs(entry, _LEADER)
        matrix = np.array(entry.get("matrix", np.eye(len(followers), len(leaders))), float)
        for name, row in zip(followers, matrix, strict=True):
            terms = {}
            for leader, c in zip(leaders, row, strict=True):
                turns = name.endswith(".rotation"), leader.endswith(".rotation")
                if c:
                    terms[leader] = c * self.units.factor("m") ** (turns[1] - turns[0])
            self.model.relations.append(Relation(name, terms))

    def _dofs(self, entry, ways) -> list[str]:
        for node, dofs in ways:
            if node in entry and dofs in entry:
                if str(entry[node]) not in self.model.nodes:
                    raise InputError(f"names the node {entry[node]}, which is unknown.")
                return [f"{entry[node]}.{DIRECTIONS[_index(d)]}" for d in entry[dofs]]
        raise InputError("is neither a fixity nor a constraint between two nodes.")


def _index(dof) -> int:
    """Place of a degree of freedom, which OpenSees counts from 1."""
    if dof not in (1, 2, 3):
        raise InputError(f"names the degree of freedom {dof}: a plane frame has 1 to 3.")
    return int(dof) - 1
