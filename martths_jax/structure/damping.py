"""Classical damping matrices: Rayleigh, modal and Caughey."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from martths_jax.errors import InputError, argument_error, as_numbers, check_whole
from martths_jax.structure.modes import massive


def rayleigh_coefficients(omega_1: float, omega_2: float, ratio) -> tuple[float, float]:
    """(a_0, a_1) of C = a_0 M + a_1 K with `ratio` of critical damping at two frequencies [rad/s].

    Chopra, Dynamics of Structures, eq. 11.4.10; with a pair of ratios, one for each frequency, eq.
    11.4.9: a_0 / (2 omega_i) + a_1 omega_i / 2 = ratio_i.

    Raises:
        InputError: if a pair of ratios wants a negative coefficient, hence modes that gain energy.
    """
    if np.ndim(ratio) == 0:
        return 2 * ratio * omega_1 * omega_2 / (omega_1 + omega_2), 2 * ratio / (omega_1 + omega_2)
    first, second = ratio
    if omega_1 == omega_2:
        raise argument_error("omega_2", "differ from omega_1", omega_2)
    apart = omega_2**2 - omega_1**2
    a_0 = 2 * omega_1 * omega_2 * (first * omega_2 - second * omega_1) / apart
    a_1 = 2 * (second * omega_2 - first * omega_1) / apart
    if a_0 < 0 or a_1 < 0:
        raise InputError(
            f"Rayleigh damping cannot have the ratios {first:g} and {second:g} at {omega_1:g} and "
            f"{omega_2:g} rad/s: its {'mass' if a_0 < 0 else 'stiffness'} coefficient would be "
            "negative and some modes would gain energy."
        )
    return a_0, a_1


def rayleigh_damping(
    M: np.ndarray, K: np.ndarray, omega: np.ndarray, modes: tuple[int, int], ratio
) -> np.ndarray:
    """C = a_0 M + a_1 K with `ratio` of critical damping, one or a pair, in two modes.

    Args:
        M, K: (n, n) mass and stiffness.
        omega: (k,) circular frequencies of the modes [rad/s].
        modes: the two, counted from 1.
        ratio: see ``rayleigh_coefficients``.

    Raises:
        InputError: if there are no such modes, or no such damping.
    """
    for mode in modes:
        check_whole("modes", mode, 1, len(omega))
    first, second = (omega[mode - 1] for mode in modes)
    a_0, a_1 = rayleigh_coefficients(first, second, ratio)
    return a_0 * M + a_1 * K


def modal_damping(M: np.ndarray, omega: np.ndarray, phi: np.ndarray, ratios) -> np.ndarray:
    """C = M (sum 2 zeta_n omega_n phi_n phi_n') M with phi' M phi = 1 (Chopra, eq. 11.4.19).

    Args:
        M: (n, n) mass.
        omega: (k,) circular frequencies [rad/s]; modes that are left out are not damped.
        phi: (n, k) mass-normalised modes.
        ratios: shares of critical damping, one for all modes or (k,).

    Raises:
        InputError: if the ratios are neither, or negative.
    """
    ratios = as_numbers(ratios)
    if ratios.shape not in ((), np.shape(omega)) or not np.all(ratios >= 0):
        wanted = f"be one or {np.size(omega)} numbers of at least zero"
        raise argument_error("ratios", wanted, repr(ratios.tolist())[:80])
    return M @ phi @ np.diag(2 * ratios * omega) @ phi.T @ M


def caughey_coefficients(omega, ratios, powers: Sequence[int] | None = None) -> np.ndarray:
    """a_b of zeta_n = 1/2 sum_b a_b omega_n^(2b - 1) (Chopra, eq. 11.4.15).

    Args:
        omega: (k,) different circular frequencies [rad/s].
        ratios: (k,) shares of critical damping there, or one for all.
        powers: k exponents b, 0 to k - 1 by default; (0, 1) is Rayleigh damping.

    Raises:
        InputError: if frequencies, ratios and powers do not fit one another.
    """
    omega, ratios = as_numbers(omega), as_numbers(ratios)
    if omega.ndim != 1 or not np.all(omega > 0) or np.unique(omega).size != omega.size:
        wanted = "be different numbers above zero (rad/s)"
        raise argument_error("omega", wanted, repr(omega.tolist())[:80])
    if ratios.shape not in ((), omega.shape) or not np.all(ratios >= 0):
        wanted = f"be one or {omega.size} numbers of at least zero"
        raise argument_error("ratios", wanted, repr(ratios.tolist())[:80])
    powers = np.arange(omega.size) if powers is None else np.asarray(powers)
    if powers.shape != omega.shape or np.unique(powers).size != powers.size:
        wanted = f"be {omega.size} different whole numbers, one a frequency"
        raise argument_error("powers", wanted, powers.tolist())
    # In units of the frequencies' geometric mean the columns are of one size.
    unit = np.exp(np.mean(np.log(omega)))
    system = (omega[:, None] / unit) ** (2.0 * powers - 1)
    scaled = np.linalg.solve(system, 2 * np.broadcast_to(ratios, omega.shape))
    return scaled * unit ** -(2.0 * powers - 1)


def caughey_damping(
    M: np.ndarray, K: np.ndarray, coefficients, powers: Sequence[int] | None = None
) -> np.ndarray:
    """C = M sum_b a_b (M^-1 K)^b (Chopra, eq. 11.4.13), negative b included.

    Args:
        M, K: (n, n) mass and stiffness.
        coefficients: a_b as ``caughey_coefficients`` gives them.
        powers: their exponents b, 0, 1, 2 ... by default.

    Raises:
        InputError: if a power above one meets coordinates without mass.
    """
    powers = range(len(coefficients)) if powers is None else powers
    if max(powers) > 1 and massive(M).size < M.shape[0]:
        raise InputError(
            f"A Caughey series up to the power {max(powers)} needs mass on every coordinate: "
            "condense those without mass first."
        )
    C = np.zeros(M.shape)
    for a, b in zip(coefficients, powers, strict=True):
        term = M if b <= 0 else K
        step = (K, M) if b > 0 else (M, K)
        for _ in range(abs(b) - (b > 0)):  # M (M^-1 K)^b = K (M^-1 K)^(b-1) = M (K^-1 M)^-b
            term = step[0] @ np.linalg.solve(step[1], term)
        C = C + a * term
    return (C + C.T) / 2
