"""The planar frame of a problem file: tables of nodes, sections, members and what holds them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.constants import g as GRAVITY

from martths_jax.errors import InputError
from martths_jax.problem.file.document import Document
from martths_jax.problem.file.relations import read_relations
from martths_jax.problem.file.table import Table
from martths_jax.structure.constraints import Relation
from martths_jax.structure.members import ENDS, MASSES, Material, Member, Node, member_matrices
from martths_jax.structure.planar import DIRECTIONS, FIXED, PINNED, PlanarFrame
from martths_jax.structure.sections import Section
from martths_jax.text import nearest

#: Words for whole supports.
SUPPORTS = {"fixed": FIXED, "pinned": PINNED}
#: Tables that describe a frame.
TABLES = (
    "nodes",
    "sections",
    "members",
    "supports",
    "masses",
    "diaphragms",
    "rigid_links",
    "constraints",
)


@dataclass
class FrameTables:
    """A frame as it is read, table by table.

    Attributes:
        nodes, sections, materials, members, supports: as in ``PlanarFrame``.
        masses: name of a point mass -> (degree of freedom, mass) pairs.
        relations: of constraints.
        groups: name of a group -> its members.
        where: (kind, name) -> place in the document, of entries that are wrong too, so that what
            names them is not taken for another fault.
    """

    nodes: dict[str, Node] = field(default_factory=dict)
    sections: dict[str, Section] = field(default_factory=dict)
    materials: dict[str, Material] = field(default_factory=dict)
    members: dict[str, Member] = field(default_factory=dict)
    supports: dict[str, tuple[str, ...]] = field(default_factory=dict)
    masses: dict[str, tuple[tuple[str, float], ...]] = field(default_factory=dict)
    relations: list[Relation] = field(default_factory=list)
    groups: dict[str, list[str]] = field(default_factory=dict)
    where: dict[tuple[str, str], tuple] = field(default_factory=dict)

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of all degrees of freedom, held ones included."""
        return tuple(f"{node}.{d}" for node in self.known("node") for d in DIRECTIONS)

    def known(self, kind: str) -> tuple[str, ...]:
        """Names of all nodes, sections, members or masses that the document has."""
        return tuple(name for one, name in self.where if one == kind)

    def frame(self) -> PlanarFrame:
        """The frame; point masses at one degree of freedom are added.

        Raises:
            InputError: if it cannot be built.
        """
        total: dict[str, float] = {}
        for pairs in self.masses.values():
            for dof, mass in pairs:
                total[dof] = total.get(dof, 0.0) + mass
        return PlanarFrame(
            nodes=self.nodes,
            sections=self.sections,
            materials=self.materials,
            members=self.members,
            supports=self.supports,
            masses=total,
            constraints=tuple(self.relations),
        )


def read_frame(document: Document, start: FrameTables | None = None) -> FrameTables:
    """Read the tables of a frame and look for what is wrong with each entry.

    Args:
        document: the file.
        start: what another file gave already; the tables add to it.
    """
    tables = start or FrameTables()
    root = document.root
    _read_nodes(root, tables)
    _read_sections(root, tables)
    _read_members(root, tables)
    _read_supports(root, tables)
    _read_masses(root, tables)
    read_relations(root, tables)
    if document.good:
        _check_loose(document, tables)
    return tables


def _is_new(table: Table, tables: FrameTables, kind: str, name: str) -> bool:
    """Whether no other entry has the name, which is then kept with its place."""
    before = tables.where.setdefault((kind, name), table.path)
    if before is table.path:
        return True
    kind = f"{kind}es" if kind.endswith("s") else f"{kind}s"
    line = table.document.line(before)
    table.fault(None, f"The name {name!r} stands for two {kind}, first on line {line}: change one.")
    return False


def _read_nodes(root: Table, tables: FrameTables) -> None:
    for name, table in root.named("nodes", once=False):
        x, y = table.number("x", "m"), table.number("y", "m")
        if table.number("z", "m", 0.0) != 0:
            table.wrong("z", "be left out or zero: the frame stands in the plane x, y")
        if "." in name:
            table.fault(None, f"The name of a node must have no dot in it, but one is {name!r}.")
        elif _is_new(table, tables, "node", name) and np.isfinite([x, y]).all():
            tables.nodes[name] = Node(x, y)


def _read_sections(root: Table, tables: FrameTables) -> None:
    for name, table in root.named("sections"):
        tables.where["section", name] = table.path
        E = table.number("E", "Pa", above=0)
        A = table.number("A", "m^2", least=0)
        I = table.number("I", "m^4", above=0)
        A_s = table.number("A_s", "m^2", None, above=0)
        G = table.number("G", "Pa", None, above=0)
        density = table.number("density", "kg/m^3", 0.0, least=0)
        if (A_s is None) != (G is None):
            given, other = ("G", "A_s") if A_s is None else ("A_s", "G")
            table.fault(
                given,
                f"Section {name} has `{given}` without `{other}`: a member shears with both, and "
                "without both it does not.",
            )
            continue
        A_s, G = (np.inf, E) if A_s is None else (A_s, G)
        if np.isfinite([E, A, I, G, density]).all() and not np.isnan(A_s):
            tables.sections[name] = Section(A, I, A_s)
            tables.materials[name] = Material(E, G, density)


def _read_members(root: Table, tables: FrameTables) -> None:
    for name, table in root.named("members", once=False, needed=False):
        ends = table.texts("ends", tables.known("node"))
        if len(ends) != 2:
            given = table.data.get("ends")
            if not isinstance(given, list) or len(given) != 2 or given[0] == given[1]:
                table.wrong("ends", "be a list of two nodes")
        section = table.text("section", tables.known("section"))
        settings = {
            "rigid_start": table.number("rigid_start", "m", 0.0, least=0),
            "rigid_end": table.number("rigid_end", "m", 0.0, least=0),
            "rigid_axially": table.flag("rigid_axially"),
            "release": table.texts("release", ENDS, ()),
            "carried": table.number("carried", "kg/m", 0.0, least=0)
            + table.number("load", "N/m", 0.0, least=0) / GRAVITY,
            "mass": table.text("mass", MASSES, "lumped"),
            "rotatory": table.flag("rotatory"),
        }
        group = table.text("group", default=None)
        lengths = [settings[key] for key in ("rigid_start", "rigid_end", "carried")]
        name = name or "-".join(ends)
        if group is not None:
            tables.groups.setdefault(group, []).append(name)
        good = len(ends) == 2 and section is not None and settings["mass"] is not None
        if not _is_new(table, tables, "member", name) or not good:
            continue
        if not (np.isfinite(lengths).all() and {*ends} <= {*tables.nodes}):
            continue
        if section not in tables.sections:
            continue
        member = Member(*ends, section, section, **settings)
        try:
            _check_member(tables, member)
        except InputError as error:
            table.fault(None, f"Member {name} {error}")
            continue
        tables.members[name] = member


def _check_member(tables: FrameTables, m: Member) -> None:
    """Refuse a member without length or with numbers beyond all bounds.

    Raises:
        InputError: to follow the member's name.
    """
    section, material = tables.sections[m.section], tables.materials[m.material]
    ends = tables.nodes[m.start], tables.nodes[m.end]
    try:
        with np.errstate(all="ignore"):
            found = member_matrices(m, section, material, *ends)
        good = np.all(np.isfinite(found))
    except ArithmeticError:
        good = False
    if not good:
        raise InputError("has a stiffness or a mass beyond all bounds: check its units.")


def _read_supports(root: Table, tables: FrameTables) -> None:
    table = root.table("supports")
    for node in table.keys() if table else ():
        if not table.is_known(node, node, tables.known("node")):
            continue
        given = table.data[node]
        if isinstance(given, str):
            word = table.text(node, list(SUPPORTS))
            held = SUPPORTS.get(word, ())
        else:
            held = table.texts(node, [*DIRECTIONS, "r"])
        found = ("rotation" if word == "r" else word for word in held)
        tables.where["support", node] = (*table.path, node)
        tables.supports[node] = tuple(dict.fromkeys([*tables.supports.get(node, ()), *found]))


def _read_masses(root: Table, tables: FrameTables) -> None:
    for node, table in root.named("masses", "node", once=False):
        both = table.number("m", "kg", 0.0, least=0)
        pairs = [
            (f"{node}.x", both + table.number("m_x", "kg", 0.0, least=0)),
            (f"{node}.y", both + table.number("m_y", "kg", 0.0, least=0)),
            (f"{node}.rotation", table.number("I", "kg m^2", 0.0, least=0)),
        ]
        name = table.text("name", default=f"mass {node}")
        if node not in tables.known("node"):
            table.fault(None, _unknown_node("A mass stands at", node, tables))
        elif name and _is_new(table, tables, "mass", name):
            tables.masses[name] = tuple((dof, mass) for dof, mass in pairs if mass)


def _unknown_node(start: str, node: str, tables: FrameTables) -> str:
    return f"{start} node {node!r}, which is unknown: {nearest(node, tables.known('node'))}."


def _check_loose(document: Document, tables: FrameTables) -> None:
    """Nodes that no member and no constraint reaches, and that are not held as a whole."""
    used = {node for m in tables.members.values() for node in (m.start, m.end)}
    used |= {node for node, held in tables.supports.items() if set(held) == set(DIRECTIONS)}
    for relation in tables.relations:
        used |= {name.rsplit(".", 1)[0] for name in (relation.follower, *relation.terms)}
    for node in tables.nodes:
        if node not in used:
            sentence = f"Node {node} is loose: no member and no constraint reaches it."
            document.fault(tables.where.get(("node", node), ("nodes",)), sentence)
