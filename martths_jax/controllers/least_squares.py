"""Small symmetric systems solved for a whole batch of trials at once.

Symmetric 8 x 8 matrices are held packed: a list of columns, column j with rows j ... n-1 of shape
(n - j, T).  The unrolled factorisation then is a few dozen wide vector operations, where a batched
LAPACK call would be one small call a trial.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

Packed = tuple[jax.Array, ...]


def outer_packed(x: jax.Array) -> Packed:
    """Lower triangle of x x' as packed columns; x is (n, T)."""
    return tuple(x[j:] * x[j] for j in range(x.shape[0]))


def unpack(columns: Packed) -> jax.Array:
    """(n, n, T) full symmetric matrix of packed columns."""
    n, T = len(columns), columns[0].shape[-1]
    full = jnp.zeros((n, n, T))
    for j, column in enumerate(columns):
        full = full.at[j:, j].set(column)
        full = full.at[j, j:].set(column)
    return full


def solve_ldl(columns: Packed, rhs: jax.Array) -> jax.Array:
    """Solve G c = h by the square-root-free Cholesky factorisation G = L D L', unrolled.

    Args:
        columns: packed symmetric positive definite G, n columns.
        rhs: (n, r, T) right-hand sides.

    Returns:
        (n, r, T) solutions; not finite for a trial whose G is singular.
    """
    n = len(columns)
    work = list(columns)
    pivots, factors = [], []
    x = list(rhs)
    for j in range(n):
        inverse = 1.0 / work[j][0]
        below = work[j][1:]
        factor = below * inverse
        for i in range(j + 1, n):
            work[i] = work[i] - factor[i - j - 1 :] * below[i - j - 1]
            x[i] = x[i] - factor[i - j - 1] * x[j]
        pivots.append(inverse)
        factors.append(factor)
    x = [x[j] * pivots[j] for j in range(n)]
    for j in reversed(range(n)):
        for i in range(j + 1, n):
            x[j] = x[j] - factors[j][i - j - 1] * x[i]
    return jnp.stack(x)


def solve_lu(columns: Packed, rhs: jax.Array) -> jax.Array:
    """The same by ``jnp.linalg.solve`` (LU with partial pivoting): the reference, far slower."""
    G = jnp.moveaxis(unpack(columns), -1, 0)
    return jnp.moveaxis(jnp.linalg.solve(G, jnp.moveaxis(rhs, -1, 0)), 0, -1)


SOLVERS = {"ldl": solve_ldl, "lu": solve_lu}
