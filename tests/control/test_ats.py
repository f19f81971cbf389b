"""The adaptive time series, by window and by recursion, beside the published equations."""

import numpy as np
import pytest
from scipy import signal

from martths_jax import InputError, build_benchmark
from martths_jax.control.controllers import ats
from tests.control.pieces_oracle import engine, textbook

FS, DELAY = 1024.0, (0.002, 0.001)
MATRIX = np.array([[1, 0, 0, 0], [1.5, -2, 0.5, 0], [2, -5, 4, -1]])  # x, dt x', dt^2 x''
POWERS = FS ** np.arange(3.0)
START = np.array([[1.0, 1.0], np.multiply(DELAY, FS), np.multiply(DELAY, FS) ** 2 / 2])
B, A = signal.butter(6, 150.0, fs=FS)


def both(x):
    return signal.lfilter(B, A, x, axis=0)


def alike(found, expected):
    for name, a, b in zip(("C", "u", "held"), found, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-11 * np.abs(b).max(), err_msg=name)
    C, held = expected[0], expected[2]
    assert np.ptp(C[-1], axis=-1).max() > 1e-3 and 0 < held[-1].max() < 100


def limited(C, last, published, unit):
    """Published rate and bounds; `unit` makes a_j a coefficient."""
    low, high, rate = (np.array(published[n]) * unit for n in ("low", "high", "rate"))
    change = np.clip(C[:, 0] - last[:, 0], -rate / FS, rate / FS)
    return np.clip(last[:, 0] + change, low, high)[:, None]


@pytest.mark.parametrize("ridge", [0.0, 0.01])
def test_ats_is_the_published_window_fit(benchmark, ridge):
    """Every fourth of the last 32 samples; held while little moves; published bounds, rates."""
    made = ats.ENTRY.build(
        benchmark, preset="chae2013", window=32 / FS, every=4, cutoff=150.0, delay=DELAY,
        threshold=0.7, ridge=ridge,
    )  # fmt: skip
    # lambda N |b - b_0|^2, b_j = a_j / (0.02 s)^j.
    L = np.diag(ridge * 8 * (0.02 * FS) ** (-2.0 * np.arange(3)))
    slow = {}

    def learn(k, phi, u, last, part):
        mean = slow[part] = (0.0 if k == 0 else slow[part]) * (1 - 1 / 32) + abs(phi[-1, 0]) / 32
        if k < 32 + 3:
            return last, 0
        used = [j for j in range(k - 31, k + 1) if j % 4 == 0]
        G = phi[used].T @ phi[used] + L
        C = np.linalg.solve(G, phi[used].T @ u[used] + L @ START[:, [part]])
        if mean <= 0.7:
            return last, 1
        return limited(C, last, ats.PRESETS["chae2013"], POWERS), 0

    alike(engine(made, benchmark), textbook(MATRIX, False, learn, start=START, both=both))


def test_presets_are_the_published_numbers(benchmark):
    """Window, samples used, threshold, filter, bounds and rates of the authors' file."""
    wide, narrow = (ats.ENTRY.build(benchmark, preset=p) for p in ("chae2013", "chae2013-narrow"))
    for one in (wide, narrow):
        threshold = one.guards[2]
        assert (one.fit.nb, one.fit.every, threshold.least) == (1024, 16, 0.254)
        np.testing.assert_allclose(one.low_pass.b, signal.butter(6, 20.0, fs=FS)[0], rtol=1e-12)
    for one, low, high, rate in (
        (wide, [0.7, 0, 0], [1.3, 0.08, 0.0032], [2, 0.05, 0.001]),
        (narrow, [0.9, 0, 0], [1.1, 0.06, 0.0032], [0.2, 0.005, 0.0001]),
    ):
        np.testing.assert_allclose(one.guards[4].low / POWERS, low)
        np.testing.assert_allclose(one.guards[4].high / POWERS, high)
        np.testing.assert_allclose(one.guards[3].most / POWERS * FS, rate)


def test_a_start_is_a_taylor_series(benchmark):
    """a_1 = delay and a_2 = delay^2 / 2 lead a parabola by the delay."""
    start = np.asarray(ats.ENTRY.build(benchmark, delay=(0.03, 0.01)).start)
    t = np.arange(4)[::-1] / FS + 0.4  # k - 3 ... k, the newest first
    for side, delay in enumerate((0.03, 0.01)):
        phi = MATRIX @ (2.0 - t + 3 * t**2)
        ahead = t[0] + delay
        np.testing.assert_allclose(phi @ start[:, side], 2.0 - ahead + 3 * ahead**2, rtol=1e-10)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"preset": "chae"}, "`preset` must be one of 'benchmark|`preset` must be one of 'chae"),
        (
            {"window": 0.003},
            "`window` must hold at least 4 pairs for 3 unknowns, but got 3 samples",
        ),
        ({"window": 0.03, "every": 16}, "`window` must hold at least 4 pairs"),
        ({"cutoff": 600.0}, "`cutoff` must lie between 0 and 512 Hz"),
        ({"delay": (0.02, 0.2)}, r"`delay` must be 2 numbers from 0 to 0.08 \(s\)"),
    ],
)
def test_settings_that_cannot_be_used(benchmark, settings, message):
    with pytest.raises(InputError, match=message):
        ats.ENTRY.build(benchmark, **settings)


def test_a_window_is_cut_to_whole_steps():
    made = ats.ENTRY.build(build_benchmark(fs=1000), window=1.0, every=16)
    assert (made.fit.nb, made.fit.every) == (992, 16)
