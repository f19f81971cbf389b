"""Stiffness and mass of any planar frame, from its data, with degrees of freedom by name.

Supports take some of a frame's degrees of freedom out, constraints tie others (d = T q), and what
is left are the coordinates q of the model: M = T' M_free T, K = T' K_free T.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from martths_jax.errors import InputError, argument_error
from martths_jax.structure.constraints import resolve
from martths_jax.structure.modes import condense, effective_masses, massive, natural_modes
from martths_jax.structure.planar import DIRECTIONS, PlanarFrame
from martths_jax.text import nearest


def part_matrices(
    frame: PlanarFrame, members: Iterable[str], masses: Iterable[tuple[str, float]]
) -> tuple[np.ndarray, np.ndarray]:
    """K and M [SI] of a part of a frame on all its degrees of freedom, held ones included.

    Args:
        frame: the whole.
        members: names of the part's members.
        masses: its point masses as (degree of freedom or node, mass) pairs.
    """
    names = frame.dofs
    place = {name: i for i, name in enumerate(names)}
    K, M = np.zeros((len(names),) * 2), np.zeros((len(names),) * 2)
    for name in members:
        member = frame.members[name]
        k, m = frame.member_matrices(name)
        at = [place[f"{node}.{d}"] for node in (member.start, member.end) for d in DIRECTIONS]
        K[np.ix_(at, at)] += k
        M[np.ix_(at, at)] += m
    for name, mass in masses:
        for dof in [name] if name in place else [f"{name}.x", f"{name}.y"]:
            M[place[dof], place[dof]] += mass
    return K, M


def free_matrices(frame: PlanarFrame) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    """Names of the n degrees of freedom that no support holds, K (n, n) and M (n, n) [SI].

    Constraints do not count yet.
    """
    names = frame.dofs
    K, M = part_matrices(frame, frame.members, frame.masses.items())
    held = set(frame.held)
    free = [i for i, name in enumerate(names) if name not in held]
    return tuple(names[i] for i in free), K[np.ix_(free, free)], M[np.ix_(free, free)]


@dataclass(frozen=True)
class Assembly:
    """Matrices of a planar frame in its independent coordinates [SI].

    Attributes:
        dofs: names of the n degrees of freedom that no support holds.
        coordinates: names of the q of them that no constraint ties to others.
        T: (n, q) map of d = T q.
        M, K: (q, q) mass and stiffness.
        free_mass: (n, n) mass before the constraints.
    """

    dofs: tuple[str, ...]
    coordinates: tuple[str, ...]
    T: np.ndarray
    M: np.ndarray
    K: np.ndarray
    free_mass: np.ndarray

    def at(self, name: str) -> np.ndarray:
        """(q,) motion of a degree of freedom per coordinate, a row of T.

        Raises:
            InputError: if there is none of that name, or a support holds it.
        """
        if name not in self.dofs:
            raise argument_error(
                "name", "be a free degree of freedom", f"{name!r}: {nearest(name, self.dofs)}"
            )
        return self.T[self.dofs.index(name)]

    def rigid_motion(self, direction) -> np.ndarray:
        """(n,) motion of all degrees of freedom as the frame moves by one along a direction.

        Args:
            direction: "x", "y" or a vector (2,), of which only the direction counts.
        """
        x, y = _unit(direction)
        share = {"x": x, "y": y, "rotation": 0.0}
        return np.array([share[name.rsplit(".", 1)[1]] for name in self.dofs])

    def total_mass(self, direction) -> float:
        """Mass that moves along a direction [kg]; what supports hold does not count."""
        l = self.rigid_motion(direction)
        return float(l @ self.free_mass @ l)

    def influence(self, direction) -> np.ndarray:
        """(q,) l of M a + K q = -M l a_g for ground motion along a direction, see ``rigid_motion``.

        Constraints that do not let the frame move as a whole (a lever, say) leave the l that gives
        the same inertia forces; the total of the effective masses is then below the total mass.
        """
        rigid = self.rigid_motion(direction)
        l = rigid[[self.dofs.index(name) for name in self.coordinates]]
        if np.allclose(self.T @ l, rigid, rtol=0, atol=1e-12):
            return l
        m = massive(self.M)
        l = np.zeros(len(self.coordinates))
        force = self.T.T @ self.free_mass @ rigid
        l[m] = np.linalg.lstsq(self.M[np.ix_(m, m)], force[m], rcond=None)[0]
        return l

    def modes(self) -> FrameModes:
        """Natural modes, lowest first."""
        omega, phi = natural_modes(self.M, self.K)
        return FrameModes(assembly=self, omega=omega, phi=phi)

    def condensed(self) -> tuple[tuple[str, ...], np.ndarray, np.ndarray, np.ndarray]:
        """Coordinates with mass: their names, M and K (k, k), and the recovery R (q, k).

        All frequencies and modes stay: static condensation of massless coordinates is exact.
        """
        m = massive(self.M)
        K, R = condense(self.K, m)
        return tuple(self.coordinates[i] for i in m), self.M[np.ix_(m, m)], K, R


@dataclass(frozen=True)
class FrameModes:
    """Natural modes of an assembled frame, lowest first.

    Attributes:
        assembly: the frame.
        omega: (k,) circular frequencies [rad/s].
        phi: (q, k) mass-normalised modes in the independent coordinates.
    """

    assembly: Assembly
    omega: np.ndarray
    phi: np.ndarray

    @property
    def frequency(self) -> np.ndarray:
        """(k,) natural frequencies [Hz]."""
        return self.omega / (2 * np.pi)

    @property
    def shape(self) -> np.ndarray:
        """(n, k) modes on every degree of freedom that moves."""
        return self.assembly.T @ self.phi

    def effective_mass(self, direction) -> np.ndarray:
        """(k,) effective masses [kg] along "x", "y" or a vector; they sum to the total mass."""
        return effective_masses(self.assembly.M, self.phi, self.assembly.influence(direction))


def _unit(direction) -> np.ndarray:
    """(2,) unit vector of a direction."""
    named = {"x": (1.0, 0.0), "y": (0.0, 1.0)}
    try:
        given = np.asarray(
            named.get(direction) if isinstance(direction, str) else direction, dtype=float
        )
        good = given.shape == (2,) and np.all(np.isfinite(given)) and np.any(given != 0)
    except (TypeError, ValueError):
        good = False
    if not good:
        raise argument_error("direction", "be x, y or two numbers", repr(direction)[:80])
    return given / np.hypot(*given)


def assemble(frame: PlanarFrame) -> Assembly:
    """Mass and stiffness of a frame in its independent coordinates.

    Raises:
        InputError: if constraints contradict one another, the frame is a mechanism, or nothing in
            it has mass.
    """
    dofs, K, M = free_matrices(frame)
    T, coordinates = resolve(frame.constraints, dofs, frame.held)
    if not coordinates:
        raise InputError("The frame cannot move: supports hold every degree of freedom.")
    K_q, M_q = T.T @ K @ T, T.T @ M @ T
    check_definite(K_q, coordinates, np.diag(np.abs(T).T @ np.abs(K) @ np.abs(T)))
    if not massive(M_q).size:
        raise InputError(
            "The frame has no mass: give it point masses, a density or mass that members carry."
        )
    return Assembly(dofs=dofs, coordinates=coordinates, T=T, M=M_q, K=K_q, free_mass=M)


def check_definite(
    K: np.ndarray,
    names: Sequence[str],
    size: np.ndarray | None = None,
    what: str = "The frame",
) -> None:
    """Refuse a stiffness under which some motion meets no resistance, or a negative one.

    K is scaled to a unit diagonal first, so that translations and rotations weigh alike.

    Args:
        K: (q, q) symmetric.
        names: of its q coordinates.
        size: (q,) what its diagonal was summed from, in absolute values; a diagonal entry that is
            only round-off of it counts as zero.
        what: the stiffness is that of, at the start of a sentence.

    Raises:
        InputError: naming the coordinates of that motion.
    """
    diagonal = np.diag(K)
    size = np.abs(diagonal) if size is None else size
    none = 4 * np.finfo(float).eps * len(names)
    scale = np.sqrt(np.where(diagonal > none * size, diagonal, np.where(size > 0, size, 1.0)))
    values, vectors = linalg.eigh(K / np.outer(scale, scale))
    if not np.any(values < none):
        return
    negative = bool(np.any(values < -none))
    weak = vectors[:, values < (-none if negative else none)]
    moving = _moving(weak, scale, names)
    shown = ", ".join(moving[:8]) + (f" and {len(moving) - 8} more" if len(moving) > 8 else "")
    if negative:
        raise InputError(f"The stiffness is indefinite: it pushes the motion of {shown} on.")
    raise InputError(f"{what} is a mechanism: nothing resists the motion of {shown}.")


def _moving(vectors: np.ndarray, scale: np.ndarray, names: Sequence[str]) -> list[str]:
    """Names of the coordinates that take a real part in motions.

    Translations are held against translations, rotations against rotations: how long the frame is
    decides which of the two numbers is larger.

    Args:
        vectors: (q, k) motions, scaled.
        scale: (q,) that they were multiplied by.
    """
    scaled = np.sqrt(np.sum(vectors**2, axis=1))
    share = scaled / scale
    turns = np.array([name.endswith(".rotation") for name in names])
    part = np.zeros(len(names), dtype=bool)
    for kind in (turns, ~turns):
        if np.any(scaled[kind] > 1e-6 * scaled.max()):
            part |= kind & (share > 0.1 * share[kind].max())
    return [name for name, moves in zip(names, part, strict=True) if moves]
