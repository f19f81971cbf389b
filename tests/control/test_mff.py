"""Model-based feedforward: its fit against another route to it, its command against a loop."""

import numpy as np
import pytest
from scipy import signal

from martths_jax import (
    InputError,
    Passthrough,
    build_benchmark,
    draw_plants,
    indices,
    simulate,
)
from martths_jax.control.controllers import MFF
from martths_jax.stability import spectral_radius
from tests.engine.motions import burst

#: Differences of second order, rows of dt^j x^(j).
ROWS = np.array([[1, 0, 0, 0, 0], [1.5, -2, 0.5, 0, 0], [2, -5, 4, -1, 0], [2.5, -9, 12, -7, 1.5]])


@pytest.fixture(autouse=True)
def short(monkeypatch):
    """Delays are looked for in the widest range at once: one program instead of three."""
    for kind in (Passthrough, MFF):
        monkeypatch.setattr(kind, "first_lag_range", 2)


@pytest.mark.parametrize(("order", "band"), [(1, 3.0), (2, 5.0), (3, 3.0)])
def test_least_squares_over_frequencies(benchmark, order, band):
    """Rows of real and imaginary parts, one a frequency and actuator, by an orthogonal solver."""
    A, B, C = benchmark.plant_continuous
    A, B = signal.cont2discrete((A, B, C, np.zeros((2, 2))), benchmark.dt)[:2]
    D = ROWS[: order + 1]
    z = np.exp(2j * np.pi * band * np.arange(1, 401) / 400 * benchmark.dt)
    rows, values = [], []
    for one in z:
        H = C @ np.linalg.solve(one * np.eye(len(A)) - A, B)
        phi = np.kron(np.eye(2), (D @ one ** -np.arange(5.0))[:, None]) @ H  # (2 n, command)
        for i, e in enumerate(np.eye(2)):
            rows += [phi[:, i].real, phi[:, i].imag]
            values += [e * (1 / one).real, e * (1 / one).imag]  # u(k-1)
    noise = np.sqrt(400 * 1e-9) * np.kron(np.eye(2), D.T)
    rows, values = np.vstack([*rows, noise]), np.vstack([*values, np.zeros((len(noise), 2))])
    expected = np.linalg.lstsq(rows, values)[0]
    made = np.asarray(MFF(order, band).prepare(benchmark).coefficients)
    np.testing.assert_allclose(made, expected, rtol=1e-6, atol=1e-7 * np.abs(expected).max())


def test_a_band_near_standstill_gives_the_static_inverse(benchmark):
    A, B, C = benchmark.plant_continuous
    static = np.linalg.inv(-C @ np.linalg.solve(A, B))
    made = np.asarray(MFF(1, 0.2).prepare(benchmark).coefficients)[[0, 2]].T
    np.testing.assert_allclose(made, static, rtol=2e-3)


@pytest.mark.parametrize("order", [1, 3])
def test_the_command_is_the_sum_of_derivatives(benchmark, order):
    ours = MFF(order)
    result = simulate(benchmark, ours, draw_plants(1, seed=1), burst(0.3), keep=True)
    x_a = np.vstack([np.zeros((4, 2)), result.signals["x_a"][0]])
    c = np.asarray(ours.prepare(benchmark).coefficients).reshape(2, order + 1, 2)
    dt = benchmark.dt
    expected = np.zeros((len(x_a) - 4, 2))
    for k in range(len(expected)):
        newest = x_a[k : k + 5][::-1]
        for j in range(order + 1):
            A_j = c[:, j].T * dt**j
            expected[k] += A_j @ (ROWS[j] @ newest / dt**j)
    np.testing.assert_allclose(result.signals["u"][0], expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("order", "band"), [(1, 3.0), (3, 3.0), (3, 15.0)])
def test_the_loop_is_stable(benchmark, order, band):
    ready = MFF(order, band).prepare(benchmark)
    assert spectral_radius(benchmark, ready, draw_plants(4, seed=1)).max() < 0.9995


def test_it_tracks_uncertain_plants_better_than_nothing(benchmark):
    plants, motion, names = draw_plants(64, seed=1), burst(2.0), ["J2true_1", "J2true_2"]
    ours, none = (
        indices(simulate(benchmark, c, plants, motion, indices=names))
        for c in (MFF(), Passthrough())
    )
    for name in names:
        assert np.all(ours[name] < 0.5 * none[name])  # false for NaN, which a lost trial has


@pytest.mark.slow
def test_bands_may_differ_from_trial_to_trial(benchmark):
    plants, bands = draw_plants(2, seed=1), np.array([3.0, 8.0])
    together, each = (
        simulate(benchmark, c, plants, burst(0.3), keep=True).signals["u"]
        for c in (MFF(band_hz=bands), [MFF(band_hz=float(b)) for b in bands])
    )
    np.testing.assert_array_equal(together, each)
    assert np.abs(together[0] - together[1]).max() > 1e-3


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"order": 4}, r"`order` must be one of \(1, 2, 3\), but got 4"),
        ({"band_hz": 0.0}, "`band_hz` must lie above 0 and below half the sampling rate, 80.5 Hz"),
        ({"band_hz": 81.0}, "below half the sampling rate, 80.5 Hz, but got 81.0"),
        ({"q": -1.0}, "`q` must be positive"),
    ],
)
def test_what_cannot_be_used_is_refused(settings, message):
    with pytest.raises(InputError, match=message):
        simulate(build_benchmark(fs=161), MFF(**settings), draw_plants(1), burst(0.3, fs=161))
