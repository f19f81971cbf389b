"""The compared guards, each as settings of the sampler for a benchmark."""

from __future__ import annotations

import numpy as np
from fast_loop import Guard, slots

from martths_jax.control.adaptive.differences import BACKWARD_DIFFERENCES
from martths_jax.control.adaptive.inverse import nominal_inverse
from martths_jax.control.estimators import design_kalman
from martths_jax.structure.modal import to_dense

Q = 3e-5


def inverse(bench) -> np.ndarray:
    """The package's anchor."""
    return nominal_inverse(bench.plant_model, bench.fs, BACKWARD_DIFFERENCES)


def noise_covariance(bench, q: float = Q, samples: int = 6000) -> np.ndarray:
    """(8, 8) covariance of the regressor that shared sensor noise alone leaves after the filter."""
    A, _, C, _ = to_dense(bench.plant_model)
    L = slots(design_kalman(bench.plant_model, q, bench.r_mm2).filter_gain)
    left = np.eye(8) - L @ C
    impulse, state = [C @ L], A @ L
    for _ in range(samples - 1):
        impulse.append(C @ left @ state)
        state = A @ left @ state
    total = np.sum(impulse, axis=2)  # both sensors hear the same noise
    phi = [np.convolve(total[:, a], row) for a in range(2) for row in BACKWARD_DIFFERENCES]
    return bench.r_mm2 * np.array(phi) @ np.array(phi).T


def excitation_gate(bench, factor):
    return Guard(gate=factor, noise_var=np.diag(noise_covariance(bench)))


def bias_compensated(bench, pull=0.0):
    return Guard(bias=1024 * noise_covariance(bench), pull=pull)


CANDIDATES = {
    "literal": lambda b: Guard(),
    "pull to C_0, 1e-6, q = 1e-5": lambda b: Guard(pull=1e-6, q=1e-5),
    "pull to C_0, 1e-5": lambda b: Guard(pull=1e-5),
    "pull to last C, 1e-2": lambda b: Guard(prox=1e-2),
    "excitation gate, pivots > 10 x noise": lambda b: excitation_gate(b, 10.0),
    "rate limit, 0.01 a sample": lambda b: Guard(rate=0.01),
    "recursive, forgetting 1 - 1/1024": lambda b: Guard(forget=1 - 1 / 1024),
    "errors in variables (noise covariance removed)": lambda b: bias_compensated(b),
    "noise-shaped pull to inverse": lambda b: Guard(
        pull=b.fs * np.diag(noise_covariance(b)), anchor=inverse(b)
    ),
    "pull to inverse, 1e-5": lambda b: Guard(pull=1e-5, anchor=inverse(b)),
    "pull to inverse, 6e-5 (chosen)": lambda b: Guard(pull=6e-5, anchor=inverse(b)),
    "pull to inverse, 1e-4": lambda b: Guard(pull=1e-4, anchor=inverse(b)),
    "inverse, never adapted": lambda b: Guard(pull=1e6, anchor=inverse(b)),
}
CHOSEN = "pull to inverse, 6e-5 (chosen)"
