"""An estimator of one's own is one class: it runs with any controller, and in the force path."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax import Estimator, InputError, Passthrough, build_benchmark, draw_plants, simulate
from martths_jax.control.controllers.frozen import FrozenFeedforward
from tests.engine.motions import burst


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Smoothing(Estimator):
    """x_hat(k) = x_hat(k-1) + share (x_m(k) - x_hat(k-1))."""

    share: float = 0.6

    def init(self, trials):
        return jnp.zeros((2, trials))

    def correct(self, predicted, x_m):
        estimate = predicted + self.share * (x_m - predicted)
        return estimate, estimate

    def predict(self, state, u):
        return state


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Forgetful(Smoothing):
    """One that changes the shape of what it predicts."""

    def predict(self, state, u):
        return state[0]


def smoothed(measured, share):
    """The same by NumPy: (T, N, 2) of measured strokes."""
    found, last = np.zeros_like(measured), np.zeros_like(measured[:, 0])
    for k in range(measured.shape[1]):
        last = last + share * (measured[:, k] - last)
        found[:, k] = last
    return found


def test_it_runs_with_a_controller_and_makes_the_force(benchmark):
    follow = np.zeros((8, 2))
    follow[0, 0] = follow[4, 1] = 1.0
    plants, motion = draw_plants(2, seed=3), burst(0.3)
    own = FrozenFeedforward(jnp.asarray(follow), estimator=Smoothing())
    with_it = simulate(benchmark, own, plants, motion, keep=True)
    in_path = simulate(
        build_benchmark(force_from=Smoothing()), Passthrough(), plants, motion, keep=True
    )
    for result in (with_it, in_path):
        expected = smoothed(result.signals["x_m"], 0.6)
        np.testing.assert_allclose(result.signals["x_hat"], expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(with_it.signals["u"], in_path.signals["u"], rtol=1e-9, atol=1e-12)


def test_a_broken_one_is_one_sentence(benchmark):
    own = FrozenFeedforward(jnp.zeros((8, 2)), estimator=Forgetful())
    with pytest.raises(InputError, match=r"shape of its estimator's state, .* from predict"):
        simulate(benchmark, own, draw_plants(1, seed=3), burst(0.3))
