"""Ties between degrees of freedom of a frame, as tables of a problem file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from martths_jax.problem.file.table import Table, is_number
from martths_jax.structure.constraints import Relation, diaphragm, rigid_link
from martths_jax.structure.planar import dof_name

if TYPE_CHECKING:
    from martths_jax.problem.file.frame import FrameTables


def read_relations(root: Table, tables: FrameTables) -> None:
    """Diaphragms, rigid links and single relations."""
    for table in root.entries("diaphragms"):
        nodes = table.texts("nodes", tables.known("node"))
        direction = table.text("direction", ["x", "y"], "x")
        if len(nodes) > 1 and direction:
            tables.relations += diaphragm(nodes, direction)
        elif isinstance(table.data.get("nodes"), list) and len(table.data["nodes"]) < 2:
            table.wrong("nodes", "be a list of at least two nodes")
    for table in root.entries("rigid_links"):
        leader = table.text("leader", tables.known("node"))
        followers = table.texts("followers", tables.known("node"))
        if leader in followers:
            table.wrong("followers", f"be other nodes than the leader, {leader}")
        elif leader and table.document.good:
            tables.relations += rigid_link(tables.nodes, leader, *followers)
    for table in root.entries("constraints"):
        _read_constraint(table, tables)


def _read_constraint(table: Table, tables: FrameTables) -> None:
    """One relation; its coefficients have the unit of a length where translations meet turns."""
    known = [*tables.dofs, *(f"{node}.r" for node in tables.known("node"))]
    follower = table.text("dof", known)
    terms = table.table("equals")
    if terms is None:
        if "equals" not in table.data:
            table.wrong("equals", 'be a table such as {"2.x" = 1.0}')
        return
    found = {}
    for name in terms.keys():
        if not terms.is_known(name, name, known):
            continue
        if not is_number(terms.data[name]):
            terms.wrong(name, "be a finite number")
            continue
        turns = [dof_name(dof).endswith(".rotation") for dof in (follower or "", name)]
        arm = table.document.units.factor("m") ** (turns[1] - turns[0])
        found[dof_name(name)] = terms.number(name) * arm
    if follower and found:
        tables.relations.append(Relation(dof_name(follower), found))
