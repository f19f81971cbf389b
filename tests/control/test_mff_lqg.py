"""Feedforward with a regulator: gains by iteration, command by a plain loop, and its limits."""

import numpy as np
import pytest
from scipy import signal

from martths_jax import InputError, draw_plants, indices, simulate
from martths_jax.control.controllers import MFF, MFFLQG
from martths_jax.stability import spectral_radius
from tests.engine.motions import burst


@pytest.fixture(autouse=True)
def short(monkeypatch):
    """Delays are looked for in the widest range at once: one program instead of three."""
    monkeypatch.setattr(MFF, "first_lag_range", 2)


def oracle(benchmark, x_a, x_m, r, sigma, corner):
    """(N, 2) feedback's commands: both Riccati equations iterated, then the equations as they are.

    In the states of the continuous plant, which are none of the engine's.
    """
    A, B, C = benchmark.plant_continuous
    A, B = signal.cont2discrete((A, B, C, np.zeros((2, 2))), benchmark.dt)[:2]
    n, a, I2 = len(A), np.exp(-2 * np.pi * corner * benchmark.dt), np.eye(2)
    F = np.block([[A, B], [np.zeros((2, n)), a * I2]])
    G, H = np.vstack([B, 0 * I2]), np.hstack([C, 0 * I2])
    W = np.zeros_like(F)
    W[n:, n:] = (1 - a**2) * sigma**2 * I2
    X, P = H.T @ H, W
    for _ in range(6000):
        K = np.linalg.solve(r * I2 + G.T @ X @ G, G.T @ X @ F)
        X = H.T @ H + F.T @ X @ (F - G @ K)
        L = P @ H.T @ np.linalg.inv(H @ P @ H.T + benchmark.r_mm2 * I2)
        P = F @ (P - L @ H @ P) @ F.T + W
    zeta, u = np.zeros(n + 2), np.zeros_like(x_a)
    for k in range(len(x_a)):
        zeta = zeta + L @ (x_m[k] - x_a[k] - H @ zeta)
        u[k] = -K @ zeta
        zeta = F @ zeta + G @ u[k]
    return u


@pytest.mark.slow
@pytest.mark.parametrize("settings", [(0.1, 0.05, 2.0), (1.0, 0.02, 6.0)])
def test_the_regulator_is_the_optimum_of_its_model(benchmark, settings):
    r, sigma, corner = settings
    ours = MFFLQG(r=r, sigma_mm=sigma, corner_hz=corner)
    signals = simulate(benchmark, ours, draw_plants(1, seed=1), burst(0.4), keep=True).signals
    x_a, x_m, u, fed_back = (signals[n][0] for n in ("x_a", "x_m", "u", "u_fb"))
    expected = oracle(benchmark, x_a, x_m, r, sigma, corner)
    assert np.abs(expected).max() > 1e-3
    np.testing.assert_allclose(fed_back, expected, rtol=1e-6, atol=1e-9)
    c = np.asarray(MFF().prepare(benchmark).coefficients)
    past = np.vstack([np.zeros((2, 2)), x_a])
    slope = 1.5 * past[2:] - 2 * past[1:-1] + 0.5 * past[:-2]
    ahead = x_a @ c[[0, 2]] + slope @ c[[1, 3]]
    np.testing.assert_allclose(u - fed_back, ahead, rtol=1e-9, atol=1e-12)


def test_a_feedforward_without_error_is_left_alone(benchmark):
    plants = draw_plants(1, seed=1)
    one, other = (
        simulate(benchmark, c, plants, burst(0.3), keep=True).signals["u"]
        for c in (MFFLQG(sigma_mm=1e-9), MFF())
    )
    np.testing.assert_allclose(one, other, atol=1e-8)


@pytest.mark.slow
def test_the_loop_is_stable(benchmark):
    for r in (0.01, 0.1, 10.0):
        ready = MFFLQG(r=r).prepare(benchmark)
        assert spectral_radius(benchmark, ready, draw_plants(8, seed=1)).max() < 0.9995


def test_it_takes_most_of_the_plants_spread_away(benchmark):
    """What a feedforward misses differs from plant to plant; feedback knows each by its error."""
    plants, motion, names = draw_plants(64, seed=1), burst(2.0), ["J2true_1", "J2true_2"]
    ours, ahead = (
        indices(simulate(benchmark, c, plants, motion, indices=names)) for c in (MFFLQG(), MFF())
    )
    for name in names:
        assert ours[name].max() < 0.7 * ahead[name].max()  # false for NaN, which a lost trial has
        assert np.median(ours[name]) < np.median(ahead[name])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"order": 4}, r"`order` must be one of \(1, 2, 3\)"),
        ({"band_hz": 512.0}, "`band_hz` must lie above 0 and below half the sampling rate, 512 Hz"),
        ({"corner_hz": 600.0}, "`corner_hz` must lie above 0 and below half the sampling rate"),
        ({"r": 0.0}, "`r` must be positive"),
        ({"r": np.ones(2)}, "`r` must be one number, known before the run"),
        ({"sigma_mm": -1.0}, "`sigma_mm` must be positive"),
    ],
)
def test_what_cannot_be_used_is_refused(benchmark, settings, message):
    with pytest.raises(InputError, match=message):
        simulate(benchmark, MFFLQG(**settings), draw_plants(1), burst(0.3))
