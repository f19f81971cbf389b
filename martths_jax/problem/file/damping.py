"""Damping as a table of a problem file says it: Rayleigh, modal, Caughey or none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from martths_jax.errors import InputError
from martths_jax.problem.file.table import Table
from martths_jax.structure.damping import (
    caughey_coefficients,
    caughey_damping,
    modal_damping,
    rayleigh_coefficients,
)
from martths_jax.structure.modes import condense, massive, natural_modes
from martths_jax.text import counted

KINDS = ("rayleigh", "modal", "caughey", "none")
KEYS = ("ratio", "modes", "omega", "a_0", "a_1")


@dataclass(frozen=True)
class Damping:
    """A rule that makes a damping matrix of a mass and a stiffness.

    Attributes:
        kind: one of ``KINDS``.
        matrix: (M, K) -> C.
        coefficients: (M, K) -> (a_0, a_1) of C = a_0 M + a_1 K; None where C has another form.
    """

    kind: str
    matrix: Callable[[np.ndarray, np.ndarray], np.ndarray]
    coefficients: Callable[[np.ndarray, np.ndarray], tuple[float, float]] | None = None


def read_damping(table: Table) -> Damping | None:
    """The rule of a table; None where something in it is wrong."""
    kind = table.text("kind", KINDS)
    if kind is None:
        _ = [key in table for key in KEYS]  # which of them count is not known
        return None
    if kind == "none":
        return _rayleigh(lambda M, K: (0.0, 0.0), kind)
    if kind == "rayleigh":
        return _read_rayleigh(table)
    ratio = table.one_or_more("ratio")
    modes = _modes(table) if kind == "caughey" else None
    if ratio is None or (kind == "caughey" and modes is None):
        return None
    if kind == "modal":
        return Damping(kind, lambda M, K: _modal(M, K, ratio))
    if isinstance(ratio, list) and len(ratio) != len(modes):
        table.wrong("ratio", f"be one number or {len(modes)}, one for each of `modes`")
        return None
    return Damping(kind, lambda M, K: _caughey(M, K, modes, ratio))


def _modes(table: Table, count: int | None = None) -> tuple[int, ...] | None:
    """Numbers of modes, counted from 1."""
    given = table.numbers("modes", count=count)
    whole = all(float(v).is_integer() and v >= 1 for v in given) and len(set(given)) == len(given)
    if given and not whole:
        table.wrong("modes", "be a list of different whole numbers, counted from 1")
    return tuple(map(int, given)) if given and whole else None


def _rayleigh(coefficients, kind: str = "rayleigh") -> Damping:
    def matrix(M, K):
        a_0, a_1 = coefficients(M, K)
        return a_0 * M + a_1 * K

    return Damping(kind, matrix, coefficients)


def _read_rayleigh(table: Table) -> Damping | None:
    """By two coefficients, or by ratios in two modes or at two circular frequencies."""
    ways = [way for way in ("a_0", "modes", "omega") if way in table]
    if len(ways) != 1:
        _ = [key in table for key in KEYS]
        table.fault(
            None,
            "Rayleigh damping needs one of: `a_0` and `a_1`, or `modes` and `ratio`, or `omega` "
            "and `ratio`.",
        )
        return None
    if ways == ["a_0"]:
        a_0, a_1 = table.number("a_0", "1/s", least=0), table.number("a_1", "s", least=0)
        return _rayleigh(lambda M, K: (a_0, a_1))
    ratio = table.one_or_more("ratio")
    if isinstance(ratio, list) and len(ratio) != 2:
        table.wrong("ratio", "be one number or two")
        ratio = None
    if ways == ["omega"]:
        omega = table.numbers("omega", "rad/s", 2)
        good = len(omega) == 2 and min(omega) > 0 and omega[0] != omega[1]
        if omega and not good:
            table.wrong("omega", "be two different numbers above zero (rad/s)")
        if ratio is None or not good:
            return None
        return _rayleigh(lambda M, K: rayleigh_coefficients(*omega, ratio))
    modes = _modes(table, 2)
    if ratio is None or modes is None:
        return None
    return _rayleigh(lambda M, K: rayleigh_coefficients(*_frequencies(M, K, modes), ratio))


def _natural(M: np.ndarray, K: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Circular frequencies and modes, none where nothing has mass."""
    if not massive(M).size:
        return np.zeros(0), np.zeros((len(M), 0))
    return natural_modes(M, K)


def _frequencies(M: np.ndarray, K: np.ndarray, modes: tuple[int, ...]) -> np.ndarray:
    """Circular frequencies of modes [rad/s].

    Raises:
        InputError: if there are fewer.
    """
    omega = _natural(M, K)[0]
    if max(modes) > omega.size:
        raise InputError(
            f"The damping names mode {max(modes)}, but there are {counted(omega.size, 'mode')}: "
            "name others."
        )
    return omega[np.array(modes) - 1]


def _modal(M: np.ndarray, K: np.ndarray, ratio) -> np.ndarray:
    """Modal damping; a list of ratios is for the first modes, the others are not damped."""
    omega, phi = _natural(M, K)
    if isinstance(ratio, list):
        _frequencies(M, K, (len(ratio),))
        omega, phi = omega[: len(ratio)], phi[:, : len(ratio)]
    return modal_damping(M, omega, phi, ratio)


def _caughey(M: np.ndarray, K: np.ndarray, modes: tuple[int, ...], ratio) -> np.ndarray:
    """Caughey series with the powers 0, 1, 2 ... that has the ratios in as many modes.

    Coordinates without mass are condensed, so that no damping acts on them.
    """
    omega = _frequencies(M, K, modes)
    m = massive(M)
    heavy = np.ix_(m, m)
    C = np.zeros_like(M)
    C[heavy] = caughey_damping(M[heavy], condense(K, m)[0], caughey_coefficients(omega, ratio))
    return C
