"""Discrete linear systems in real modal form: cheap to step, exact to write down.

A diagonalisable system x(k+1) = A x(k) + B u(k), y(k) = C x(k) + D u(k) is held in slots of two
states each.  A slot is a complex pair (a +- j b) or two real poles, and steps as

    x[0]' = a[0] x[0] + b[0] x[1],    x[1]' = a[1] x[1] + b[1] x[0]

so one step costs 4 n instead of n^2 products.  Trials stand on the last axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

import jax
import jax.numpy as jnp
import numpy as np
from scipy import linalg

from martths_jax.once import once


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class ModalSystem:
    """Discrete system in slots of two states; ``T`` is 1 (shared) or the number of trials.

    Attributes:
        a: (2, m, T) own multipliers.
        b: (2, m, T) multipliers of the partner state.
        B: (2, m, i) or (2, m, i, T) inputs.
        C: (o, 2, m) or (o, 2, m, T) outputs.
        D: (o, i) direct feed-through; None where there is none.
    """

    a: jax.Array
    b: jax.Array
    B: jax.Array
    C: jax.Array
    D: jax.Array | None = None

    #: Axes when all trials share the system; one more counts them (see ``Controller``).
    shared_axes = MappingProxyType({"a": 2, "b": 2, "B": 3, "C": 3, "D": 2})

    @property
    def order(self) -> int:
        """Number of states."""
        return 2 * self.a.shape[1]


def chain(columns, rows, start=None) -> jax.Array:
    """start + sum_i columns[i] * rows[i], one fused multiply-add after the other.

    XLA on CPUs turns a sum over a short axis, or a product of small matrices, into scalar code.
    """
    total = start
    for column, row in zip(columns, rows, strict=True):
        row = trailing(row, column.ndim)
        total = column * row if total is None else total + column * row
    return total


def trailing(x, axes: int):
    """An array (..., T) with leading axes of one, so that it goes with others of so many axes."""
    missing = axes - jnp.ndim(x)
    return x if missing <= 0 or not jnp.ndim(x) else jnp.reshape(x, (1,) * missing + jnp.shape(x))


def contract(matrix: jax.Array, x, axes: int = 1, start=None) -> jax.Array:
    """Product of a matrix, shared or one a trial, with batched vectors.

    Args:
        matrix: (o, *n) shared or (o, *n, T) one a trial, with `axes` input axes n.
        x: (*n, T); for one axis also a list of rows (T,) and scalars.
        axes: number of axes that are summed.
        start: (o, T) to add to; zero if it is not given.
    """
    trials = matrix.shape[-1] if matrix.ndim == axes + 2 else 1
    matrix = matrix.reshape(matrix.shape[0], -1, trials)
    rows = x if axes == 1 else x.reshape(-1, x.shape[-1])
    return chain([matrix[:, i] for i in range(matrix.shape[1])], rows, start)


def spread(matrix: jax.Array, u) -> jax.Array:
    """B u for B (2, m, i), shared or (2, m, i, T), and i rows u, each (T,) or a scalar."""
    if matrix.ndim == 3:
        matrix = matrix[..., None]
    return chain([matrix[:, :, i] for i in range(matrix.shape[2])], u)


@once
def advance(system: ModalSystem, x: jax.Array, u) -> jax.Array:
    """State after one step: x (2, m, T), i rows of inputs u, each (T,) or a scalar -> (2, m, T)."""
    return spread(system.B, u) + system.a * x + system.b * x[::-1]


@once
def output(system: ModalSystem, x: jax.Array, u=None) -> jax.Array:
    """Outputs (o, T) of the state x (2, m, T), with the inputs u (as above) where D is not None."""
    start = None if system.D is None else contract(system.D, u)
    return contract(system.C, x, axes=2, start=start)


@jax.jit
def respond(system: ModalSystem, u: jax.Array) -> jax.Array:
    """Response from rest of one system to one input history: u (N, i) -> (N, o)."""

    def step(x, u_k):
        u_k = u_k[:, None]
        return advance(system, x, u_k), output(system, x, u_k)[:, 0]

    x = jnp.zeros(system.a.shape[:2] + (1,))
    return jax.lax.scan(step, x, u)[1]


def to_dense(system: ModalSystem) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Dense (A, B, C, D) of one system, states ordered slot by slot (x[0, 0], x[1, 0], ...)."""
    a, b = np.asarray(system.a)[..., 0], np.asarray(system.b)[..., 0]
    B, C = np.asarray(system.B), np.asarray(system.C)
    B = B[..., 0] if B.ndim == 4 else B
    C = C[..., 0] if C.ndim == 4 else C
    m = a.shape[1]
    A = np.zeros((2 * m, 2 * m))
    for j in range(m):
        A[2 * j : 2 * j + 2, 2 * j : 2 * j + 2] = [[a[0, j], b[0, j]], [b[1, j], a[1, j]]]
    B = np.transpose(B, (1, 0, 2)).reshape(2 * m, -1)
    C = np.transpose(C, (0, 2, 1)).reshape(C.shape[0], 2 * m)
    D = np.zeros((C.shape[0], B.shape[1])) if system.D is None else np.asarray(system.D)
    return A, B, C, D


def from_dense(A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray | None) -> ModalSystem:
    """Modal form of a diagonalisable dense system (host).

    Raises:
        ValueError: if A is too close to defective to be written in this form.
    """
    poles, V = linalg.eig(A)
    if np.linalg.cond(V) > 1e10:
        raise ValueError("The system has (nearly) repeated poles and no modal form.")
    B_m, C_m = np.linalg.solve(V, B.astype(complex)), C @ V
    upper = np.flatnonzero(poles.imag > 0)
    real = np.flatnonzero(poles.imag == 0)
    m = upper.size + (real.size + 1) // 2
    a, b = np.zeros((2, m)), np.zeros((2, m))
    B_s, C_s = np.zeros((2, m, B.shape[1])), np.zeros((C.shape[0], 2, m))
    for j, i in enumerate(upper):
        # z' = p z + beta u, y = 2 Re(c z): x[0] = Re z, x[1] = Im z.
        a[:, j] = poles[i].real
        b[:, j] = -poles[i].imag, poles[i].imag
        B_s[:, j] = B_m[i].real, B_m[i].imag
        C_s[:, 0, j], C_s[:, 1, j] = 2 * C_m[:, i].real, -2 * C_m[:, i].imag
    for n, i in enumerate(real):
        row, j = n % 2, upper.size + n // 2
        a[row, j] = poles[i].real
        B_s[row, j], C_s[:, row, j] = B_m[i].real, C_m[:, i].real
    return ModalSystem(
        a=jnp.asarray(a[..., None]),
        b=jnp.asarray(b[..., None]),
        B=jnp.asarray(B_s),
        C=jnp.asarray(C_s),
        D=None if D is None or not np.any(D) else jnp.asarray(D),
    )


def balanced_truncation(A, B, C, tolerance: float):
    """Smallest stable realisation whose Hankel error stays under `tolerance` of the largest.

    Square-root balanced truncation (Laub et al. 1987, IEEE TAC 32(2)) of a stable discrete system;
    the error bound is twice the sum of the singular values that are left out.

    Args:
        A, B, C: (n, n), (n, i), (o, n), inputs and outputs scaled so that one tolerance fits all.
        tolerance: bound on the left-out share [-].
    """
    W_c = linalg.solve_discrete_lyapunov(A, B @ B.T)
    W_o = linalg.solve_discrete_lyapunov(A.T, C.T @ C)
    R, L = _factor(W_c), _factor(W_o)
    U, s, Vt = linalg.svd(L.T @ R)
    tail = 2 * np.cumsum(s[::-1])[::-1]
    order = int(np.count_nonzero(tail > tolerance * s[0]))
    s_half = np.sqrt(s[:order])
    T = R @ Vt[:order].T / s_half
    T_left = (L @ U[:, :order] / s_half).T
    return T_left @ A @ T, T_left @ B, C @ T


def _factor(W: np.ndarray) -> np.ndarray:
    """Square-root factor of a symmetric semidefinite matrix that round-off may have dented."""
    values, vectors = linalg.eigh((W + W.T) / 2)
    return vectors * np.sqrt(np.clip(values, 0, None))
