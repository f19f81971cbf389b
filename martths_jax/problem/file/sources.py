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
        held: names of what the laboratory holds fixed.
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
    held: tuple[str, ...]
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


@dataclass(frozen=True)
class _Asked:
    """Names of degrees of freedom that the top of the file lists."""

    interface: tuple[str, ...]
    held: tuple[str, ...]
    outputs: tuple[str, ...]

    @classmethod
    def read(cls, root: Table, dofs: Sequence[str], supported: Sequence[str] = ()) -> _Asked:
        keys = ("interface", "laboratory_held", "outputs")
        asked = cls(*(_dofs_of(root, key, dofs, supported) for key in keys))
        for name in asked.held:
            if name in asked.interface:
                sentence = f"`laboratory_held` names {name}, which stands in `interface` too."
                root.fault("laboratory_held", sentence)
        return asked


def read_frame_form(document: Document) -> Whole | None:
    """A frame of the tables, or of an OpenSees model with what the tables add."""
    root = document.root
    tables = read_frame(document, _read_opensees(document))
    known = [*tables.known("member"), *tables.groups, *tables.known("mass")]
    for name in tables.groups:
        if name in (*tables.known("member"), *tables.known("mass")):
            document.fault(("members",), f"The name {name!r} stands for a group and another part.")
    laboratory = root.texts("laboratory", known, ())
    supported = [f"{node}.{d}" for node, found in tables.supports.items() for d in found]
    asked = _Asked.read(root, tables.dofs, supported)
    direction = _ground(root)
    _together(root, laboratory, asked.interface, "laboratory")
    if not document.good:
        return None
    with document.blame(("supports",)):
        frame = tables.frame()
        assembly = assemble(frame)
    if not document.good:
        return None
    inside = [part for name in laboratory for part in tables.groups.get(name, [name])]
    inside = list(dict.fromkeys(inside))
    names = _names(root, assembly, "interface", asked.interface)
    held = _names(root, assembly, "laboratory_held", asked.held)
    if not document.good:
        return None
    dofs = tuple(names.get(i, name) for i, name in enumerate(assembly.coordinates))
    return Whole(
        dofs=dofs,
        M=assembly.M,
        K=assembly.K,
        C=None,
        influence=assembly.influence(direction),
        part=_part(tables, frame, assembly, inside, dofs),
        interface=asked.interface,
        held=tuple(dofs[i] for i in held),
        outputs={name: assembly.at(name) for name in asked.outputs},
        drawing=frame,
        in_laboratory=frozenset(name for name in inside if name in tables.members),
        place=("supports",),
        laboratory_place=("laboratory",),
    )


def _names(root: Table, assembly: Assembly, key: str, asked: Sequence[str]) -> dict[int, str]:
    """Independent coordinates that degrees of freedom stand for, by the names given here."""
    found: dict[int, str] = {}
    for name in asked:
        row = assembly.at(name)
        places = np.flatnonzero(row)
        if len(places) != 1 or row[places[0]] != 1:
            shown = " and ".join(assembly.coordinates[i] for i in places)
            sentence = f"`{key}` names {name}, which a constraint makes of {shown}: name those."
            root.fault(key, sentence)
        elif places[0] in found:
            other = found[places[0]]
            root.fault(key, f"`{key}` names {other} and {name}, which move as one: name one.")
        else:
            found[int(places[0])] = name
    return found


def _part(tables, frame: PlanarFrame, assembly: Assembly, inside, dofs) -> Part:
    """Members and masses of the laboratory in the independent coordinates."""
    members = [name for name in inside if name in tables.members]
    masses = [pair for name in inside for pair in tables.masses.get(name, ())]
    free = np.ix_(*[[frame.dofs.index(name) for name in assembly.dofs]] * 2)
    K, M = (matrix[free] for matrix in part_matrices(frame, members, masses))
    T = assembly.T
    return Part(dofs, T.T @ M @ T, T.T @ K @ T)


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
    place = (*table.path, "file")
    for kind, names in (
        ("node", model.nodes), ("section", model.sections), ("member", model.members),
        ("mass", tables.masses),
    ):  # fmt: skip
        tables.where |= {(kind, name): place for name in names}
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
        for key in ("interface", "laboratory_held", "outputs", "ground"):
            _ = key in root  # known, though there is nothing yet to look them up in
        return None
    asked = _Asked.read(root, dofs)
    r = _influence(root, found)
    _together(root, part, asked.interface, "laboratory_matrices")
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
        interface=asked.interface,
        held=asked.held,
        outputs={name: np.eye(len(dofs))[dofs.index(name)] for name in asked.outputs},
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
