"""The reference structure: a 38-DOF Timoshenko frame, its diaphragms, damping and modes.

Degrees of freedom as the benchmark numbers them: node i (1..12) owns x: i, y: 12 + i and
rotation: 24 + i; 37 and 38 are the rotations of the two pinned bases.  Rigid floor diaphragms tie
the x translations of a floor, which leaves 29 independent coordinates ordered as
(3 storey translations, 12 vertical, 12 rotations, 2 base rotations).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from martths_jax.structure.assembly import free_matrices
from martths_jax.structure.constraints import Relation, diaphragm, resolve
from martths_jax.structure.damping import rayleigh_coefficients
from martths_jax.structure.members import Material, Member, Node
from martths_jax.structure.modes import effective_masses, massive, natural_modes
from martths_jax.structure.planar import DIRECTIONS, FIXED, PINNED, PlanarFrame
from martths_jax.structure.sections import FrameGeometry

N_DOF = 38
N_FREE = 29
#: Degrees of freedom (benchmark numbering) that the indices look at: the interface's translation
#: and rotation, then those of the second and the third storey.
OUTPUT_DOFS = (4, 28, 2, 26, 3, 27)
#: Where a force of the experimental frame acts: first-floor x, rotations of nodes 4 and 7.
FORCE_DOFS = (4, 28, 31)


@dataclass(frozen=True)
class Structure:
    """Second-order model M a + C v + K d = -M l a_g + f in independent coordinates.

    Attributes:
        M, C, K: (n, n) mass [kg], damping and stiffness; n = 29 for the benchmark's frame.
        influence: (n,) l, the motion of the coordinates when the ground moves by one.
    """

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray
    influence: np.ndarray


@dataclass(frozen=True)
class Modes:
    """Undamped modes, lowest first.

    Attributes:
        frequency: (n,) natural frequencies [Hz].
        effective_mass: (n,) share of the translational mass that each mode carries in x [-].
        shape: (29, n) mode shapes in the independent coordinates, mass normalised.
    """

    frequency: np.ndarray
    effective_mass: np.ndarray
    shape: np.ndarray


def independent_coordinate(dof: int) -> int:
    """Index (0..28) of the independent coordinate that a benchmark DOF (1..38) follows."""
    if dof <= 12:
        return (dof - 1) % 3
    return dof - 10


def _end(line: int, floor: int) -> str:
    """Name of a node: 1 to 12 as the benchmark numbers them, base 1 to base 4 below."""
    return str(3 * line + floor) if floor else f"base {line + 1}"


def _dof_names() -> tuple[str, ...]:
    """The benchmark's degrees of freedom 1 to 38 by name."""
    nodes = [str(node) for node in range(1, 13)]
    names = [f"{node}.{direction}" for direction in DIRECTIONS for node in nodes]
    return (*names, "base 2.rotation", "base 3.rotation")


def planar_frame(geometry: FrameGeometry) -> PlanarFrame:
    """The reference frame as data: nodes, members, supports, masses and diaphragms.

    The origin is the interface node.  Lengths from there are whole multiples of bay and storey,
    whose differences are exact, so that all members of a kind have the same length to the bit.
    """
    g = geometry
    nodes = {
        _end(line, floor): Node((line - 1) * g.bay, (floor - 1) * g.storey)
        for line in range(4)
        for floor in range(4)
    }
    members = {}
    for line in range(4):
        for floor in range(3):
            kind = "interior ground column" if floor == 0 and line in (1, 2) else "column"
            pinned = {"rigid_end": g.pin_offset, "release": ("end",)}
            start, end = _end(line, floor), _end(line, floor + 1)
            members[f"column {start}-{end}"] = Member(
                start, end, kind, "steel", **(pinned if (line, floor) == (2, 0) else {})
            )
    for bay in range(3):
        for floor in (1, 2, 3):
            kind = "interior ground beam" if (bay, floor) == (1, 1) else "beam"
            start, end = _end(bay, floor), _end(bay + 1, floor)
            members[f"beam {start}-{end}"] = Member(start, end, kind, "steel")
    masses = {f"{_end(0, floor + 1)}.x": m for floor, m in enumerate(g.storey_mass)}
    for line, floors in enumerate(g.vertical_mass):
        masses |= {f"{_end(line, floor)}.y": m for floor, m in enumerate(floors, 1)}
    return PlanarFrame(
        nodes=nodes,
        sections={
            "column": g.column,
            "interior ground column": g.interior_ground_column,
            "beam": g.beam,
            "interior ground beam": g.interior_ground_beam,
        },
        materials={"steel": Material(g.E, g.G)},
        members=members,
        supports={"base 1": FIXED, "base 2": PINNED, "base 3": PINNED, "base 4": FIXED},
        masses=masses,
        constraints=_diaphragms(),
    )


def _diaphragms() -> tuple[Relation, ...]:
    floors = ([_end(line, floor) for line in range(4)] for floor in (1, 2, 3))
    return tuple(relation for nodes in floors for relation in diaphragm(nodes))


def _benchmark_matrices(geometry: FrameGeometry) -> tuple[np.ndarray, np.ndarray]:
    """(K, M), (38, 38) each, before the diaphragms and in the benchmark's order."""
    names, K, M = free_matrices(planar_frame(geometry))
    order = np.ix_(*[[names.index(name) for name in _dof_names()]] * 2)
    return K[order], M[order]


def assemble_stiffness(geometry: FrameGeometry) -> np.ndarray:
    """(38, 38) stiffness before the diaphragms are applied [N/m, N, N m]."""
    return _benchmark_matrices(geometry)[0]


def diaphragm_map() -> np.ndarray:
    """(38, 29) map from the independent coordinates to all DOFs (rigid floors)."""
    return resolve(_diaphragms(), _dof_names())[0]


def build_reference(
    geometry: FrameGeometry | None = None,
    *,
    damping_anchors: tuple[float, float] = (13.493, 165.125),
    damping_ratio: float = 0.05,
) -> Structure:
    """Assemble the reference structure.

    Args:
        geometry: sections, lengths and masses; the benchmark's by default.
        damping_anchors: the two circular frequencies of the Rayleigh damping [rad/s].  The
            benchmark's first one is 13.493, although its first mode is at 14.40 rad/s.
        damping_ratio: share of critical damping at both [-].
    """
    geometry = geometry or FrameGeometry()
    T = diaphragm_map()
    K, M = (T.T @ matrix @ T for matrix in _benchmark_matrices(geometry))
    a_0, a_1 = rayleigh_coefficients(*damping_anchors, damping_ratio)
    influence = np.zeros(N_FREE)
    influence[:3] = 1.0
    return Structure(M=M, C=a_0 * M + a_1 * K, K=K, influence=influence)


def modes(structure: Structure) -> Modes:
    """Natural modes; the rotations, which carry no mass, are condensed statically (Table 1)."""
    omega, shape = natural_modes(structure.M, structure.K)
    m, l = massive(structure.M), structure.influence
    total = l[m] @ structure.M[np.ix_(m, m)] @ l[m]
    return Modes(
        frequency=omega / (2 * np.pi),
        effective_mass=effective_masses(structure.M, shape, l) / total,
        shape=shape,
    )
