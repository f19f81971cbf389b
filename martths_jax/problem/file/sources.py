"""Where a structure comes from: the tables of a frame, an OpenSees model, or matrices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from martths_jax.errors import InputError
from martths_jax.problem.file.document import Document
from martths_jax.problem.file.frame import FrameTables, read_frame
from martths_jax.problem.file.matrices import read_matrices
from martths_jax.problem.file.table import Table, is_number
from martths_jax.structure.assembly import Assembly, assemble, part_matrices
from martths_jax.structure.partition import Part
from martths_jax.structure.planar import PlanarFrame, dof_name
from martths_jax.structure.readers.labelled import LabelledMatrices
from martths_jax.structure.readers.opensees import read_opensees


@dataclass(frozen=True)
class Whole:
    """A structure before its parts are separated [SI].

    Attributes:
        dofs: names of the q independent degrees of freedom; the interface's stand for themselves.
        M, K: (q, q) mass and stiffness.
        C: (q, q) damping, None where a rule makes it.
        influence: (q,) motion as the ground moves by one.
        part: the laboratory part.
        interface: names of what actuators move.
        outputs: name -> (q,) row of what is looked at.
        drawing: the frame, None for matrices.
        in_laboratory: names of the members that stand in the laboratory.
        place, laboratory_place: where stiffness and laboratory part stand in the document.
        notes: sentences on what was decided.
    """

    dofs: tuple[str, ...]
    M: np.ndarray
    K: np.ndarray
    C: np.ndarray | None
    influence: np.ndarray
    part: Part
    interface: tuple[str, ...]
    outputs: Mapping[str, np.ndarray]
    drawing: PlanarFrame | None
    in_laboratory: frozenset[str]
    place: tuple
    laboratory_place: tuple
    notes: tuple[str, ...] = ()


def _dofs_of(root: Table, key: str, dofs: Sequence[str], held: Sequence[str] = ()) -> tuple:
    """Degrees of freedom that a list names; those that supports hold are faults."""
    short = [f"{name[: -len('rotation')]}r" for name in dofs if name.endswith(".rotation")]
    names = tuple(map(dof_name, root.texts(key, [*dofs, *short], ())))
    for name in names:
        if name in held:
            root.fault(key, f"`{key}` names {name}, which a support holds.")
    return tuple(name for name in names if name not in held)


def _ground(root: Table):
    """Direction of the ground motion, "x", "y" or two numbers; None where it is wrong."""
    given = root.data.get("ground") if "ground" in root else None
    vector = isinstance(given, list) and len(given) == 2 and all(map(is_number, given))
    if given not in ("x", "y") and not (vector and any(given)):
        root.wrong("ground", 'be the direction of the ground motion: "x", "y" or two numbers')
        return None
    return given


def _together(root: Table, laboratory, interface, what: str) -> None:
    """A laboratory part and an interface need one another."""
    if bool(laboratory) != bool(interface):
        missing, there = ("interface", what) if laboratory else (what, "interface")
        if root.data.get(missing) is None:
            root.fault(there, f"`{there}` is given without `{missing}`: give both or none.")


def read_frame_form(document: Document) -> Whole | None:
    """A frame of the tables, or of an OpenSees model with what the tables add."""
    root = document.root
    tables = read_frame(document, _read_opensees(document))
    known = [*tables.members, *tables.groups, *tables.masses]
    for name in tables.groups:
        if name in tables.members or name in tables.masses:
            document.fault(("members",), f"The name {name!r} stands for a group and another part.")
    laboratory = root.texts("laboratory", known, ())
    held = [f"{node}.{d}" for node, found in tables.supports.items() for d in found]
    interface = _dofs_of(root, "interface", tables.dofs, held)
    outputs = _dofs_of(root, "outputs", tables.dofs, held)
    direction = _ground(root)
    _together(root, laboratory, interface, "laboratory")
    if not document.good:
        return None
    with document.blame(("supports",)):
        frame = tables.frame()
        assembly = assemble(frame)
        return _whole(document, tables, frame, assembly, laboratory, interface, outputs, direction)
    return None


def _whole(
    document, tables, frame, assembly: Assembly, laboratory, interface, outputs, direction
) -> Whole | None:
    in_laboratory = [m for name in laboratory for m in tables.groups.get(name, [name])]
    in_laboratory = list(dict.fromkeys(in_laboratory))
    members = [name for name in in_laboratory if name in tables.members]
    masses = [pair for name in in_laboratory for pair in tables.masses.get(name, ())]
    free = [frame.dofs.index(name) for name in assembly.dofs]
    K_L, M_L = (m[np.ix_(free, free)] for m in part_matrices(frame, members, masses))
    T = assembly.T
    names = list(assembly.coordinates)
    taken: dict[int, str] = {}
    for name in interface:
        row = assembly.at(name)
        places = np.flatnonzero(row)
        if len(places) != 1 or row[places[0]] != 1:
            shown = " and ".join(names[i] for i in places)
            document.fault(
                ("interface",),
                f"`interface` names {name}, which a constraint makes of {shown}: name those.",
            )
        elif places[0] in taken:
            other = taken[places[0]]
            document.fault(
                ("interface",),
                f"`interface` names {other} and {name}, which move as one: name one.",
            )
        else:
            taken[places[0]] = names[places[0]] = name
    if not document.good:
        return None
    return Whole(
        dofs=tuple(names),
        M=assembly.M,
        K=assembly.K,
        C=None,
        influence=assembly.influence(direction),
        part=Part(tuple(names), T.T @ M_L @ T, T.T @ K_L @ T),
        interface=interface,
        outputs={name: assembly.at(name) for name in outputs},
        drawing=frame,
        in_laboratory=frozenset(members),
        place=("supports",),
        laboratory_place=("laboratory",),
    )


def _read_opensees(document: Document) -> FrameTables | None:
    table = document.root.table("opensees")
    if table is None:
        return None
    tables = FrameTables()
    name = table.text("file")
    if name is None:
        return tables
    try:
        model = read_opensees(document.beside(name), document.units)
    except InputError as error:
        table.fault("file", str(error))
        return tables
    tables.nodes, tables.sections, tables.materials = model.nodes, model.sections, model.materials
    tables.members, tables.supports = model.members, model.supports
    tables.masses = {f"mass {node}": pairs for node, pairs in model.masses.items()}
    tables.relations = model.relations
    tables.where = {("node", node): (*table.path, "file") for node in model.nodes}
    return tables


def read_matrices_form(document: Document, table: Table) -> Whole | None:
    """A structure of matrices with names, its laboratory part too."""
    root = document.root
    found = read_matrices(table)
    second = root.table("laboratory_matrices")
    part = read_matrices(second) if second else None
    dofs = found.dofs if found else ()
    if "laboratory" in root:
        root.fault(
            "laboratory", "`laboratory` names members, but there are matrices: give "
            "[laboratory_matrices]."
        )  # fmt: skip
    if found is None:
        for key in ("interface", "outputs", "ground"):
            _ = key in root  # known, though there is nothing yet to look them up in
        return None
    interface = _dofs_of(root, "interface", dofs)
    outputs = _dofs_of(root, "outputs", dofs)
    r = _influence(root, found)
    _together(root, part, interface, "laboratory_matrices")
    if r is None or not document.good:
        return None
    empty = np.zeros((0, 0))
    return Whole(
        dofs=dofs,
        M=found.M,
        K=found.K,
        C=found.C,
        influence=r,
        part=Part(part.dofs, part.M, part.K, part.C) if part else Part((), empty, empty),
        interface=interface,
        outputs={name: np.eye(len(dofs))[dofs.index(name)] for name in outputs},
        drawing=None,
        in_laboratory=frozenset(),
        place=table.path,
        laboratory_place=("laboratory_matrices",),
    )


def _influence(root: Table, found: LabelledMatrices) -> np.ndarray | None:
    """Influence vector of a file, or ones on the degrees of freedom along x or y."""
    if found.influence is not None:
        if "ground" in root:
            root.fault("ground", "`ground` is given beside an influence vector: leave one out.")
        return found.influence
    direction = _ground(root)
    if direction is None:
        return None
    x, y = {"x": (1.0, 0.0), "y": (0.0, 1.0)}[direction] if direction in ("x", "y") else direction
    share = {"x": x / np.hypot(x, y), "y": y / np.hypot(x, y)}
    r = np.array([share.get(name.rsplit(".", 1)[-1], 0.0) for name in found.dofs])
    if not np.any(r):
        root.fault(
            "ground",
            "No degree of freedom ends with .x or .y along the ground motion: give the vector "
            "`influence` in [matrices].",
        )
        return None
    return r
