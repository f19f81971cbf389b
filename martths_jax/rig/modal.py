"""Partial fractions of transfer functions with simple poles, and their zero-order hold.

    H_ij(s) = N_ij(s) / (d_ij prod_k (s - p_k)) = sum_k r_ij,k / (s - p_k),
    r_ij,k = N_ij(p_k) / (d_ij prod_(l != k) (p_k - p_l)),   i = output, j = input

Every pole is one state z' = p z + u of the input whose column it stands in, and y_i sums r z, so
that a gain designed for the continuous states holds for the sampled ones: z(k+1) = exp(p dt) z(k)
+ (exp(p dt) - 1) / p u(k).  Entries of a column that name the same pole share its state.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.rig.polynomial import Roots, is_root
from martths_jax.structure.modal import ModalSystem

#: Poles nearer to each other, as a share of the larger one, count as equal.
NEAR = 1e-6
#: The same for a nominal plant's, where they are roots of a polynomial: round-off sets two equal
#: ones apart by its square root, three by its third root.
NEAR_ROOTS = 1e-4
HZ = 2 * np.pi  # rad/s per Hz

mixing = jax.numpy_dtype_promotion("standard")  # real and complex poles are combined


class Entry(NamedTuple):
    """One transfer function of a batch of plants.

    Attributes:
        numerator: N(s), for s (T,) or a number.
        degree: of N.
        lead: d, (T,) or a number.
        poles: p [rad/s].
        names: of the poles, in the order real, upper; equal names in a column share a state.
        denominator: coefficients (T,) that the poles are the roots of, the highest power first;
            None where they are described one by one.
    """

    numerator: Callable[[Any], Any]
    degree: int
    lead: Any
    poles: Roots
    names: tuple
    denominator: Sequence | None = None


class Mode(NamedTuple):
    """One state z' = p z + sum_j w_j u_j, of whose real parts y_i = sum c_i z (2 Re of a pair's).

    Attributes:
        pole: (T,) p [rad/s]; complex for a pair, whose upper pole it is.
        inputs: one w for each input, (T,) or a number.
        outputs: one c for each output, (T,) or a number.
    """

    pole: Any
    inputs: tuple
    outputs: tuple


Matrix = Sequence[Sequence[Entry | None]]


def product(roots: Roots, s):
    """prod (s - root) over all roots, real for real s (T,) or a number."""
    value = 1.0
    for r in roots.real:
        value = value * (s - r)
    for u in roots.upper:
        pair = (s - u) * (s - u.conj())
        value = value * (pair if np.iscomplexobj(s) else pair.real)
    return value


def value_at(entry: Entry, s):
    """H(s) of an entry."""
    return entry.numerator(s) / (entry.lead * product(entry.poles, s))


def residues(entry: Entry) -> list:
    """(T,) residues of an entry at its poles: real ones, then of the upper poles of its pairs."""
    found = []
    real, upper = entry.poles
    for k, p in enumerate(real):
        others = product(Roots(real[:k] + real[k + 1 :], upper), p)
        found.append(entry.numerator(p) / (entry.lead * others))
    for k, p in enumerate(upper):
        others = product(Roots(real, upper[:k] + upper[k + 1 :]), p) * (p - p.conj())
        found.append(entry.numerator(p) / (entry.lead * others))
    return found


def column_modes(column: Sequence[Entry | None], j: int, inputs: int) -> list[Mode]:
    """Modes of input j: the poles of its entries, one for each output."""
    poles, outputs = {}, []
    for entry in column:
        share = {}
        if entry is not None:
            share = dict(zip(entry.names, residues(entry), strict=True))
            named = zip(entry.names, entry.poles.real + entry.poles.upper, strict=True)
            poles = dict(named) | poles
        outputs.append(share)
    into = tuple(float(j == i) for i in range(inputs))
    order = dict.fromkeys(name for share in outputs for name in share)
    return [
        Mode(poles[name], into, tuple(share.get(name, 0.0) for share in outputs)) for name in order
    ]


def joint_modes(matrix: Matrix, strongest: Sequence[tuple[int, int]]) -> list[Mode]:
    """Modes of a system whose inputs all drive the same poles, as those of a state space do.

    The residues of all entries at a simple pole are a matrix of rank one, the column that the
    outputs see times the row that the inputs drive it by.

    Args:
        matrix: entries with the same poles.
        strongest: for each pole the entry (i, j) that row and column are taken from; the row is
            scaled to one at input j.
    """
    all_residues = [[residues(entry) for entry in row] for row in matrix]
    poles = matrix[0][0].poles
    modes = []
    for k, (pole, (r, q)) in enumerate(zip(poles.real + poles.upper, strongest, strict=True)):
        row = [entry[k] for entry in all_residues[r]]
        into = tuple(1.0 if j == q else x / row[q] for j, x in enumerate(row))
        modes.append(Mode(pole, into, tuple(line[q][k] for line in all_residues)))
    return modes


def _slots(modes: Sequence[Mode]) -> Iterator[tuple[Mode, ...]]:
    """Slots of two states: real poles two by two, then the pairs.

    A real pole that is left over has a shadow of its own, which nothing drives and nobody sees.
    """
    real = [mode for mode in modes if not np.iscomplexobj(mode.pole)]
    if len(real) % 2:
        last = real[-1]
        real.append(Mode(last.pole, (0.0,) * len(last.inputs), (0.0,) * len(last.outputs)))
    yield from zip(real[::2], real[1::2], strict=True)
    yield from ((mode,) for mode in modes if np.iscomplexobj(mode.pole))


def _assembled(groups: Sequence[Sequence[Mode]], trials: int, hold, xp) -> ModalSystem:
    """Modes in slots, group by group.

    Args:
        hold: gives a pole's multiplier of the state and of the inputs.
    """
    a, b, B, C = [], [], [], []
    for slot in (slot for group in groups for slot in _slots(group)):
        if len(slot) == 1:
            (mode,) = slot
            own, push = hold(mode.pole)
            driven = [push * w for w in mode.inputs]
            a.append([own.real, own.real])
            b.append([-own.imag, own.imag])
            B.append([[x.real for x in driven], [x.imag for x in driven]])
            C.append(
                [[2 * xp.real(c) for c in mode.outputs], [-2 * xp.imag(c) for c in mode.outputs]]
            )
        else:
            held = [hold(mode.pole) for mode in slot]
            a.append([own for own, _ in held])
            b.append([0.0, 0.0])
            B.append([[h[1] * w for w in m.inputs] for h, m in zip(held, slot, strict=True)])
            C.append([list(mode.outputs) for mode in slot])

    def stacked(nested):
        if isinstance(nested, list):
            return xp.stack([stacked(x) for x in nested])
        return xp.broadcast_to(xp.asarray(nested, dtype=float), (trials,))

    a, b, B, C = (stacked(x) for x in (a, b, B, C))
    turned = lambda x: xp.swapaxes(x, 0, 1)  # noqa: E731
    return ModalSystem(a=turned(a), b=turned(b), B=turned(B), C=xp.moveaxis(C, 2, 0).swapaxes(1, 2))


@mixing
def discretise(groups: Sequence[Sequence[Mode]], dt, trials: int) -> ModalSystem:
    """Zero-order hold at `dt` [s] of `trials` plants, whose poles stand in slots group by group."""

    def hold(p):
        grown = jnp.expm1(p * dt)
        return grown + 1, grown / p

    return _assembled(groups, trials, hold, jnp)


def continuous(groups: Sequence[Sequence[Mode]]) -> ModalSystem:
    """The continuous system of one plant in the slots of ``discretise`` (host, NumPy)."""
    return _assembled(groups, 1, lambda p: (p, np.ones_like(p)), np)


def first_problem(matrix: Matrix, nominal: bool = False) -> tuple[int, str] | None:
    """The first plant of a batch that has no stable modal form (host).

    Args:
        nominal: it is the nominal plant.

    Returns:
        its row, and what is wrong with which entry and pole; None where all is well.
    """
    for i, row in enumerate(matrix):
        for j, entry in enumerate(row):
            near = NEAR_ROOTS if nominal and entry and entry.denominator is not None else NEAR
            found = None if entry is None else _problem(entry, near)
            if found:
                return found[0], f"entry ({i + 1}, {j + 1}) {found[1]}"
    return None


def _problem(entry: Entry, nearest: float) -> tuple[int, str] | None:
    if entry.degree >= len(entry.poles):
        return 0, (
            f"is improper: its numerator is of degree {entry.degree}, its denominator of degree "
            f"{len(entry.poles)}, which must be larger"
        )
    poles = entry.poles.stacked()
    poles = np.broadcast_to(poles.reshape(len(poles), -1), (len(poles), _trials(entry)))
    lost = ~np.all(np.isfinite(poles), axis=0)
    if entry.denominator is not None:
        c = [np.broadcast_to(np.asarray(c), lost.shape) for c in entry.denominator]
        lost |= ~is_root(np.stack(c, axis=1), entry.poles)
    if np.any(lost):
        return int(np.argmax(lost)), "has other numbers of real poles and of pairs than nominal"
    unstable = np.argwhere(poles.real.T >= 0)
    if unstable.size:
        at, k = unstable[0]
        return int(at), f"has an unstable pole, {_hertz(poles[k, at])}"
    for k in range(len(poles)):
        for l in range(k):
            larger = np.maximum(np.abs(poles[k]), np.abs(poles[l]))
            near = np.abs(poles[k] - poles[l]) <= nearest * larger
            if np.any(near):
                at = int(np.argmax(near))
                both = f"{_hertz(poles[l, at])} and {_hertz(poles[k, at])}"
                return at, f"has nearly equal poles, {both}, and so no modal form"
    with np.errstate(all="ignore"):
        gain = np.asarray(value_at(entry, 0.0)) + 0 * lost
    if not np.all(np.isfinite(gain)):
        return int(np.argmin(np.isfinite(gain))), "has no finite static gain"
    return None


def _trials(entry: Entry) -> int:
    return max((np.size(p) for p in entry.poles.real + entry.poles.upper), default=1)


def _hertz(pole: complex) -> str:
    """A pole in Hz, in words."""
    f = pole / HZ
    return f"{f.real:.6g} Hz" if f.imag == 0 else f"{f.real:.6g}{f.imag:+.6g}j Hz"


def fastest(matrix: Matrix) -> float:
    """Largest magnitude of a pole [rad/s] (host)."""
    entries = [entry for row in matrix for entry in row if entry is not None]
    return max((float(np.max(np.abs(e.poles.stacked()))) for e in entries), default=0.0)
