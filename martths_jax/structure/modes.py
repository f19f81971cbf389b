"""Natural modes of any second-order model, and static condensation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import linalg

#: Eigenvalues of a mass matrix scaled to a unit diagonal that count as none.
NO_MASS = 1e-12


def condense(K: np.ndarray, kept: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Static condensation of K d = f, f = 0 on whatever is not kept (Guyan 1965).

    Args:
        K: (n, n) stiffness.
        kept: k indices.

    Returns:
        (k, k) stiffness K_kk - K_ks K_ss^-1 K_sk, and the (n, k) recovery R of d = R d_k.
    """
    kept = np.asarray(kept, dtype=int)
    rest = np.setdiff1d(np.arange(K.shape[0]), kept)
    follow = -np.linalg.solve(K[np.ix_(rest, rest)], K[np.ix_(rest, kept)])
    R = np.zeros((K.shape[0], kept.size))
    R[kept, np.arange(kept.size)] = 1.0
    R[rest] = follow
    return K[np.ix_(kept, kept)] + K[np.ix_(kept, rest)] @ follow, R


def massive(M: np.ndarray) -> np.ndarray:
    """Indices of the coordinates that carry mass."""
    return np.flatnonzero(np.diag(M) > 0)


def natural_modes(M: np.ndarray, K: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Solutions of K phi = omega^2 M phi with finite omega, lowest first.

    Coordinates without mass are condensed; a mass matrix that is singular in another way (a mass on
    a combination of coordinates) gives as many modes as its rank.

    Args:
        M: (n, n) mass, semidefinite.
        K: (n, n) stiffness, definite.

    Returns:
        omega (k,) [rad/s] and phi (n, k) with phi' M phi = 1.
    """
    m = massive(M)
    K_m, R = condense(K, m)
    M_m = M[np.ix_(m, m)]
    scale = 1 / np.sqrt(np.diag(M_m))
    rank = int(np.count_nonzero(linalg.eigvalsh(M_m * np.outer(scale, scale)) > NO_MASS))
    if rank == m.size:
        omega_2, phi = linalg.eigh(K_m, M_m)
    else:  # the inverse problem M phi = omega^-2 K phi needs no regular mass
        inverse, phi = linalg.eigh(M_m, K_m)
        inverse, phi = inverse[::-1][:rank], phi[:, ::-1][:, :rank]
        omega_2, phi = 1 / inverse, phi / np.sqrt(inverse)
    rest = np.setdiff1d(np.arange(M.shape[0]), m)
    shape = np.zeros((M.shape[0], phi.shape[1]))
    shape[m], shape[rest] = phi, R[rest] @ phi
    return np.sqrt(omega_2), shape


def effective_masses(M: np.ndarray, phi: np.ndarray, influence: np.ndarray) -> np.ndarray:
    """(phi_n' M l)^2 of every mode [kg] (Chopra, eq. 13.2.9 with phi' M phi = 1).

    Args:
        M: (n, n) mass.
        phi: (n, k) mass-normalised modes.
        influence: (n,) motion l of the coordinates as the ground moves by one.

    Returns:
        (k,); over all modes they sum to l' M l.
    """
    m = massive(M)
    return (phi[m].T @ M[np.ix_(m, m)] @ influence[m]) ** 2
