"""Gains of LQG tracking control and of its filter as differentiable functions of their weights."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from martths_jax.algebra.riccati import care, dense_kalman_gain, solve
from martths_jax.benchmark import Benchmark
from martths_jax.runtime import check_precision
from martths_jax.structure.modal import to_dense

#: Free weights of the design; that of the first command is 1, since only ratios matter.
WEIGHTS = ("e1", "e2", "r2", "y1", "y2", "q")


def tracking_gains(
    benchmark: Benchmark, Q: jax.Array, R: jax.Array, S: jax.Array | None = None
) -> tuple[jax.Array, jax.Array]:
    """Gains that minimise the integral of w'Q w + 2 w'S u + u'R u, w = (z, e), e' = x_a - C z.

    Args:
        Q: (10, 10) weight of the plant states, slot by slot, and of the two integrated errors.
        R: (2, 2) weight of the commands.
        S: (10, 2) cross weight, none by default.

    Returns:
        K_z (2, 2, 4), K_e (2, 2) as ``LQG`` holds them.
    """
    check_precision()
    A, B, C = benchmark.plant_continuous
    n = A.shape[0]
    A = jnp.block([[A, jnp.zeros((n, 2))], [-C, jnp.zeros((2, 2))]])
    B = jnp.concatenate([B, jnp.zeros((2, 2))])
    shift = jnp.zeros((2, n + 2))
    if S is not None:  # u = v - R^-1 S' w leaves a problem without the cross term
        shift = solve(R, S.T)
        A, Q = A - B @ shift, Q - S @ shift
    K = solve(R, B.T @ care(A, B, Q, R)) + shift
    return jnp.swapaxes(K[:, :n].reshape(2, n // 2, 2), 1, 2), K[:, n:]


def kalman_gain(benchmark: Benchmark, q: jax.Array, r: jax.Array | None = None) -> jax.Array:
    """Filter gain (2, m, 2) of the steady-state Kalman filter on the nominal plant.

    Args:
        q: variance of the process noise through the plant's inputs [mm^2], a scalar or (2, 2).
        r: variance of the measurement noise [mm^2], a scalar or (2, 2); the benchmark's by default.
    """
    check_precision()
    A, B, C, _ = to_dense(benchmark.plant_model)
    return dense_kalman_gain(A, B, C, q, benchmark.r_mm2 if r is None else r)
