"""What of a structure stands in the laboratory, and what is left of it to compute.

The laboratory part acts on the interface alone: its other degrees of freedom move freely there,
unless the laboratory holds them, and are condensed, R from the interface to all of them.  Its force
is f = M_L a + C_L v + K_L x with K_L = R' K R.  The numerical substructure is the reference minus
exactly that,

    M_N = M - E M_L E',    C_N = C - E C_L E',    K_N = K - E K_L E',

E from the interface to all degrees of freedom, so that both parts together are the reference.
Degrees of freedom that only the laboratory part has are condensed in the reference too, their
inertia as in the laboratory.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from martths_jax.errors import InputError
from martths_jax.structure.assembly import check_definite
from martths_jax.structure.modes import (
    NO_MASS,
    condense,
    effective_masses,
    massive,
    natural_modes,
)

#: Share of a matrix's entries below which a difference of two of them is none.
ROUND_OFF = 1e-9


@dataclass(frozen=True)
class SystemMatrices:
    """Second-order model M a + C v + K d = f on named degrees of freedom [SI].

    Attributes:
        dofs: names of the n degrees of freedom; those that end with ``.rotation`` turn.
        M, C, K: (n, n) mass, damping and stiffness.
        influence: (n,) their motion as the ground moves by one, r.
    """

    dofs: tuple[str, ...]
    M: np.ndarray
    C: np.ndarray
    K: np.ndarray
    influence: np.ndarray

    @property
    def frequency(self) -> np.ndarray:
        """(k,) natural frequencies [Hz], lowest first."""
        return natural_modes(self.M, self.K)[0] / (2 * np.pi)

    @property
    def effective_mass(self) -> np.ndarray:
        """(k,) effective masses [kg] in the direction of the ground motion."""
        return effective_masses(self.M, natural_modes(self.M, self.K)[1], self.influence)


@dataclass(frozen=True)
class Part:
    """Stiffness and mass of the laboratory part on degrees of freedom of its own [SI].

    Attributes:
        dofs: names of the p degrees of freedom.
        M, K: (p, p).
        C: (p, p) damping, None where it follows from the reference's.
    """

    dofs: tuple[str, ...]
    M: np.ndarray
    K: np.ndarray
    C: np.ndarray | None = None


@dataclass(frozen=True)
class Separation:
    """The reference on the degrees of freedom that stay, and the laboratory part at its interface.

    Attributes:
        kept: (k,) which of the reference's n degrees of freedom stay.
        R: (n, k) motion of all of them per motion of those, under static forces on those.
        R_mass: (n, k) the same for inertia: what only the laboratory part has follows the
            interface alone, as it does there.
        at: (b,) where the interface stands among the k.
        M, K: (b, b) of the laboratory part.
        C: (b, b) its damping, None where it has none of its own.
        own: names of what only the laboratory part has, condensed; with their mass.
        shared: names of what both parts have without an actuator.
    """

    kept: np.ndarray
    R: np.ndarray
    R_mass: np.ndarray
    at: np.ndarray
    M: np.ndarray
    K: np.ndarray
    C: np.ndarray | None
    own: tuple[tuple[str, float], ...]
    shared: tuple[str, ...]


def separate(
    dofs: Sequence[str],
    M: np.ndarray,
    K: np.ndarray,
    part: Part,
    interface: Sequence[str],
    held: Sequence[str] = (),
) -> Separation:
    """Condense the laboratory part to its interface, and what only it has out of the reference.

    Args:
        dofs: names of the reference's n degrees of freedom.
        M, K: (n, n) of the reference, laboratory part included.
        part: the laboratory part; it may have degrees of freedom that the reference lacks.
        interface: names of the b degrees of freedom that actuators move, all in `dofs`.
        held: names of what the laboratory holds fixed though it moves in the reference.

    Raises:
        InputError: if the laboratory part is loose with its interface held, or does not resist
            some degree of freedom of it.
    """
    n = len(dofs)
    names = [*dofs, *(name for name in part.dofs if name not in dofs)]
    b = np.array([names.index(name) for name in interface], dtype=int)
    K_L, M_L = _placed(part.K, part.dofs, names), _placed(part.M, part.dofs, names)
    reached = (np.diag(K_L) > 0) | (np.arange(len(names)) >= n)
    reached[b] = False
    reached[[i for i, name in enumerate(names) if name in held]] = False
    alone = np.arange(len(names)) >= n
    alone[:n] = _none_left(K, K_L[:n, :n]) & _none_left(M, M_L[:n, :n])
    own, shared = np.flatnonzero(reached & alone), np.flatnonzero(reached & ~alone)
    follow = np.concatenate([own, shared])
    if follow.size:
        what = "The laboratory part, its interface held,"
        check_definite(K_L[np.ix_(follow, follow)], [names[i] for i in follow], what=what)
    on = np.concatenate([b, follow])
    K_b, R = condense(K_L[np.ix_(on, on)], np.arange(b.size))
    _check_resists(K_b, np.diag(K_L)[b], interface)
    moved = R.copy()
    moved[b.size + own.size :] = 0.0  # the numerical part keeps the mass of what both have
    C = None
    if part.C is not None:
        C_L = _placed(part.C, part.dofs, names)[np.ix_(on, on)]
        C = _symmetric(R.T @ C_L @ R)
    kept = np.setdiff1d(np.arange(n), own)
    at = np.searchsorted(kept, b)
    R_mass = np.eye(n)[:, kept]
    inside = own < n
    R_mass[np.ix_(own[inside], at)] = R[b.size : b.size + own.size][inside]
    return Separation(
        kept=kept,
        R=condense(K, kept)[1],
        R_mass=R_mass,
        at=at,
        M=_symmetric(moved.T @ M_L[np.ix_(on, on)] @ moved),
        K=_symmetric(K_b),
        C=C,
        own=tuple((names[i], float(M_L[i, i])) for i in own),
        shared=tuple(names[i] for i in shared),
    )


def _placed(matrix: np.ndarray, dofs: Sequence[str], names: Sequence[str]) -> np.ndarray:
    """A matrix on some degrees of freedom, on all of them."""
    at = [names.index(name) for name in dofs]
    found = np.zeros((len(names),) * 2)
    found[np.ix_(at, at)] = matrix
    return found


def _none_left(whole: np.ndarray, part: np.ndarray) -> np.ndarray:
    """(n,) rows of which nothing is left as the part is taken out, but round-off."""
    left = np.max(np.abs(whole - part), axis=1, initial=0.0)
    return left <= ROUND_OFF * np.max(np.abs(whole), axis=1, initial=0.0)


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    return (matrix + matrix.T) / 2


def _check_resists(K: np.ndarray, before: np.ndarray, interface: Sequence[str]) -> None:
    """Refuse an interface whose motion meets no stiffness of the laboratory part."""
    loose = [
        name
        for name, k, size in zip(interface, np.diag(K), before, strict=True)
        if not k > ROUND_OFF * size
    ]
    if loose:
        several = len(loose) > 1
        raise InputError(
            f"The laboratory part has no stiffness at the interface degree"
            f"{'s' if several else ''} of freedom {', '.join(loose)}: take "
            f"{'them' if several else 'it'} out of `interface`, or put the members that resist "
            "there into `laboratory`."
        )


def condensed_influence(M: np.ndarray, r: np.ndarray, R: np.ndarray, kept) -> np.ndarray:
    """(k,) influence vector on what is kept, with the same forces R' M r.

    Args:
        M: (n, n) mass.
        r: (n,) influence vector.
        R: (n, k) motion of all degrees of freedom per motion of the kept ones.
        kept: (k,) indices.
    """
    force, M_k = R.T @ M @ r, R.T @ M @ R
    found = r[kept]
    if np.allclose(M_k @ found, force, rtol=1e-12, atol=1e-12 * np.max(np.abs(force), initial=0)):
        return found
    m = massive(M_k)
    found = np.zeros(len(found))
    found[m] = np.linalg.lstsq(M_k[np.ix_(m, m)], force[m], rcond=None)[0]
    return found


def remainder(reference: SystemMatrices, laboratory: SystemMatrices, at) -> SystemMatrices:
    """The reference without the laboratory part, which stands at the indices `at`.

    Raises:
        InputError: if the laboratory part takes more mass than there is, or leaves something that
            neither mass nor stiffness keeps.
    """
    M, C, K = reference.M.copy(), reference.C.copy(), reference.K.copy()
    square = np.ix_(at, at)
    M[square] -= laboratory.M
    C[square] -= laboratory.C
    K[square] -= laboratory.K
    for i in at:  # what is taken away whole leaves no mass of the size of round-off
        if abs(M[i, i]) <= NO_MASS * reference.M[i, i]:
            M[i], M[:, i] = 0.0, 0.0
    negative = negative_directions(M, reference.M, reference.dofs)
    if negative:
        raise InputError(
            f"The laboratory part has more mass than the reference in the motion of "
            f"{', '.join(negative)}: give those nodes the mass that is computed, or name less in "
            "`laboratory`."
        )
    if not negative_directions(K, reference.K, reference.dofs):
        # What has neither stiffness nor inertia is loose; the first mode weighs one by the other.
        inertia = natural_modes(reference.M, reference.K)[0][0] ** 2
        size = np.diag(reference.K + inertia * reference.M)
        check_definite(K + inertia * M, reference.dofs, size, what="The numerical substructure")
    return SystemMatrices(reference.dofs, M, C, K, reference.influence)


def negative_directions(matrix: np.ndarray, size: np.ndarray, dofs: Sequence[str]) -> list[str]:
    """Names of what takes part in a motion with a negative quadratic form; none where it has none.

    Args:
        matrix: (n, n) symmetric.
        size: (n, n) matrix whose diagonal says what counts as zero.
    """
    scale = np.sqrt(np.where(np.diag(size) > 0, np.diag(size), 1.0))
    values, vectors = linalg.eigh(matrix / np.outer(scale, scale))
    if not values.size or values[0] > -ROUND_OFF:
        return []
    share = np.abs(vectors[:, 0])
    return [name for name, part in zip(dofs, share, strict=True) if part > 0.3 * share.max()]
