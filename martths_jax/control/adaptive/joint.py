"""Kalman filters of a stroke and of the parameters that it moves by, together.

The state is xi = (x, d, theta): stroke, its last rise and n parameters on a random walk,

    d(k+1) = f(x, d, theta) + w,   x(k+1) = x(k) + d(k+1),   theta(k+1) = theta(k) + v,
    y(k) = x(k) + noise,

linear but for f.  The measurement is one number of the state, so that both filters correct alike;
they differ in what they make of f.  Extended: f by its derivatives.  Unscented: f at 2 L + 1 points
of the same mean and covariance, L = n + 2, scaled by alpha, beta, kappa (Julier & Uhlmann 2004; Wan
& van der Merwe 2000).

P is held as the rows of its upper triangle; a "number" is an array over trials.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp

from martths_jax.once import once

Numbers = tuple[jax.Array, ...]
Triangle = tuple[Numbers, ...]
#: x and d before the parameters.
MOVING = 2


def entry(P: Triangle, i: int, j: int) -> jax.Array:
    """P_ij."""
    return P[min(i, j)][abs(i - j)]


def correct(xi: Numbers, P: Triangle, y: jax.Array, r) -> tuple[Numbers, Triangle]:
    """xi and P after a measurement y of x with noise of variance r."""
    n = len(xi)
    inverse = 1.0 / (P[0][0] + r)
    gain = [p * inverse for p in P[0]]
    error = y - xi[0]
    after = tuple(x + g * error for x, g in zip(xi, gain, strict=True))
    left = tuple(tuple(P[i][j - i] - gain[i] * P[0][j] for j in range(i, n)) for i in range(n))
    return after, left


def extended(
    rise: jax.Array, slopes: Numbers, xi: Numbers, P: Triangle
) -> tuple[Numbers, Triangle]:
    """xi and P one sample later, with f taken as linear about xi and without the noise's share.

    Args:
        rise: f(xi).
        slopes: its derivatives by each number of xi.
        xi, P: mean and covariance.
    """
    n = len(xi)
    with_each = [sum(slopes[m] * entry(P, m, j) for m in range(n)) for j in range(n)]
    own = sum(a * b for a, b in zip(slopes, with_each, strict=True))
    return _moved(xi, P, rise, with_each, own)


def unscented(
    f: Callable[[Numbers], jax.Array],
    xi: Numbers,
    P: Triangle,
    alpha,
    beta: float = 2.0,
    kappa: float = 0.0,
) -> tuple[Numbers, Triangle]:
    """The same from f at sigma points.

    Args:
        f: rise of x within the sample, of numbers like xi.
        xi, P: mean and covariance.
        alpha: how far the points lie, sqrt(alpha^2 (L + kappa)) standard deviations.
        beta: further weight of the middle point in covariances; 2 for a normal distribution.
        kappa: see alpha.
    """
    n = len(xi)
    reach = alpha**2 * (n + kappa)
    columns = cholesky(P)
    middle = f(xi)
    sides = []  # f at both points of each column, less that in the middle
    for j, column in enumerate(columns):
        away = [reach**0.5 * c for c in (jnp.zeros_like(middle),) * j + column]
        up = f(tuple(x + a for x, a in zip(xi, away, strict=True))) - middle
        down = f(tuple(x - a for x, a in zip(xi, away, strict=True))) - middle
        sides.append((up, down))
    side = 1.0 / (2 * reach)
    shift = side * sum(up + down for up, down in sides)
    # About the middle the middle itself adds nothing, whatever its weight in a mean is.
    squares = side * sum(up**2 + down**2 for up, down in sides)
    own = squares - shift**2 + (1.0 - alpha**2 + beta) * shift**2
    half = [(up - down) * (side * reach**0.5) for up, down in sides]
    with_each = [sum(half[j] * columns[j][i - j] for j in range(i + 1)) for i in range(n)]
    return _moved(xi, P, middle + shift, with_each, own)


def _moved(xi, P, rise, with_each, own) -> tuple[Numbers, Triangle]:
    """Mean and covariance after the rise.

    Args:
        xi, P: before it.
        rise: its mean.
        with_each: its covariance with each number of xi.
        own: its variance.
    """
    n = len(xi)
    first = (
        P[0][0] + 2.0 * with_each[0] + own,
        with_each[0] + own,
        *(P[0][j] + with_each[j] for j in range(MOVING, n)),
    )
    second = (own, *with_each[MOVING:])
    return (xi[0] + rise, rise, *xi[MOVING:]), (first, second, *P[MOVING:])


def add(P: Triangle, disturbance, walk: Sequence) -> Triangle:
    """P with the variances of w and of each v added."""
    first = (P[0][0] + disturbance, P[0][1] + disturbance, *P[0][2:])
    second = (P[1][0] + disturbance, *P[1][1:])
    rest = ((row[0] + q, *row[1:]) for row, q in zip(P[MOVING:], walk, strict=True))
    return (first, second, *rest)


@once
def cholesky(P: Triangle) -> tuple[Numbers, ...]:
    """Columns of L, P = L L', each from its diagonal down; zeros where P has no variance left."""
    n = len(P)
    work = [list(row) for row in P]
    columns = []
    for j in range(n):
        pivot = work[j][0]
        good = pivot > 0
        root = jnp.where(good, jnp.sqrt(jnp.where(good, pivot, 1.0)), 0.0)
        inverse = jnp.where(good, 1.0 / jnp.where(good, root, 1.0), 0.0)
        column = (root, *(value * inverse for value in work[j][1:]))
        for i in range(j + 1, n):
            for m in range(i, n):
                work[i][m - i] = work[i][m - i] - column[i - j] * column[m - j]
        columns.append(column)
    return tuple(columns)
