"""Roots of many real polynomials at once, near those of a nominal one, with exact derivatives.

    p(s) = c_0 s^n + c_1 s^(n-1) + ... + c_n

All roots are improved together by Aberth's method (Aberth 1973, Mathematics of Computation 27),

    s_k <- s_k - N_k / (1 - N_k sum_(l != k) 1 / (s_k - s_l)),   N_k = p(s_k) / p'(s_k),

a fixed number of times: plain vector arithmetic over the batch, where an eigenvalue solver would
be one small library call a trial.  Real roots stay real and pairs stay conjugate, as the nominal
polynomial has them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.errors import argument_error, as_numbers

#: Steps of Aberth's method, which triples the digits of simple roots with each near the end.
ITERATIONS = 24
#: |p(s)| as a share of sum_k |c_k s^(n-k)|, under which s counts as a root.
RESIDUAL = 1e-10

_mixing = jax.numpy_dtype_promotion("standard")  # real and complex roots are combined


class Roots(NamedTuple):
    """Roots of a real polynomial: the real ones, and of each pair the one above the real axis.

    Attributes:
        real: (T,) arrays or numbers.
        upper: (T,) complex arrays or complex numbers.
    """

    real: tuple[Any, ...] = ()
    upper: tuple[Any, ...] = ()

    def __add__(self, other: Roots) -> Roots:
        return Roots(self.real + other.real, self.upper + other.upper)

    def __len__(self) -> int:
        """Number of roots."""
        return len(self.real) + 2 * len(self.upper)

    def stacked(self) -> np.ndarray:
        """(n, ...) all roots on the host: real ones, then pair by pair."""
        pairs = [y for x in self.upper for y in (np.asarray(x), np.conj(np.asarray(x)))]
        return np.array([*map(np.asarray, self.real), *pairs], dtype=complex)


def nominal_roots(coefficients) -> Roots:
    """Roots of one polynomial, the slowest first (host).

    Args:
        coefficients: (n + 1,) real, the highest power first.

    Raises:
        InputError: for coefficients that are not finite, or a highest one of zero.
    """
    c = as_numbers(coefficients)
    if c.ndim != 1 or c.size == 0 or not np.all(np.isfinite(c)) or c[0] == 0:
        raise argument_error(
            "coefficients", "be finite numbers, the first (of the highest power) not zero",
            repr(coefficients)[:80],
        )  # fmt: skip
    found = sorted(np.roots(c).tolist(), key=abs)
    real = tuple(float(s.real) for s in found if np.imag(s) == 0)
    return Roots(real, tuple(complex(s) for s in found if np.imag(s) > 0))


def horner(coefficients: Sequence, s):
    """p(s) of coefficients (T,) or numbers, the highest power first; s of their shape."""
    value = coefficients[0] * s**0
    for c in coefficients[1:]:
        value = value * s + c
    return value


def with_slope(coefficients: Sequence, s):
    """p(s) and p'(s), as ``horner``."""
    value, slope = coefficients[0], 0 * s
    for c in coefficients[1:]:
        slope = slope * s + value
        value = value * s + c
    return value, slope


@_mixing
def roots(coefficients, start: Roots, iterations: int = ITERATIONS) -> Roots:
    """Roots of a batch of polynomials whose roots are of the same kinds as those of `start`.

    Two more steps of Newton's method from the found roots, seen as constants, give derivatives
    with respect to the coefficients that are exact up to the third.

    Args:
        coefficients: (T, n + 1) real, the highest power first; NumPy's are worked on by NumPy.
        start: n distinct numbers to begin with, ``nominal_roots`` of the nominal polynomial.
        iterations: steps of Aberth's method.

    Returns:
        n roots, as arrays (T,), in the order of `start`, but for roots that pass each other.  What
        ``is_root`` refuses has roots of other kinds than `start`, or equal ones.
    """
    xp = np if isinstance(coefficients, np.ndarray) else jnp
    c = [coefficients[:, k] for k in range(coefficients.shape[1])]
    begin = jax.tree.map(lambda s: xp.full(c[0].shape, s), start)
    if xp is np:
        with np.errstate(all="ignore"):  # roots of other kinds; see ``is_root``
            found = begin
            for _ in range(iterations):
                before, found = found, _aberth(c, found)
                if np.allclose(before.stacked(), found.stacked(), rtol=1e-14, atol=0):
                    break
            return found
    still = [jax.lax.stop_gradient(x) for x in c]
    found = jax.lax.fori_loop(0, iterations, lambda _, s: _aberth(still, s), begin)
    found = jax.tree.map(jax.lax.stop_gradient, found)
    return _newton(c, _newton(c, found))


def _aberth(c: Sequence, s: Roots) -> Roots:
    """One step of Aberth's method for all roots at once."""

    def improved(x, push):
        value, slope = with_slope(c, x)
        newton = value / slope
        return x - newton / (1 - newton * push)

    def push(x, others):
        return sum((1 / (x - y) for y in others), 0.0)

    real, upper = [], []
    for k, x in enumerate(s.real):
        pairs = 2 * sum(((1 / (x - y)).real for y in s.upper), 0.0)
        real.append(improved(x, push(x, s.real[:k] + s.real[k + 1 :]) + pairs))
    for k, x in enumerate(s.upper):
        others = (*s.real, *s.upper[:k], *s.upper[k + 1 :], *(y.conj() for y in s.upper))
        upper.append(improved(x, push(x, others)))
    return Roots(tuple(real), tuple(upper))


def _newton(c: Sequence, s: Roots) -> Roots:
    """One step of Newton's method for every root."""

    def improved(x):
        value, slope = with_slope(c, x)
        return x - value / slope

    return jax.tree.map(improved, s)


def is_root(coefficients: np.ndarray, found: Roots) -> np.ndarray:
    """(T,) whether all that ``roots`` found for (T, n + 1) coefficients are roots (host).

    Those of a polynomial with roots of other kinds than the nominal one are not.
    """
    c, s = np.asarray(coefficients).T, found.stacked()
    with np.errstate(all="ignore"):
        value = horner([x[None] for x in c], s)
        size = horner([np.abs(x)[None] for x in c], np.abs(s))
        return np.all(np.abs(value) <= RESIDUAL * size, axis=0)
