"""The reference structure: a 38-DOF Timoshenko frame, its diaphragms, damping and modes.

Degrees of freedom as the benchmark numbers them: node i (1..12) owns x: i, y: 12 + i and
rotation: 24 + i; 37 and 38 are the rotations of the two pinned bases.  Rigid floor diaphragms tie
the x translations of a floor, which leaves 29 independent coordinates ordered as
(3 storey translations, 12 vertical, 12 rotations, 2 base rotations).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from martths_jax.structure.sections import FrameGeometry, Section

N_DOF = 38
N_FREE = 29
#: Degrees of freedom (benchmark numbering) that the indices look at: the interface's translation
#: and rotation, then those of the second and the third storey.
OUTPUT_DOFS = (4, 28, 2, 26, 3, 27)
#: Where a force of the experimental frame acts: first-floor x, rotations of nodes 4 and 7.
FORCE_DOFS = (4, 28, 31)


@dataclass(frozen=True)
class Structure:
    """Second-order model M a + C v + K d = -mass_ground l a_g + f of a frame with diaphragms.

    Attributes:
        M, C, K: (29, 29) mass [kg], damping and stiffness in the independent coordinates.
        influence: (29,) ones on the storey translations.
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


def bending_stiffness(section: Section, length: float, E: float, G: float) -> np.ndarray:
    """(4, 4) Timoshenko stiffness on (v_1, rotation_1, v_2, rotation_2), v to the left of 1-2."""
    L, EI = length, E * section.I
    phi = 12 * EI / (G * section.A_s * L**2)
    return (
        EI
        / (L**3 * (1 + phi))
        * np.array(
            [
                [12, 6 * L, -12, 6 * L],
                [6 * L, (4 + phi) * L**2, -6 * L, (2 - phi) * L**2],
                [-12, -6 * L, 12, -6 * L],
                [6 * L, (2 - phi) * L**2, -6 * L, (4 + phi) * L**2],
            ]
        )
    )


def _released_column(section: Section, length: float, offset: float, E: float, G: float):
    """(4, 4) column on (v_1, rotation_1, v_2, rotation_2) with a pin `offset` below its top.

    The part below the pin carries no moment at its upper end (that rotation is condensed); the
    part above is rigid, so the pin moves with v = v_2 - offset * rotation_2.
    """
    k = bending_stiffness(section, length - offset, E, G)
    keep = [0, 1, 2]
    k = k[np.ix_(keep, keep)] - np.outer(k[keep, 3], k[3, keep]) / k[3, 3]
    rigid = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -offset]])
    return rigid.T @ k @ rigid


def _members(g: FrameGeometry):
    """Yield (end 1, end 2, bending matrix, axial stiffness, is_column) of every member.

    An end is (line, floor) with lines 0..3 and floors 0 (base) to 3.
    """
    for line in range(4):
        for floor in range(3):
            ground_interior = floor == 0 and line in (1, 2)
            section = g.interior_ground_column if ground_interior else g.column
            if floor == 0 and line == 2:
                bending = _released_column(section, g.storey, g.pin_offset, g.E, g.G)
            else:
                bending = bending_stiffness(section, g.storey, g.E, g.G)
            yield (line, floor), (line, floor + 1), bending, g.E * section.A / g.storey, True
    for bay in range(3):
        for floor in (1, 2, 3):
            section = g.interior_ground_beam if (bay, floor) == (1, 1) else g.beam
            bending = bending_stiffness(section, g.bay, g.E, g.G)
            yield (bay, floor), (bay + 1, floor), bending, 0.0, False


def _dofs_of(end: tuple[int, int]) -> tuple[int, int, int]:
    """Zero-based (x, y, rotation) DOFs of a node, -1 where a base is held."""
    line, floor = end
    if floor == 0:
        return -1, -1, {1: 36, 2: 37}.get(line, -1)
    node = 3 * line + floor - 1
    return node, 12 + node, 24 + node


def assemble_stiffness(geometry: FrameGeometry) -> np.ndarray:
    """(38, 38) stiffness before the diaphragms are applied [N/m, N, N m]."""
    K = np.zeros((N_DOF + 1, N_DOF + 1))  # the last row and column collect the held DOFs
    for end_1, end_2, bending, axial, is_column in _members(geometry):
        (x1, y1, r1), (x2, y2, r2) = _dofs_of(end_1), _dofs_of(end_2)
        # A column points up, so its transverse direction (to the left) is -x.
        transverse, sign = ((x1, x2), -1.0) if is_column else ((y1, y2), 1.0)
        dofs = [transverse[0], r1, transverse[1], r2]
        s = np.array([sign, 1.0, sign, 1.0])
        K[np.ix_(dofs, dofs)] += s[:, None] * bending * s
        along = [y1, y2] if is_column else [x1, x2]
        K[np.ix_(along, along)] += axial * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return K[:N_DOF, :N_DOF]


def diaphragm_map() -> np.ndarray:
    """(38, 29) map from the independent coordinates to all DOFs (rigid floors)."""
    T = np.zeros((N_DOF, N_FREE))
    for dof in range(1, N_DOF + 1):
        T[dof - 1, independent_coordinate(dof)] = 1.0
    return T


def rayleigh_coefficients(omega_1: float, omega_2: float, ratio: float) -> tuple[float, float]:
    """(a_0, a_1) of C = a_0 M + a_1 K with `ratio` of critical damping at two frequencies [rad/s].

    Chopra, Dynamics of Structures, eq. 11.4.10.
    """
    return 2 * ratio * omega_1 * omega_2 / (omega_1 + omega_2), 2 * ratio / (omega_1 + omega_2)


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
    K = T.T @ assemble_stiffness(geometry) @ T
    mass = np.zeros(N_FREE)
    mass[:3] = geometry.storey_mass
    mass[3:15] = np.ravel(geometry.vertical_mass)
    M = np.diag(mass)
    a_0, a_1 = rayleigh_coefficients(*damping_anchors, damping_ratio)
    influence = np.zeros(N_FREE)
    influence[:3] = 1.0
    return Structure(M=M, C=a_0 * M + a_1 * K, K=K, influence=influence)


def modes(structure: Structure) -> Modes:
    """Natural modes; the rotations, which carry no mass, are condensed statically (Table 1)."""
    mass = np.diag(structure.M)
    m, s = np.flatnonzero(mass > 0), np.flatnonzero(mass == 0)
    K = structure.K
    follow = -np.linalg.solve(K[np.ix_(s, s)], K[np.ix_(s, m)])
    K_condensed = K[np.ix_(m, m)] + K[np.ix_(m, s)] @ follow
    M = structure.M[np.ix_(m, m)]
    omega_2, phi = linalg.eigh(K_condensed, M)
    shape = np.zeros((mass.size, m.size))
    shape[m], shape[s] = phi, follow @ phi
    l = structure.influence[m]
    participation = phi.T @ M @ l
    return Modes(
        frequency=np.sqrt(omega_2) / (2 * np.pi),
        effective_mass=participation**2 / (l @ M @ l),
        shape=shape,
    )
