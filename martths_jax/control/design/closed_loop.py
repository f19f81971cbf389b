"""Is a linear tracking controller stable on the plant it was designed for?  On the host, in NumPy.

``stability`` answers the same for any plants by differentiating the engine, which has to be
compiled first; a design is checked here in milliseconds.  A test holds both together.
"""

from __future__ import annotations

import numpy as np

from martths_jax.control.base import Observation
from martths_jax.control.estimators.kalman import steady_state_gains
from martths_jax.coupler import MM
from martths_jax.structure.integrators import ZeroOrderHold
from martths_jax.structure.modal import to_dense

#: Rates up to so many times the benchmark's are tried for one that holds.
HIGHEST = 64


def tracking_radius(plant, filter_gain, step, dt: float, outer=None) -> float:
    """Spectral radius of plant, filter and controller, without `outer` for a target at rest.

    Args:
        plant: dense discrete (A, B, C), states slot by slot.
        filter_gain: (n, 2), as ``steady_state_gains`` gives it.
        step: (state (2, T), seen) -> (state, decision) of a linear controller, in NumPy.
        dt: sample period [s].
        outer: the numerical substructure with the restoring force, a ``_Structure``.
    """
    A, B, C = plant
    n, m = len(A), 0 if outer is None else len(outer.A)
    parts = np.cumsum([n, n, 2, m, 2 if m else 0])
    # Every column is the loop with one state at one: what comes back is a column of its matrix.
    lanes = np.eye(parts[-1] + (2 if m else 0))
    z, predicted, kept, x, before, before_that = np.split(lanes, parts)
    measured = C @ z
    corrected = predicted + filter_gain @ (measured - C @ predicted)
    estimate = C @ corrected
    target, after = np.zeros_like(estimate), []
    if m:
        interface = outer.interface @ estimate
        load = -(outer.taps[0] @ interface + outer.taps[1] @ before + outer.taps[2] @ before_that)
        target = np.linalg.solve(outer.interface, (outer.C @ x + outer.D @ load)[:2])
        after = [outer.A @ x + outer.B @ load, interface, before]
    slots = np.swapaxes(corrected.reshape(n // 2, 2, -1), 0, 1)
    seen = Observation(1, dt, target, measured, estimate, slots, None)
    kept, decision = step(kept, seen)
    u = np.asarray(decision.u)
    ahead = [A @ z + B @ u, A @ corrected + B @ u, np.asarray(kept), *after]
    return float(np.abs(np.linalg.eigvals(np.concatenate(ahead))).max())


class _Structure:
    """Numerical substructure of a benchmark, driven by the restoring force, dense and at rest."""

    def __init__(self, benchmark):
        A, B, C, D = to_dense(benchmark.numerical)
        self.A, self.B, self.C, self.D = A, B[:, 1:], C, D[:, 1:]
        self.taps = np.asarray(benchmark.specimen.taps)
        lever = float(benchmark.coupler.arm) * np.sin(float(benchmark.coupler.alpha))
        self.interface = np.linalg.inv(MM * np.array([[1.0, lever], [1.0, -lever]]))


def nominal_radius(benchmark, filter_gain, step) -> float:
    """Spectral radius of the whole loop on the benchmark's own plant.

    Args:
        benchmark: from ``build_benchmark``.
        filter_gain: (2, m, 2), as ``KalmanFilter`` holds it.
        step: as in ``tracking_radius``.
    """
    A, B, C, _ = to_dense(benchmark.plant_model)
    gain = np.swapaxes(np.asarray(filter_gain), 0, 1).reshape(len(A), 2)
    return tracking_radius((A, B, C), gain, step, benchmark.dt, _Structure(benchmark))


def lowest_stable_rate(benchmark, q: float, step) -> float | None:
    """Lowest sampling rate [Hz] at which plant, filter and controller are stable together.

    The gains are those of continuous time and stay; the filter is designed anew at every rate.  The
    structure, which hardly acts on them, is left out.

    Args:
        benchmark: gives the plant and the noise; its own rate is unstable.
        q: process noise of the filter [mm^2].
        step: as in ``tracking_radius``.

    Returns:
        the rate, rounded up to whole Hz; None if none holds up to ``HIGHEST`` times the
        benchmark's, or that is stable without the structure, so that the rate is not the cause.
    """
    A, B, C = benchmark.plant_continuous

    def unstable(fs: float) -> bool:
        discrete = ZeroOrderHold().discretise(A, B, C, 1 / fs)[:3]
        gain = steady_state_gains(*discrete, q, benchmark.noise_power * fs)[0]
        return tracking_radius(discrete, gain, step, 1 / fs) >= 1

    low = high = benchmark.fs
    if not unstable(low):
        return None
    while unstable(high):
        low, high = high, 2 * high
        if high > HIGHEST * benchmark.fs:
            return None
    low, high = int(np.floor(low)), int(np.ceil(high))
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if unstable(middle) else (low, middle)
    return float(high)
