"""The rig of a problem file: actuators, their coupler and valves, plants, sensors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from martths_jax.layout import Valves
from martths_jax.problem.file.document import Document
from martths_jax.problem.file.plant import read_plant
from martths_jax.problem.file.structure import StructureData
from martths_jax.problem.file.table import Table
from martths_jax.rig.coupler import Actuator, build_planar_coupler
from martths_jax.rig.direct import Direct
from martths_jax.rig.model import PlantModel
from martths_jax.rig.together import together

#: Letters of the directions that the coupler moves, by how degrees of freedom are called.
LETTERS = {"x": "x", "y": "y", "r": "r", "rotation": "r"}


@dataclass(frozen=True)
class RigData:
    """A rig.

    Attributes:
        actuators: names of the n actuators.
        drawn: (attachment, base or None) of each in the plane [m], None for one that moves a degree
            of freedom directly.
        coupler: between their strokes and the interface.
        order: (d,) where the rows that the coupler moves stand among the interface's.
        valves: of the actuators.
        plant: from the commands to the strokes [mm].
        noise_power: of the displacement sensors [mm^2 s].
        noise_shared: whether they hear the same noise.
        runaway_mm: a stroke beyond this is a loop that has run away [mm].
    """

    actuators: tuple[str, ...]
    drawn: tuple[tuple | None, ...]
    coupler: Any
    order: tuple[int, ...]
    valves: Valves
    plant: PlantModel
    noise_power: float
    noise_shared: bool
    runaway_mm: float


@dataclass(frozen=True)
class _Given:
    """An actuator as the file has it: at a node of the interface, or on one degree of freedom."""

    table: Table
    name: str
    at: str
    ends: Actuator | None


def read_rig(document: Document, structure: StructureData) -> RigData | None:
    """Read the tables of the rig.

    Returns:
        None where something is wrong: ``document.finish`` then says what.
    """
    root = document.root
    tables = root.entries("actuators")
    if not tables:
        root.fault(None, "The actuators are missing: write an [[actuators]] for each.")
    given = [one for table in tables if (one := _read_actuator(table, structure)) is not None]
    names = tuple(one.name for one in given)
    for name in sorted({n for n in names if names.count(n) > 1}):
        root.fault("actuators", f"Two actuators are called {name!r}.")
    valves = _read_valves(root, given)
    sensors = root.table("sensors") or Table(document, ("sensors",), {})
    power = sensors.number("noise_power", default=1.5e-7, least=0.0)  # mm^2 s
    shared = sensors.flag("shared", False)
    runaway = root.number("runaway_mm", default=100.0, above=0.0)
    if len(given) != len(tables) or not document.good:
        return None
    coupled = _couple(document, given, structure)
    plant = read_plant(document, names)
    if coupled is None or plant is None or not document.good:
        return None
    coupler, order, drawn = coupled
    return RigData(names, drawn, coupler, order, valves, plant, power, shared, runaway)


def _read_actuator(table: Table, structure: StructureData) -> _Given | None:
    name = table.text("name")
    if "dof" in table:
        dof = table.text("dof", known=structure.interface)
        return None if None in (name, dof) else _Given(table, name, dof, None)
    nodes = tuple(dict.fromkeys(dof.rpartition(".")[0] for dof in structure.interface))
    node = table.text("node", known=nodes)
    attachment = table.numbers("attachment", "m", count=2, default=(0.0, 0.0))
    ends = {key: table.numbers(key, "m" if key == "base" else "1", count=2)
            for key in ("base", "direction") if key in table}  # fmt: skip
    if None in (name, node) or () in (attachment, *ends.values()):
        return None
    with table.document.blame(table.path):
        return _Given(table, name, node, Actuator(name, attachment, **ends))
    return None


def _read_valves(root: Table, given: list[_Given]) -> Valves:
    table = root.table("valves") or Table(root.document, ("valves",), {})
    limit = table.number("limit", default=np.inf, above=0.0)  # V
    per_mm = tuple(one.table.number("volt_per_mm", default=0.0, least=0.0) for one in given)
    offset = tuple(one.table.number("volt_offset", default=0.0) for one in given)
    return Valves(per_mm, offset, limit)


def _couple(document: Document, given: list[_Given], structure: StructureData):
    """Coupler, its rows' places among the interface's, and the actuators' ends for pictures."""
    interface, parts, order, drawn = structure.interface, [], [], {}
    ordered: list[_Given] = []
    for at in dict.fromkeys(one.at for one in given):
        mine = [one for one in given if one.at == at]
        ordered += mine
        if mine[0].ends is None:
            if len(mine) > 1:
                mine[1].table.fault("dof", f"Two actuators move {at}.")
            parts.append(Direct(1))
            order.append(interface.index(at))
            drawn[mine[0].name] = None
            continue
        dofs = [dof for dof in interface if dof.rpartition(".")[0] == at]
        letters = [LETTERS.get(dof.rpartition(".")[2], "") for dof in dofs]
        with document.blame(mine[0].table.path):
            parts.append(build_planar_coupler([one.ends for one in mine], letters))
        order += [interface.index(dof) for dof in dofs]
        place = np.array(structure.nodes.get(at, (0.0, 0.0)))
        for one in mine:
            base = None if one.ends.base is None else tuple(place + one.ends.base)
            drawn[one.name] = (tuple(place + one.ends.attachment), base)
    for dof in (dof for i, dof in enumerate(interface) if i not in order):
        document.fault(("interface",), f"No actuator reaches {dof}; it is of the interface.")
    for i in sorted({i for i in order if order.count(i) > 1}):
        document.fault(("actuators",), f"Actuators reach {interface[i]} twice.")
    if [one.name for one in ordered] != [one.name for one in given]:
        document.fault(("actuators",), "Actuators of one node must stand side by side.")
    if not document.good:
        return None
    coupler = parts[0] if len(parts) == 1 else together(*parts)
    return coupler, tuple(order), tuple(drawn[one.name] for one in given)
