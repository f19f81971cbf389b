"""The trained inverse: what ridge regression is, what the weights do, and their limits."""

import runpy
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

from martths_jax import InputError, build_benchmark, draw_plants, simulate
from martths_jax.control.controllers import NetworkInverse
from martths_jax.control.controllers.network_inverse import trained
from martths_jax.stability import spectral_radius
from martths_jax.structure.modal import to_dense
from tests.control.driven import driven, strokes
from tests.engine.motions import burst

SCRIPT = Path(__file__).parents[2] / "experiments" / "network_inverse" / "train.py"


@pytest.fixture(scope="module")
def script():
    return runpy.run_path(str(SCRIPT))


def test_the_training_is_ridge_regression(script):
    """As ordinary least squares of all rows at once, with the ridge as further rows."""
    given = {"seconds": 1, "taps": 7, "seed": 3}
    W = script["train"](count=2, ridge=0.3, **given)
    phi, u = (np.concatenate(x) for x in zip(*script["pairs"](2, 0, **given), strict=True))
    assert phi.shape == (2048, 14)
    left = np.vstack([phi, np.sqrt(0.3 * len(phi)) * np.eye(14)])
    expected = np.linalg.lstsq(left, np.vstack([u, np.zeros((14, 2))]))[0]
    np.testing.assert_allclose(W, expected, rtol=1e-7, atol=1e-9)


def test_strokes_are_those_of_the_plant(script, benchmark):
    """A plant that has been driven periodically for long, sample by sample."""
    A, B, C, _ = to_dense(benchmark.plant_model)
    u = script["commands"](np.random.default_rng(1), 512)
    x = np.zeros(len(A))
    for _ in range(6):
        found = []
        for one in u:
            found.append(C @ x)
            x = A @ x + B @ one
    expected = np.array(found)
    np.testing.assert_allclose(
        script["strokes"](benchmark.plant_model, u), expected, atol=1e-6 * np.abs(expected).max()
    )
    rows = script["rows"](expected, 3)
    np.testing.assert_array_equal(rows[5], np.r_[expected[5:2:-1, 0], expected[5:2:-1, 1]])


def test_the_weights_invert_the_nominal_plant(benchmark):
    """H W is near one where it was trained, at no delay; a sample would be 1.2 % at 2 Hz."""
    W, fs = trained()
    taps = len(W) // 2
    A, B, C, _ = to_dense(benchmark.plant_model)
    for f in (1.0, 1.5, 2.0, 2.5):
        z = np.exp(2j * np.pi * f / fs)
        H = C @ np.linalg.solve(z * np.eye(len(A)) - A, B)
        of_x = W.reshape(2, taps, 2).transpose(2, 0, 1) @ z ** -np.arange(taps)  # (command, stroke)
        assert np.abs(H @ of_x - np.eye(2)).max() < 0.06
        assert np.abs(H - np.eye(2)).max() > 0.25


def test_it_is_an_fir_filter_of_both_strokes(benchmark):
    x_a, W = strokes(120), trained()[0]
    u = driven(NetworkInverse().prepare(benchmark), benchmark, x_a)[0]
    for i in range(2):
        parts = [signal.lfilter(W[50 * j : 50 * j + 50, i], 1, x_a[:, j], axis=0) for j in (0, 1)]
        np.testing.assert_allclose(u[:, i], sum(parts), rtol=1e-9, atol=1e-9)


@pytest.mark.slow
def test_the_committed_weights_are_those_of_the_script(script):
    np.testing.assert_allclose(script["train"](), trained()[0], rtol=1e-4, atol=1e-6)


@pytest.mark.slow
def test_the_loop_is_stable(benchmark):
    ready = NetworkInverse().prepare(benchmark)
    assert spectral_radius(benchmark, ready, draw_plants(4, seed=1)).max() < 0.9995


def test_what_cannot_be_used_is_refused(benchmark):
    odd = NetworkInverse(weights=np.ones((5, 2)))
    for made, where, message in (
        (NetworkInverse(), build_benchmark(fs=512), "`weights` must be given at 512 Hz"),
        (odd, benchmark, r"`weights` must have shape \(2 n, 2\)"),
        (NetworkInverse(q=0.0), benchmark, "`q` must be positive"),
    ):
        with pytest.raises(InputError, match=message):
            simulate(where, made, draw_plants(1), burst(0.3, fs=where.fs))
