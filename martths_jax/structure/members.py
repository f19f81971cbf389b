"""Planar beam-columns: nodes, materials and members, and a member's stiffness and mass.

A member runs from its start node to its end node.  Its own axes are u along it and v to the left
of it; rotations count counter-clockwise.  Both matrices stand on (u_1, v_1, r_1, u_2, v_2, r_2), in
global axes on (x_1, y_1, r_1, x_2, y_2, r_2) of the two nodes.

Between its two rigid ends a member bends and shears (Timoshenko).  With phi = 12 EI / (G A_s L^2),
L the length between the rigid ends, the deflection that end motions cause is a cubic, and stiffness
and consistent mass follow from the same shape functions (Friedman & Kosmatka 1993, Computers &
Structures 47(3)).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from martths_jax.errors import InputError, argument_error
from martths_jax.structure.sections import Section, check_positive

ENDS = ("start", "end")
#: How a member's mass is given to its nodes: not at all, half to each node's translations, or with
#: the shape functions of its stiffness.
MASSES = ("none", "lumped", "consistent")
ROTATION = {"start": 2, "end": 5}


@dataclass(frozen=True)
class Node:
    """A point of a planar frame.

    Attributes:
        x, y: place [m].
    """

    x: float
    y: float

    def __post_init__(self):
        for name in ("x", "y"):
            value = getattr(self, name)
            real = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
            if not (real and np.isfinite(value)):
                raise argument_error(name, "be a finite number (m)", repr(value)[:80])


@dataclass(frozen=True)
class Material:
    """What a member is made of.

    Attributes:
        E: Young's modulus [Pa].
        G: shear modulus [Pa].
        density: [kg/m^3]; zero where the members' own mass does not count.
    """

    E: float
    G: float
    density: float = 0.0

    def __post_init__(self):
        check_positive("E", self.E, "Pa")
        check_positive("G", self.G, "Pa")
        check_positive("density", self.density, "kg/m^3", zero=True)


@dataclass(frozen=True)
class Member:
    """A straight member between two nodes.

    Attributes:
        start, end: names of its nodes.
        section, material: names of its section and its material.
        rigid_start, rigid_end: lengths of its rigid ends, along it [m], that neither bend nor
            shear.
        rigid_axially: the rigid ends do not stretch either.  Otherwise the member stretches over
            its whole length, as in most frame programs.
        release: the ends ("start", "end") of its flexible part that carry no moment; with both, it
            is a bar.
        carried: mass per length that it carries besides its own [kg/m]; a load w [N/m] is w / g.
        mass: one of ``MASSES``; the mass per length, carried and own, counts from node to node.
        rotatory: with "consistent" mass, count the rotatory inertia of the section too.
    """

    start: str
    end: str
    section: str
    material: str
    rigid_start: float = 0.0
    rigid_end: float = 0.0
    rigid_axially: bool = False
    release: tuple[str, ...] = ()
    carried: float = 0.0
    mass: str = "lumped"
    rotatory: bool = False

    def __post_init__(self):
        check_positive("rigid_start", self.rigid_start, "m", zero=True)
        check_positive("rigid_end", self.rigid_end, "m", zero=True)
        check_positive("carried", self.carried, "kg/m", zero=True)
        for name in ("start", "end", "section", "material"):
            if not isinstance(getattr(self, name), str):
                raise argument_error(name, "be a name", repr(getattr(self, name))[:80])
        words = self.release if isinstance(self.release, (tuple, list)) else [None]
        if not all(word in ENDS for word in words):
            wanted = "be a list of no other words than start, end"
            raise argument_error("release", wanted, repr(self.release)[:80])
        if self.mass not in MASSES:
            raise argument_error("mass", f"be one of {', '.join(MASSES)}", repr(self.mass)[:80])
        if not isinstance(self.rotatory, bool) or not isinstance(self.rigid_axially, bool):
            name = "rigid_axially" if isinstance(self.rotatory, bool) else "rotatory"
            raise argument_error(name, "be True or False", repr(getattr(self, name))[:80])


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


def own_stiffness(
    member: Member, section: Section, material: Material, length: float
) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness between the ends of the flexible part, in the member's own axes.

    Args:
        length: distance of the nodes [m].

    Returns:
        k (6, 6) [N/m, N, N m] and the map R (6, 6) from end motions to end motions in which the
        released rotations follow the others, so that no moment acts on them.
    """
    k, R = np.zeros((6, 6)), np.eye(6)
    axial, bending = [0, 3], [1, 2, 4, 5]
    flexible = length - member.rigid_start - member.rigid_end
    stretched = flexible if member.rigid_axially else length
    along = material.E * section.A / stretched
    k[np.ix_(axial, axial)] = along * np.array([[1.0, -1.0], [-1.0, 1.0]])
    k[np.ix_(bending, bending)] = bending_stiffness(section, flexible, material.E, material.G)
    free = [ROTATION[end] for end in ENDS if end in member.release]
    kept = [i for i in range(6) if i not in free]
    if free:
        R[free] = 0.0
        R[np.ix_(free, kept)] = -np.linalg.solve(k[np.ix_(free, free)], k[np.ix_(free, kept)])
    if len(free) == 1:
        i = free[0]
        k = k - np.outer(k[:, i], k[i]) / k[i, i]
        k[i], k[:, i] = 0.0, 0.0
    elif free:  # a bar does not bend; the difference above would leave round-off
        k[bending], k[:, bending] = 0.0, 0.0
    return k, R


def rigid_ends(start: float, end: float) -> np.ndarray:
    """(6, 6) map from the nodes to the ends of the flexible part, rigid lengths [m] apart."""
    G = np.eye(6)
    G[1, 2], G[4, 5] = start, -end
    return G


def bending_shapes(section: Section, material: Material, length: float, z: float) -> np.ndarray:
    """(2, 6) deflection and rotation at z (0 to 1) of the flexible part, per end motion."""
    L = length
    phi = 12 * material.E * section.I / (material.G * section.A_s * L**2)
    deflection = [
        1 - 3 * z**2 + 2 * z**3 + phi * (1 - z),
        L * (z - 2 * z**2 + z**3 + phi / 2 * (z - z**2)),
        3 * z**2 - 2 * z**3 + phi * z,
        L * (z**3 - z**2 + phi / 2 * (z**2 - z)),
    ]
    rotation = [
        6 / L * (z**2 - z),
        1 - 4 * z + 3 * z**2 + phi * (1 - z),
        6 / L * (z - z**2),
        3 * z**2 - 2 * z + phi * z,
    ]
    N = np.zeros((2, 6))
    N[:, [1, 2, 4, 5]] = np.array([deflection, rotation]) / (1 + phi)
    return N


def own_mass(
    member: Member, section: Section, material: Material, length: float, R: np.ndarray
) -> np.ndarray:
    """(6, 6) mass between the nodes, in the member's own axes [kg, kg m, kg m^2].

    Consistent mass is the integral of N' diag(m, m, rho I) N along the member, N (3, 6) its motion
    (u, v, rotation) per motion of the nodes.

    Args:
        length: distance of the nodes [m].
        R: (6, 6) map of the releases, see ``own_stiffness``.
    """
    per_length = material.density * section.A + member.carried
    M = np.zeros((6, 6))
    if member.mass == "lumped":
        M[[0, 1, 3, 4], [0, 1, 3, 4]] = per_length * length / 2
    if member.mass != "consistent":
        return M
    weights = np.array([[per_length], [per_length], [0.0]])
    weights[2] = material.density * section.I if member.rotatory else 0.0
    a, b = member.rigid_start, member.rigid_end
    follow = R @ rigid_ends(a, b)

    def motion(x):
        N = np.zeros((3, 6))
        z = np.clip((x - a) / (length - a - b), 0, 1)
        share = z if member.rigid_axially else x / length
        N[0, [0, 3]] = 1 - share, share
        if x < a:
            N[1, 1], N[1:, 2] = 1.0, (x, 1.0)
        elif x > length - b:
            N[1, 4], N[1:, 5] = 1.0, (x - length, 1.0)
        else:
            N[1:] = bending_shapes(section, material, length - a - b, z) @ follow
        return N

    points, gauss = np.polynomial.legendre.leggauss(4)  # exact for the products of two cubics
    for first, last in ((0.0, a), (a, length - b), (length - b, length)):
        for point, weight in zip(points, gauss, strict=True):
            N = motion((first + last) / 2 + point * (last - first) / 2)
            M += weight * (last - first) / 2 * N.T @ (weights * N)
    return M


def turning(start: Node, end: Node) -> tuple[np.ndarray, float]:
    """(6, 6) map from global to a member's own axes, and the distance of its nodes [m].

    Raises:
        InputError: if the nodes stand at the same place.
    """
    dx, dy = end.x - start.x, end.y - start.y
    length = float(np.hypot(dx, dy))
    if not length > 0:
        raise InputError("has no length: both its nodes stand at the same place.")
    c, s = dx / length, dy / length
    turn = np.eye(6)
    for i in (0, 3):
        turn[i : i + 2, i : i + 2] = [[c, s], [-s, c]]
    return turn, length


def member_matrices(
    member: Member, section: Section, material: Material, start: Node, end: Node
) -> tuple[np.ndarray, np.ndarray]:
    """(K, M), each (6, 6), of a member on (x, y, rotation) of its start and its end node [SI].

    Raises:
        InputError: if nothing flexible is left of it.
    """
    turn, length = turning(start, end)
    flexible = length - member.rigid_start - member.rigid_end
    if not flexible > 0:
        raise InputError(
            f"has rigid ends of {member.rigid_start:g} m and {member.rigid_end:g} m, but its "
            f"nodes are {length:g} m apart."
        )
    k, R = own_stiffness(member, section, material, length)
    rigid = rigid_ends(member.rigid_start, member.rigid_end)
    k = rigid.T @ k @ rigid
    m = own_mass(member, section, material, length, R)
    return turn.T @ k @ turn, turn.T @ m @ turn
