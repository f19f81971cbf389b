"""Inverse of the plant by a linear network that was trained on drawn plants.

    u(k) = W' (x_a,1(k), x_a,1(k-1), ..., x_a,1(k-49), x_a,2(k), ..., x_a,2(k-49))

One layer without a nonlinearity, since the plants are linear: an FIR filter of both strokes, by
ridge regression on strokes and commands of 64 plants of the benchmark's uncertainty, driven by
noise of 5 mm up to 3 Hz and heard through the sensors.  It was trained on u(k) against strokes up
to k, which cannot have felt it, and so learnt to look a sample ahead.  Nothing adapts online: what
it knows of a plant is what all have in common.

After the inverse networks of Shangguan et al. 2025, of which this is the linear case.  Weights,
script, seed and time: ``experiments/network_inverse``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.arguments import check_positive, complaint
from martths_jax.control.adaptive.taps import fir
from martths_jax.control.base import Controller
from martths_jax.control.controllers.frozen import FrozenFeedforward
from martths_jax.control.controllers.mff import PROCESS_NOISE
from martths_jax.control.entry import Entry
from martths_jax.control.estimators import design_kalman

WEIGHTS = Path(__file__).with_name("network_inverse.npz")


@lru_cache(maxsize=1)
def trained() -> tuple[np.ndarray, float]:
    """(2 n, 2) trained weights, n taps a stroke, and the sampling rate that they belong to [Hz]."""
    with np.load(WEIGHTS, allow_pickle=False) as file:
        return file["weights"], float(file["fs"])


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class NetworkInverse(Controller):
    """The equation above.

    Attributes:
        q: process noise of the Kalman filter [mm^2].
        weights: (2 n, 2) or (2 n, 2, T); None takes the trained ones, at 1024 Hz only.
        estimator: the Kalman filter, designed by ``prepare``; the network does not use it.
    """

    q: jax.Array | float = 3e-5
    weights: jax.Array | None = None
    estimator: Any = None

    actuators_needed = 2
    name = "network-inverse"
    shared_axes = MappingProxyType({"q": 0, "weights": 2})

    @property
    def network(self) -> FrozenFeedforward:
        """The same once it is prepared, as a feedforward."""
        return FrozenFeedforward(self.weights, self.estimator, fir(self.weights.shape[0] // 2))

    def problems(self, benchmark):
        found = check_positive("q", self.q)
        if self.weights is None:
            fs = trained()[1]
            wanted = f"be given at {benchmark.fs:g} Hz, since the trained ones belong to {fs:g} Hz"
            return found + complaint(benchmark.fs == fs, "weights", wanted, "None")
        shape = np.shape(self.weights)
        good = len(shape) in (2, 3) and shape[0] % 2 == 0 and shape[1] == 2
        return found + complaint(good, "weights", "have shape (2 n, 2)", f"shape {shape}")

    def prepare(self, benchmark):
        weights = trained()[0] if self.weights is None else self.weights
        return replace(
            self,
            weights=jnp.asarray(weights, dtype=float),
            estimator=design_kalman(benchmark.plant_model, self.q, benchmark.r_mm2),
        )

    def init(self, trials):
        return self.network.init(trials)

    def step(self, state, seen):
        return self.network.step(state, seen)


ENTRY = Entry(
    name="network-inverse",
    controller=NetworkInverse,
    label="Network inverse",
    paper="after Shangguan, Zhou, Wang & Yao 2025, inverse network; the linear case",
    parameters=(PROCESS_NOISE,),
)
