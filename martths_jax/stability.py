"""Stability of the hybrid loop with frozen coefficients: spectral radius and delay margin.

A run of an adaptive controller is a sequence of linear loops, one for each set of coefficients.
Freezing them at a sample gives a linear time-invariant loop xi(k+1) = A xi(k) of structure, plant,
filter, interface history and target history.  Its spectral radius says whether the loop would
decay if adaptation stopped there: below one it does.  It is a diagnostic of each instant, no proof
for the time-varying loop.

A is the derivative of the engine's own ``sample_period`` at rest, so nothing is modelled twice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from scipy import linalg

from martths_jax.benchmark import Benchmark
from martths_jax.control.base import Controller
from martths_jax.control.compensator import Compensator
from martths_jax.errors import argument_error
from martths_jax.loop import initial_state, sample_period
from martths_jax.plant import Plants
from martths_jax.runtime import check_runtime
from martths_jax.structure.modal import spread


def linear_loop(
    benchmark: Benchmark, controller: Controller, plants: Plants, *, opened: bool = False
):
    """Matrices of the loop linearised at rest, xi(k+1) = A xi(k) + B v(k), u(k) = C xi(k).

    Args:
        benchmark: from ``build_benchmark``.
        controller: a linear time-invariant one, prepared, such as what ``Controller.frozen`` gives
            (its ``coefficients`` one a trial or shared).
        plants: T of them.
        opened: cut the loop at the plants' input: v (n values, mm) drives the plants instead of
            the command u, while the filter still hears u.  Otherwise v = u.

    Returns:
        (T, n, n) A, or with `opened` the tuple A, B (T, n, i), C (T, i, n).
    """
    check_runtime()
    if controller.adapts:
        raise argument_error(
            "controller", "be linear and time-invariant", f"{type(controller).__name__}, which "
            "adapts", "Freeze it: controller.frozen(benchmark, coefficients).",
        )  # fmt: skip
    A, B, C = _linearised(benchmark, controller, plants.discretise(benchmark.dt))
    return (A, B, C) if opened else A + B @ C


@jax.jit
def _linearised(benchmark, controller, system):
    """``linear_loop`` with the loop cut, for all plants of a discretised batch."""
    layout = benchmark.layout
    silence = jnp.zeros((layout.plant_outputs, 1))
    shared = getattr(controller, "coefficients", jnp.zeros(0)).ndim < 3

    def one(plant, coefficients):
        own = controller if shared else replace(controller, coefficients=coefficients)
        plant = jax.tree.map(lambda x: x[..., None], plant)
        box = Compensator(own, own.estimator, benchmark.dt)
        state = initial_state(benchmark, box, plant, 1)
        # k = 1 stands for any sample after the first, whose differences are special.
        at = lambda state, k: replace(state, compensator=replace(state.compensator, k=k))  # noqa: E731
        rest, unravel = ravel_pytree(at(state, None))

        def step(xi, v):
            after, signals, _ = sample_period(
                benchmark, box, plant, at(unravel(xi), jnp.asarray(1)), 0.0, silence, None
            )
            command = signals["u"]
            driven = after.plant + spread(plant.B, v[:, None] - command)
            return ravel_pytree(at(replace(after, plant=driven), None))[0], command[:, 0]

        v = jnp.zeros(len(layout.actuators))
        # No command acts on itself within a sample, so there is no direct term.
        (A, C), (B, _) = (jax.jacfwd(step, n)(rest, v) for n in (0, 1))
        return A, B, C

    last = jax.tree.map(lambda x: x.ndim - 1, system)
    coefficients = None if shared else controller.coefficients
    return jax.vmap(one, in_axes=(last, None if shared else 2))(system, coefficients)


def spectral_radius(benchmark: Benchmark, controller: Controller, plants: Plants) -> np.ndarray:
    """(T,) largest magnitude of the poles of the frozen loop [-]; below 1 it is stable.

    Arguments as in ``linear_loop``.
    """
    return radius_of(linear_loop(benchmark, controller, plants))


def radius_of(A) -> np.ndarray:
    """(T,) largest magnitude of the eigenvalues of (T, n, n) matrices; NaN for those of a matrix
    that is not finite."""
    A = np.asarray(A)
    radius = np.full(len(A), np.nan)
    finite = np.isfinite(A).all(axis=(1, 2))
    radius[finite] = np.abs(np.linalg.eigvals(A[finite])).max(axis=1)
    return radius


def radius_along(
    benchmark: Benchmark,
    controller: Controller,
    plants: Plants,
    coefficients,
    samples: Sequence[int],
) -> np.ndarray:
    """Spectral radius of the frozen loop along a run: the diagnostic signal.

    Args:
        benchmark, controller, plants: of the run.
        coefficients: (T, N, ...) what adapts, as the controller's signals hold it.
        samples: S numbers of samples at which to freeze.

    Returns:
        (T, S).
    """
    chosen = np.asarray(coefficients)[:, np.asarray(samples)]
    T, S = chosen.shape[:2]
    each = np.moveaxis(chosen.reshape(T * S, *chosen.shape[2:]), 0, -1)
    frozen = controller.frozen(benchmark, each)
    return spectral_radius(benchmark, frozen, plants[np.repeat(np.arange(T), S)]).reshape(T, S)


def delay_margin(
    benchmark: Benchmark, controller: Controller, plants: Plants, *, points: int = 4000
) -> np.ndarray:
    """Extra delay in both actuators that takes the frozen loop to the edge of stability.

    The loop is cut at the plants' input; a delay tau multiplies its frequency response L(w) by
    exp(-j w tau), so the loop stands on the edge where an eigenvalue of L(w) has magnitude one and
    phase w tau.

    Args:
        benchmark, controller, plants: as in ``linear_loop``.
        points: frequencies of the search, logarithmic from 0.05 Hz to half the sampling rate.

    Returns:
        (T,) delay [ms]; 0 where the loop is unstable without any, inf where none is found.
    """
    matrices = linear_loop(benchmark, controller, plants, opened=True)
    return margin_of(*matrices, benchmark.dt, points=points)


def margin_of(A, B, C, dt: float, *, points: int = 4000) -> np.ndarray:
    """``delay_margin`` of loops that are there: ``linear_loop`` with `opened`.

    Args:
        A, B, C: (T, n, n), (T, n, 2), (T, 2, n).
        dt: sample period [s].
        points: as of ``delay_margin``.
    """
    stable = radius_of(A + B @ C) < 1
    omega = 2 * np.pi * np.geomspace(0.05, 0.5 / dt, points)
    return np.array(
        [
            _edge(*(np.asarray(m[i]) for m in (A, B, C)), omega, dt) if good else 0.0
            for i, good in enumerate(stable)
        ]
    )


def response(A, B, C, z: np.ndarray) -> np.ndarray:
    """(W, o, i) response C (z I - A)^-1 B at (W,) points z.

    With A = Q S Q^H, S upper triangular (complex Schur form), each point takes a back substitution.
    Eigenvectors would not do: past samples that are kept are a chain of poles at zero, which has
    one eigenvector only.
    """
    S, Q = linalg.schur(A, output="complex")
    right = Q.conj().T @ B
    x = np.zeros((len(z), *right.shape), complex)
    for i in range(len(S))[::-1]:
        x[:, i] = (right[i] + S[i, i + 1 :] @ x[:, i + 1 :]) / (z - S[i, i])[:, None]
    return C @ Q @ x


def _edge(A, B, C, omega, dt) -> float:
    """Smallest delay [ms] at which an eigenvalue of the open loop passes through one."""
    loci = np.linalg.eigvals(response(A, B, C, np.exp(1j * omega * dt)))
    # Follow each branch: in the order that makes the step between points smallest.
    orders = np.array(list(permutations(range(loci.shape[1]))))
    for i in range(1, len(loci)):
        steps = np.abs(loci[i][orders] - loci[i - 1]).sum(axis=1)
        loci[i] = loci[i][orders[np.argmin(steps)]]
    delays = []
    for branch in loci.T:
        above = np.abs(branch) - 1
        for i in np.flatnonzero(above[:-1] * above[1:] <= 0):
            part = above[i] / (above[i] - above[i + 1]) if above[i] != above[i + 1] else 0.0
            value = branch[i] + part * (branch[i + 1] - branch[i])
            w = omega[i] + part * (omega[i + 1] - omega[i])
            delays.append((np.angle(value) % (2 * np.pi)) / w)
    return 1e3 * min(delays, default=np.inf)
