"""The two stages beside a plain loop, on a rig that is late, and frozen as one filter."""

import numpy as np
import pytest
from scipy import signal

from martths_jax import InputError, draw_plants, simulate
from martths_jax.control.controllers import Polynomial, TwoStage
from martths_jax.stability import spectral_radius
from tests.control.driven import driven, late_rig, strokes
from tests.control.pieces_oracle import TARGET, engine, textbook
from tests.engine.motions import burst

FS = 1024.0
#: x, s D x, s^2 D^2 x with s = 0.02 s.
ROWS = np.array([[1, 0, 0], [1, -1, 0], [1, -2, 1]]) * (0.02 * FS) ** np.arange(3.0)[:, None]


def lagrange(order, tau, h):
    """Taps of the polynomial through k, k - h, ..., evaluated tau samples ahead."""
    taps = np.zeros(order * h + 1)
    for j in range(order + 1):
        others = [l for l in range(order + 1) if l != j]
        taps[j * h] = np.prod([(tau + l * h) / ((l - j) * h) for l in others])
    return taps


@pytest.mark.parametrize("order", [1, 2])
def test_the_second_stage_is_a_filter_behind_the_first(benchmark, order):
    """One FIR row a column, F on both sides, and the Kalman filter of a random walk."""
    tau, h, spread, walk, error, least = 2.5, 3, 0.4, 0.8, 0.5, 0.6
    made = TwoStage(tau_1=tau / FS, tau_2=tau / FS, order=order, spacing=h / FS, spread=spread,
                    walk=walk, error=error, threshold=least, cutoff=150.0)  # fmt: skip
    rows, ahead = (
        np.array([np.convolve(lagrange(order, one, h), row) for row in ROWS])
        for one in (tau, tau + 1)
    )
    b, a = signal.butter(6, 150.0, fs=FS)
    kept = {}

    def learn(k, phi, u, last, part):
        if k == 0:
            kept[part] = spread**2 * np.eye(3)
        row, P = phi[-1], kept[part]
        if k < 2 or abs(row[0]) <= least:
            return last, int(k >= 2)
        gain = P @ row / (error**2 + row @ P @ row)
        rest = np.eye(3) - np.outer(gain, row)
        kept[part] = rest @ P @ rest.T + error**2 * np.outer(gain, gain) + walk**2 / FS * np.eye(3)
        return last + np.outer(gain, u[-1] - row @ last), 0

    start = np.array([[1.0, 1.0], [0, 0], [0, 0]])
    expected = textbook(
        rows, False, learn, start=start, both=lambda x: signal.lfilter(b, a, x, axis=0),
        of_targets=ahead,
    )  # fmt: skip
    found = engine(made, benchmark)
    for name, one, other in zip(("C", "u", "held"), found, expected, strict=True):
        scale = np.abs(other).max()
        np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-9 * scale, err_msg=name)
    assert 0 < expected[2][-1].min() and expected[2][-1].max() < 2 * len(TARGET) - 10


def test_alone_the_first_stage_is_the_polynomial(benchmark):
    """Each actuator with its own delay and a sample; theta = (1, 0, 0) that does not move."""
    x_a = strokes(120)
    one = TwoStage(tau_1=0.03, tau_2=0.01, spacing=0.02, order=2, threshold=1e9)
    other = Polynomial(tau_1=0.03 + 1 / FS, tau_2=0.01 + 1 / FS, spacing_1=0.02, spacing_2=0.02,
                       order_1=2, order_2=2)  # fmt: skip
    u, expected = (driven(c.prepare(benchmark), benchmark, x_a)[0] for c in (one, other))
    np.testing.assert_allclose(u, expected, rtol=1e-12, atol=1e-12)


def test_what_the_first_leaves_the_second_takes(benchmark):
    """A rig of gain 0.8, later than the first stage knows; it would be led twice as far if the
    second stage learnt from the strokes themselves.
    """
    t = np.arange(8 * 1024) / FS
    wave = np.sin(2 * np.pi * 2.0 * t)
    x_a = np.stack([wave, 2 * wave], axis=1)
    made = TwoStage(tau_1=30 / FS, tau_2=20 / FS, walk=1e-2).prepare(benchmark)
    x, theta = late_rig(made, benchmark, x_a, (35, 23), size=0.8, signal="C_A")
    last = slice(-1024, None)
    reached = np.mean((x - x_a)[last] ** 2, axis=0) / np.mean(x_a[last] ** 2, axis=0)
    assert np.sqrt(reached).max() < 0.01, "a sample of delay is 1.2 %"
    # Strokes are 5 - 1 and 3 - 1 samples later than tau: theta_1 / theta_0 leads by them.
    led = theta[-1, 1] / theta[-1, 0] * 0.02 * FS
    assert 2 < led[1] < led[0] < 8


def test_frozen_it_is_one_filter(benchmark):
    x_a, theta = strokes(150), np.array([[1.1, 0.9], [0.2, -0.1], [0.05, 0.02]])
    made = TwoStage(tau_1=0.04, tau_2=0.0255, spacing=0.02, order=2)
    u = driven(made.frozen(benchmark, theta), benchmark, x_a)[0]
    for i, tau in enumerate((0.04 * FS, 0.0255 * FS)):
        taps = np.convolve(lagrange(2, tau + 1, 20), theta[:, i] @ ROWS)
        np.testing.assert_allclose(
            u[:, i], signal.lfilter(taps, 1, x_a[:, i], axis=0), rtol=1e-9, atol=1e-9
        )


@pytest.mark.slow
def test_the_loop_is_stable_where_it_starts_and_where_it_ends(benchmark):
    plants = draw_plants(4, seed=1)
    made = TwoStage()
    C = simulate(benchmark, made, plants, burst(2.0), keep=True).signals["C_A"]
    for theta in (C[:, 0], C[:, -1]):
        frozen = made.frozen(benchmark, np.moveaxis(theta, 0, -1))
        assert spectral_radius(benchmark, frozen, plants).max() < 0.9999


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"order": 4}, "`order` must be a whole number from 1 to 3, but got 4"),
        ({"cutoff": 512.0}, "`cutoff` must lie below 512 Hz, half the sampling rate"),
        ({"tau_1": -0.01}, r"`tau_1` must be a number from 0 to 0.08 \(s\)"),
        ({"spacing": 2e-4}, "`spacing` must be at least half a sample"),
    ],
)
def test_what_cannot_be_used_is_refused(benchmark, settings, message):
    with pytest.raises(InputError, match=message):
        simulate(benchmark, TwoStage(**settings), draw_plants(1), burst(0.3))
