"""The compared guards, each as a controller for a benchmark."""

from __future__ import annotations

from functools import partial

import numpy as np

from martths_jax import ADFC
from martths_jax.control.adaptive import (
    ConditionGate,
    ExcitationGate,
    Fading,
    NoiseRemoval,
    PullToLast,
    RateLimit,
    ShapedPull,
    Window,
    noise_covariance,
)
from martths_jax.control.adaptive.inverse import nominal_inverse
from martths_jax.control.controllers import AdaptiveFeedforward

NB = 1024


def inverse(bench) -> np.ndarray:
    """The package's anchor."""
    matrix = AdaptiveFeedforward().regressor.matrix
    return nominal_inverse(bench.plant_model, bench.fs, matrix)


def guarded(bench, *guards, fit=None) -> AdaptiveFeedforward:
    """ADFC's regressor and window with other guards; a fit that is ill is never used."""
    return AdaptiveFeedforward(fit=fit or Window(NB), guards=(*guards, ConditionGate()))


def noise_shaped(bench) -> AdaptiveFeedforward:
    """Each regressor is pulled as strongly as a second of noise makes it."""
    weight = bench.fs * np.diag(noise_covariance(bench, guarded(bench).prepare(bench))[0])
    return guarded(bench, ShapedPull(weight, inverse(bench)))


def recursive(bench) -> AdaptiveFeedforward:
    return guarded(bench, fit=Fading(forgetting=1 - 1 / NB, wait=NB))


def pulled(pull, bench, **given) -> ADFC:
    return ADFC(pull=pull, **given)


CANDIDATES = {
    "literal": partial(pulled, 0.0),
    "pull to C_0, 1e-6, q = 1e-5": partial(pulled, 1e-6, q=1e-5),
    "pull to C_0, 1e-5": partial(pulled, 1e-5),
    "pull to last C, 1e-2": lambda b: guarded(b, PullToLast(1e-2)),
    "excitation gate, pivots > 10 x noise": lambda b: guarded(b, ExcitationGate(10.0)),
    "rate limit, 0.01 a sample": lambda b: guarded(b, RateLimit(0.01)),
    "recursive, forgetting 1 - 1/1024": recursive,
    "errors in variables (noise covariance removed)": lambda b: guarded(b, NoiseRemoval()),
    "noise-shaped pull to inverse": noise_shaped,
    "pull to inverse, 1e-5": partial(pulled, 1e-5, towards="inverse"),
    "pull to inverse, 6e-5 (chosen)": lambda b: ADFC(),
    "pull to inverse, 1e-4": partial(pulled, 1e-4, towards="inverse"),
    "inverse, never adapted": partial(pulled, 1e6, towards="inverse"),
}
CHOSEN = "pull to inverse, 6e-5 (chosen)"
