"""Normal equations of a small least-squares problem, for a whole batch of trials at once.

The code below is scalar algebra in which each "number" is an array over trials (T,).  The
symmetric matrix G = sum phi phi' and the right side h = sum phi u' are held as packed rows: row j
is the tuple (G[j, j], ..., G[j, n-1], h[j, 0], ..., h[j, r-1]).  Compilers turn this into long
vector kernels without index arithmetic; arrays of two and three dimensions are slower on CPUs, and
a batched LAPACK call, which is one small call a trial, is far slower.
"""

from __future__ import annotations

from collections.abc import Sequence

import jax
import jax.numpy as jnp

from martths_jax.once import once

Rows = tuple[tuple[jax.Array, ...], ...]


def zeros(unknowns: int, sides: int, trials: int) -> Rows:
    """Empty normal equations."""
    zero = jnp.zeros(trials)
    return tuple((zero,) * (unknowns - j + sides) for j in range(unknowns))


def add_observation(rows: Rows, phi: Sequence[jax.Array], values: Sequence[jax.Array]) -> Rows:
    """Add one observation phi' c = values.

    Args:
        phi: n regressors (T,).
        values: r observed values (T,).
    """
    both = [*phi, *values]
    return tuple(
        tuple(g + phi[j] * v for g, v in zip(row, both[j:], strict=True))
        for j, row in enumerate(rows)
    )


def exchange_observation(rows: Rows, phi, values, phi_leaving, values_leaving) -> Rows:
    """Add one observation and take another away, see ``add_observation``."""
    entering, leaving = [*phi, *values], [*phi_leaving, *values_leaving]
    return tuple(
        tuple(
            g + phi[j] * e - phi_leaving[j] * l
            for g, e, l in zip(row, entering[j:], leaving[j:], strict=True)
        )
        for j, row in enumerate(rows)
    )


def pulled(rows: Rows, weight, towards: Sequence[Sequence[jax.Array]]) -> Rows:
    """Add weight |c - towards|^2 to the least-squares problem.

    Args:
        weight: scalar or (T,), same unit as G.
        towards: n rows of r numbers, scalars or (T,).
    """
    n = len(rows)
    return tuple(
        (row[0] + weight, *row[1 : n - j])
        + tuple(h + weight * towards[j][i] for i, h in enumerate(row[n - j :]))
        for j, row in enumerate(rows)
    )


def weighted(rows: Rows, weight: jax.Array, towards=None) -> Rows:
    """Add trace (c - towards)' W (c - towards), one weight for each pair of unknowns.

    Args:
        weight: symmetric W, (n, n) or (n, n, T), same unit as G.
        towards: as for ``pulled``; None stands for zero.
    """
    n = len(rows)

    def side(j, i, h):
        if towards is None:
            return h
        return h + sum(weight[j, m] * towards[m][i] for m in range(n))

    return tuple(
        tuple(g + weight[j, j + m] for m, g in enumerate(row[: n - j]))
        + tuple(side(j, i, h) for i, h in enumerate(row[n - j :]))
        for j, row in enumerate(rows)
    )


def full_matrices(rows: Rows) -> tuple[jax.Array, jax.Array]:
    """Full G (n, n, T) and h (n, r, T)."""
    n = len(rows)
    G = jnp.stack([jnp.stack([rows[min(i, j)][abs(i - j)] for j in range(n)]) for i in range(n)])
    return G, jnp.stack([jnp.stack(row[n - j :]) for j, row in enumerate(rows)])


def solve_ldl(rows: Rows) -> tuple[list[list[jax.Array]], jax.Array]:
    """Solve G c = h by square-root-free Cholesky factorisation, unrolled.

    Returns:
        c[j][side] (T,), not finite for a trial whose G is singular; `tolerance` (T,), the smallest
        pivot relative to its diagonal entry, min d_j / G_jj.  That is the share of a regressor's
        power which those before it do not explain; its inverse is a lower bound of the condition
        number of G scaled to a unit diagonal.  NaN or not positive for a singular G.
    """
    work, tolerance = _eliminate(rows)
    return _substitute(work), tolerance


@once
def pivots(rows: Rows) -> list[jax.Array]:
    """d_1 ... d_n (T,) of G = L D L': what each regressor has beyond those before it."""
    n = len(rows)
    work = [list(row[: n - j]) for j, row in enumerate(rows)]
    for j in range(n):
        for i in range(j + 1, n):
            share = work[j][i - j] / work[j][0]
            for m in range(len(work[i])):
                work[i][m] = work[i][m] - share * work[j][i - j + m]
    return [row[0] for row in work]


@once
def _eliminate(rows: Rows):
    """Unit upper factor and D^-1 L^-1 h as packed rows, and the smallest relative pivot."""
    n = len(rows)
    work = [list(row) for row in rows]
    worst = jnp.ones_like(rows[0][0])
    for j in range(n):
        inverse = 1.0 / work[j][0]
        # A pivot that is not positive counts as none; a multiplication saves the second division.
        worst = jnp.maximum(worst, jnp.where(inverse > 0, rows[j][0] * inverse, jnp.inf))
        scaled = [value * inverse for value in work[j]]
        for i in range(j + 1, n):
            for m in range(len(work[i])):
                work[i][m] = work[i][m] - scaled[i - j] * work[j][i - j + m]
        work[j] = scaled
    return work, 1.0 / worst


@once
def _substitute(work):
    """Solution of the unit upper system: c[j][side]."""
    n = len(work)
    solution: list[list[jax.Array]] = [[]] * n
    for j in reversed(range(n)):
        value = work[j][n - j :]
        for i in range(j + 1, n):
            value = [v - work[j][i - j] * c for v, c in zip(value, solution[i], strict=True)]
        solution[j] = value
    return solution


def solve_lu(rows: Rows) -> tuple[list[list[jax.Array]], jax.Array]:
    """The same by ``jnp.linalg.solve`` (LU with partial pivoting): the reference, far slower."""
    G, h = (jnp.moveaxis(x, -1, 0) for x in full_matrices(rows))
    diagonal = jnp.diagonal(jnp.linalg.cholesky(G), axis1=1, axis2=2)
    tolerance = jnp.min(diagonal**2 / jnp.diagonal(G, axis1=1, axis2=2), axis=1)
    return [list(c) for c in jnp.moveaxis(jnp.linalg.solve(G, h), 0, -1)], tolerance


SOLVERS = {"ldl": solve_ldl, "lu": solve_lu}
