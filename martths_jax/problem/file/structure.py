"""The structure of a problem file: reference, numerical and laboratory part, by names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from martths_jax.errors import InputError
from martths_jax.problem.file.damping import Damping, read_damping
from martths_jax.problem.file.document import Document, read_document
from martths_jax.problem.file.sources import Whole, read_frame_form, read_matrices_form
from martths_jax.structure.assembly import check_definite
from martths_jax.structure.modes import condense, massive, natural_modes
from martths_jax.structure.partition import (
    Separation,
    SystemMatrices,
    condensed_influence,
    negative_directions,
    remainder,
    separate,
)
from martths_jax.text import counted


@dataclass(frozen=True)
class DrawnMember:
    """A member as pictures need it.

    Attributes:
        name: of it.
        start, end: places (x, y) of its nodes [m].
        laboratory: whether it stands in the laboratory.
    """

    name: str
    start: tuple[float, float]
    end: tuple[float, float]
    laboratory: bool


@dataclass(frozen=True)
class StructureData:
    """A structure and its partition.

    The equation of motion of the reference is M a + C v + K x = -M r a_g with r its influence
    vector.  The numerical substructure has the same load; the laboratory part answers with
    f = M_L a + C_L v + K_L x on the interface, which counts on the left side.

    Attributes:
        reference: the whole structure.
        numerical: without the laboratory part, on the same degrees of freedom.
        laboratory: the laboratory part on the interface alone.
        interface: names of the degrees of freedom that actuators move.
        at: (b,) where they stand among the reference's.
        outputs: names of what is looked at.
        output_rows: (k, n) outputs per degree of freedom of the reference.
        nodes: name -> place (x, y) [m]; empty for matrices.
        members: for pictures; empty for matrices.
        supports: node -> directions that are held.
        notes: sentences about what was condensed or decided on the way.
    """

    reference: SystemMatrices
    numerical: SystemMatrices
    laboratory: SystemMatrices
    interface: tuple[str, ...]
    at: np.ndarray
    outputs: tuple[str, ...]
    output_rows: np.ndarray
    nodes: Mapping[str, tuple[float, float]]
    members: tuple[DrawnMember, ...]
    supports: Mapping[str, tuple[str, ...]]
    notes: tuple[str, ...]


def read_structure(document: Document) -> StructureData | None:
    """Read the structural tables of a document.

    Returns:
        None where something is wrong: ``document.finish`` then says what.
    """
    root = document.root
    condensing = root.flag("condense", True)
    rules = {}
    for key in ("damping", "laboratory_damping"):
        table = root.table(key)
        rules[key] = read_damping(table) if table else None
    matrices = root.table("matrices")
    whole = read_matrices_form(document, matrices) if matrices else read_frame_form(document)
    known = whole is not None or matrices is None
    if known and "damping" not in root.data and (whole is None or whole.C is None):
        root.fault(None, 'The damping is missing: write [damping] with kind = "rayleigh", say.')
    elif rules["damping"] and whole and whole.C is not None:
        root.fault("damping", "Damping is given twice: by the matrix C and by [damping].")
    if whole is None or not document.good:
        return None
    with document.blame(whole.place):
        check_definite(whole.K, whole.dofs)
        _check_mass(whole)
    if not document.good:
        return None
    with document.blame(("laboratory",) if matrices is None else ("laboratory_matrices",)):
        separation = separate(whole.dofs, whole.M, whole.K, whole.part, whole.interface, whole.held)
    if not document.good:
        return None
    return _Building(document, whole, separation, condensing).data(**rules)


def load_structure(path: Path | str) -> StructureData:
    """The structure of a file that holds nothing else.

    Raises:
        InputError: one that lists all faults by line.
    """
    document = read_document(path)
    data = read_structure(document)
    document.finish()
    assert data is not None
    return data


def _check_mass(whole: Whole) -> None:
    """Refuse a mass that is negative in some motion, or none at all."""
    size = np.diag(np.abs(np.diag(whole.M)))
    negative = negative_directions(whole.M, size, whole.dofs)
    if negative:
        raise InputError(f"The mass is negative in the motion of {', '.join(negative)}.")
    if not massive(whole.M).size:
        raise InputError("Nothing has mass: M is zero.")


class _Building:
    """From the separated matrices to the parts."""

    def __init__(self, document: Document, whole: Whole, separation: Separation, condensing: bool):
        self.document, self.whole, self.separation = document, whole, separation
        self.notes: list[str] = list(whole.notes)
        self._tell_separation()
        s, R = separation, separation.R
        self.kept, self.R, self.R_mass, self.at = s.kept, R, s.R_mass, s.at
        self.M, self.K = s.R_mass.T @ whole.M @ s.R_mass, R.T @ whole.K @ R
        if s.own:
            self._tell_loss()
        if condensing:
            self._condense()

    def _tell_separation(self) -> None:
        own, shared = self.separation.own, self.separation.shared
        if own:
            self.notes.append(
                f"Only the laboratory part has {', '.join(name for name, _ in own)}: condensed."
            )
        if shared:
            self.notes.append(
                f"Both parts have {', '.join(shared)} without an actuator: free in the laboratory, "
                "where the interface alone is moved; mass there is computed."
            )

    def _tell_loss(self) -> None:
        """What the inertia of condensed degrees of freedom changes."""
        heavy = [name for name, mass in self.separation.own if mass > 0]
        if not heavy or not massive(self.M).size:
            return
        before = natural_modes(self.whole.M, self.whole.K)[0]
        after = natural_modes(self.M, self.K)[0]
        k = min(3, after.size)
        change = 100 * (after[:k] / before[:k] - 1)
        shown = ", ".join(f"{c:+.2g} %" for c in change)
        self.notes.append(
            f"{', '.join(heavy)} have mass that is condensed to the interface, not exactly: the "
            f"first natural frequencies change by {shown}."
        )

    def _condense(self) -> None:
        """Condense what has no mass and no actuator."""
        kept = np.union1d(massive(self.M), self.at).astype(int)
        lost = len(self.M) - len(kept)
        if not lost or not massive(self.M).size:
            return
        self.K, R = condense(self.K, kept)
        self.K = (self.K + self.K.T) / 2
        self.R, self.R_mass = self.R @ R, self.R_mass @ R
        self.kept = self.kept[kept]
        self.M, self.at = self.M[np.ix_(kept, kept)], np.searchsorted(kept, self.at)
        text = f"{counted(lost, 'degree', 'degrees')} of freedom without mass condensed: "
        text += "frequencies and modes stay"
        C = self.whole.C
        if C is not None and np.any(np.delete(C, self.kept, axis=0)):
            text += ", but the damping that acts on them follows the others"
        self.notes.append(f"{text}.")

    def data(
        self, damping: Damping | None, laboratory_damping: Damping | None
    ) -> StructureData | None:
        """The parts; None where they cannot be."""
        whole, R = self.whole, self.R
        dofs = tuple(whole.dofs[i] for i in self.kept)
        C = None
        with self.document.blame(("damping",)):
            C = R.T @ whole.C @ R if damping is None else damping.matrix(self.M, self.K)
            self._check_damping(C, dofs)
        if not self.document.good:
            return None
        with self.document.blame(("laboratory_damping",)):
            C_L = self._laboratory_damping(damping, laboratory_damping)
        if not self.document.good:
            return None
        r = condensed_influence(whole.M, whole.influence, self.R_mass, self.kept)
        reference = SystemMatrices(dofs, self.M, C, self.K, r)
        s = self.separation
        laboratory = SystemMatrices(whole.interface, s.M, C_L, s.K, r[self.at])
        with self.document.blame(whole.laboratory_place):
            numerical = remainder(reference, laboratory, self.at)
        if not self.document.good:
            return None
        negative = negative_directions(numerical.K, reference.K, dofs)
        if negative:
            self.notes.append(
                "The laboratory part is stiffer than the reference in the motion of "
                f"{', '.join(negative)}: the numerical part's stiffness is negative there."
            )
        drawing = whole.drawing
        return StructureData(
            reference=reference,
            numerical=numerical,
            laboratory=laboratory,
            interface=whole.interface,
            at=self.at,
            outputs=tuple(whole.outputs),
            output_rows=np.array([row @ R for row in whole.outputs.values()]).reshape(
                -1, len(dofs)
            ),
            nodes={n: (p.x, p.y) for n, p in drawing.nodes.items()} if drawing else {},
            members=_drawn(whole),
            supports=drawing.supports if drawing else {},
            notes=tuple(self.notes),
        )

    def _check_damping(self, C: np.ndarray, dofs) -> None:
        size = np.diag(np.diag(np.abs(C)))
        negative = negative_directions(C, size, dofs)
        if negative:
            raise InputError(
                f"The damping is negative in the motion of {', '.join(negative)}: it would feed "
                "energy in."
            )

    def _laboratory_damping(self, damping, own) -> np.ndarray:
        """C of the laboratory part: its own, or its share of Rayleigh damping."""
        s = self.separation
        if own is not None:
            if s.C is not None:
                raise InputError(
                    "The laboratory part's damping is given twice, as C and as a rule."
                )
            return own.matrix(s.M, s.K)
        if s.C is not None:
            return s.C
        if damping is not None and damping.coefficients is not None:
            a_0, a_1 = damping.coefficients(self.M, self.K)
            return a_0 * s.M + a_1 * s.K
        if len(s.K):
            self.notes.append(
                "The laboratory part has no damping of its own, all of it is computed: "
                "[laboratory_damping] would say otherwise."
            )
        return np.zeros_like(s.K)


def _drawn(whole: Whole) -> tuple[DrawnMember, ...]:
    if whole.drawing is None:
        return ()
    nodes = whole.drawing.nodes
    return tuple(
        DrawnMember(
            name,
            (nodes[m.start].x, nodes[m.start].y),
            (nodes[m.end].x, nodes[m.end].y),
            name in whole.in_laboratory,
        )
        for name, m in whole.drawing.members.items()
    )
