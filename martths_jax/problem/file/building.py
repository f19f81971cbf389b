"""From a structure and its laboratory part to the matrices of both, condensed and damped."""

from __future__ import annotations

import numpy as np

from martths_jax.errors import InputError
from martths_jax.problem.file.damping import Damping
from martths_jax.problem.file.data import DrawnMember, StructureData
from martths_jax.problem.file.document import Document
from martths_jax.problem.file.sources import Whole
from martths_jax.structure.modes import condense, massive, natural_modes
from martths_jax.structure.partition import (
    Separation,
    SystemMatrices,
    condensed_influence,
    negative_directions,
    remainder,
)
from martths_jax.text import counted


class Building:
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
