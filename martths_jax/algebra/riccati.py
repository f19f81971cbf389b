"""Algebraic Riccati equations with exact derivatives, in pure JAX.

Both equations are solved by the structure-preserving doubling algorithm (SDA): the discrete one
directly, the continuous one after a Cayley transform (Chu, Fan & Lin 2005, Linear Algebra Appl.
396; Chu, Fan, Lin & Wang 2004, Int. J. Control 77).  Doubling needs no start, converges
quadratically and only solves n x n systems, so ``vmap`` batches it.  A few Newton steps then take
off what round-off has left.

The derivative does not go through the iteration: at the solution the differential dX satisfies a
Lyapunov (continuous) or Stein (discrete) equation of the closed loop.  That equation is linear in
the perturbation, so JAX transposes it into the adjoint equation for reverse mode, and forward mode
works as well.  These are solved as Kronecker systems, n^2 unknowns: meant for n up to about 20.

Linear systems are eliminated here instead of by LAPACK: batches of small LAPACK calls, started by
two independent chains of one program, can wait for one another for ever on CPUs with few threads
(JAX 0.10), and vectorised elimination is no slower for a batch.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from martths_jax.runtime import check_precision

DOUBLINGS = 60  # 2^60 steps of the fixed-point iteration: never reached by a solvable equation
NEWTON_STEPS = 3
BALANCING_SWEEPS = 12
CONVERGED = 1e-15  # relative change of the solution in a doubling


def care(A: jax.Array, B: jax.Array, Q: jax.Array, R: jax.Array) -> jax.Array:
    """Stabilising solution of A'X + X A - X B R^-1 B' X + Q = 0.

    Args:
        A: (n, n); B: (n, i); Q: (n, n) symmetric, semidefinite; R: (i, i) symmetric, definite.

    Returns:
        X (n, n), symmetric; not finite or not stabilising if there is no such solution.
    """
    check_precision()
    return _care(A, _symmetric(B @ solve(R, B.T)), _symmetric(Q))


def dare(A: jax.Array, B: jax.Array, Q: jax.Array, R: jax.Array) -> jax.Array:
    """Stabilising solution of X = A'X A - A'X B (R + B'X B)^-1 B'X A + Q.

    Args and result as in ``care``.
    """
    check_precision()
    return _dare(A, _symmetric(B @ solve(R, B.T)), _symmetric(Q))


def lyapunov(A: jax.Array, M: jax.Array) -> jax.Array:
    """X of A X + X A' + M = 0, all (n, n)."""
    identity = jnp.eye(A.shape[0])
    operator = jnp.kron(A, identity) + jnp.kron(identity, A)
    return -solve(operator, M.reshape(-1, 1)).reshape(M.shape)


def stein(A: jax.Array, M: jax.Array) -> jax.Array:
    """X of X = A X A' + M, all (n, n)."""
    operator = jnp.eye(A.size) - jnp.kron(A, A)
    return solve(operator, M.reshape(-1, 1)).reshape(M.shape)


def dense_kalman_gain(A, B, C, q, r) -> jax.Array:
    """Current-estimate filter gain P C' (C P C' + r)^-1 of x' = A x + B (u + w), y = C x + v.

    Args:
        A, B, C: discrete plant (n, n), (n, 2), (2, n), its states slot by slot.
        q, r: variances of w and v, scalars or (2, 2).

    Returns:
        (2, n / 2, 2), as ``KalmanFilter`` holds it.
    """
    both = jnp.eye(2)
    noise_in = q * both if jnp.ndim(q) == 0 else q
    noise_out = r * both if jnp.ndim(r) == 0 else r
    P = dare(A.T, C.T, B @ noise_in @ B.T, noise_out)
    L = solve(C @ P @ C.T + noise_out, C @ P).T
    return jnp.transpose(L.reshape(-1, 2, 2), (1, 0, 2))


def solve(A: jax.Array, b: jax.Array) -> jax.Array:
    """x (n, k) of A x = b for A (n, n), b (n, k): Gauss-Jordan elimination, partial pivoting."""
    return jax.lax.custom_linear_solve(
        lambda x: A @ x,
        b,
        solve=lambda _, b: _eliminate(A, b),
        transpose_solve=lambda _, b: _eliminate(A.T, b),
    )


def _eliminate(A, b):
    n = A.shape[0]
    rows = jnp.arange(n)[:, None]

    def column(j, M):
        size = jnp.where(rows[:, 0] >= j, jnp.abs(M[:, j]), -1.0)
        pivot = jnp.argmax(size)
        top = M[pivot]
        M = jnp.where(rows == pivot, M[j][None], M)
        top = top / top[j]
        return jnp.where(rows == j, top[None], M - M[:, j][:, None] * top[None])

    return jax.lax.fori_loop(0, n, column, jnp.concatenate([A, b], axis=1))[:, n:]


@jax.custom_jvp
def _care(A, G, Q):
    d = _balancing(A, G, Q)
    A, G, Q = _scaled(d, A, G, Q)
    identity = jnp.eye(A.shape[0])
    # Beyond every eigenvalue of the Hamiltonian, so that neither inverse below can be singular.
    shift = 1.1 * jnp.max(jnp.sum(jnp.abs(jnp.block([[A, G], [Q, A.T]])), axis=1))
    shifted_inverse = _eliminate(A - shift * identity, identity)
    QS = Q @ shifted_inverse
    cayley = 2 * shift * _eliminate((A - shift * identity).T + QS @ G, identity)
    A_0, G_0, Q_0 = identity + cayley.T, shifted_inverse @ G @ cayley, cayley @ QS
    X = _doubling(A_0, _symmetric(G_0), _symmetric(Q_0))

    def newton(_, X):
        residual = A.T @ X + X @ A - X @ G @ X + Q
        return _symmetric(X + lyapunov((A - G @ X).T, residual))

    return jax.lax.fori_loop(0, NEWTON_STEPS, newton, X) / (d[:, None] * d[None])


@_care.defjvp
def _care_derivative(point, change):
    (A, G, _), (dA, dG, dQ) = point, change
    X = _care(*point)
    product = X @ dA
    return X, lyapunov((A - G @ X).T, product + product.T - X @ dG @ X + dQ)


@jax.custom_jvp
def _dare(A, G, Q):
    d = _balancing(A, G, Q)
    A, G, Q = _scaled(d, A, G, Q)

    def newton(_, X):
        closed = _discrete_closed_loop(A, G, X)
        residual = A.T @ X @ closed + Q - X
        return _symmetric(X + stein(closed.T, residual))

    X = jax.lax.fori_loop(0, NEWTON_STEPS, newton, _doubling(A, G, Q))
    return X / (d[:, None] * d[None])


@_dare.defjvp
def _dare_derivative(point, change):
    (A, G, _), (dA, dG, dQ) = point, change
    X = _dare(*point)
    closed = _discrete_closed_loop(A, G, X)
    XC = X @ closed
    product = XC.T @ dA
    return X, stein(closed.T, product + product.T - XC.T @ dG @ XC + dQ)


def _discrete_closed_loop(A, G, X):
    """(I + G X)^-1 A, which is A - B K."""
    return solve(jnp.eye(A.shape[0]) + G @ X, A)


def _doubling(A, G, Q):
    """Limit of Q in the doubling of the symplectic pencil, which solves the discrete equation."""

    def step(carry):
        A, G, Q, _, n = carry
        W = jnp.eye(A.shape[0]) + G @ Q
        WA, WG = jnp.split(_eliminate(W, jnp.concatenate([A, G], axis=1)), 2, axis=1)
        added = _symmetric(A.T @ Q @ WA)
        change = jnp.max(jnp.abs(added)) / jnp.max(jnp.abs(Q + added))
        return A @ WA, G + _symmetric(A @ WG @ A.T), Q + added, change, n + 1

    # A change that is not a number compares false and ends the loop.
    going = lambda carry: (carry[3] > CONVERGED) & (carry[4] < DOUBLINGS)  # noqa: E731
    return jax.lax.while_loop(going, step, (A, G, Q, jnp.inf, 0))[2]


def _balancing(A, G, Q):
    """Diagonal D = diag(d) that evens out the rows and columns of [[A, G], [Q, A']].

    The scaling D^-1 A D, D^-1 G D^-1, D Q D keeps the structure; its solution is D X D.  Osborne's
    sweeps over the coordinates, rounded to powers of two so that the scaling itself is exact.
    """
    A, G, Q = jnp.abs(A), jnp.abs(G), jnp.abs(Q)
    A = A - jnp.diag(jnp.diag(A))
    n = A.shape[0]

    def coordinate(j, d):
        i = j % n
        # A zero row or column leaves nothing to weigh, hence the tiny floor.
        row = jnp.sum(A[i] * d) + jnp.sum(G[i] / d)
        column = jnp.sum(A[:, i] / d) + jnp.sum(Q[:, i] * d)
        tiny = 1e-30
        return d.at[i].set(jnp.sqrt((row + tiny) / (column + tiny)))

    d = jax.lax.fori_loop(0, BALANCING_SWEEPS * n, coordinate, jnp.ones(n))
    return 2.0 ** jnp.round(jnp.log2(jnp.clip(d, 1e-12, 1e12)))


def _scaled(d, A, G, Q):
    return A * d[None] / d[:, None], G / (d[:, None] * d[None]), Q * (d[:, None] * d[None])


def _symmetric(X):
    return (X + X.T) / 2
