"""Decoupling control: what D does to the plant, the fits and the command by other routes."""

import numpy as np
import pytest
from scipy import signal

from martths_jax import InputError, Passthrough, draw_plants, indices, simulate
from martths_jax.control.controllers import Decoupling
from martths_jax.stability import spectral_radius
from tests.engine.motions import burst


@pytest.fixture(autouse=True)
def short(monkeypatch):
    """Delays are looked for in the widest range at once: one program instead of three."""
    for kind in (Passthrough, Decoupling):
        monkeypatch.setattr(kind, "first_lag_range", 2)


def plant(benchmark, f):
    """(points, 2, 2) response at frequencies, and (points,) value of dt d/dt there."""
    A, B, C = benchmark.plant_continuous
    A, B = signal.cont2discrete((A, B, C, np.zeros((2, 2))), benchmark.dt)[:2]
    z = np.exp(2j * np.pi * np.asarray(f) * benchmark.dt)
    H = np.array([C @ np.linalg.solve(one * np.eye(len(A)) - A, B) for one in z])
    return H, 1.5 - 2 / z + 0.5 / z**2, z


def test_static_decoupling_is_the_inverse_at_rest(benchmark):
    A, B, C = benchmark.plant_continuous
    ready = Decoupling(form="static", lead_ms=(60.0, 25.0)).prepare(benchmark)
    at_rest = -C @ np.linalg.solve(A, B) @ np.asarray(ready.D[0])
    np.testing.assert_allclose(at_rest, np.eye(2), atol=1e-9)
    assert not np.any(ready.D[1])
    np.testing.assert_allclose(ready.lead, [[1, 1], [61.44, 25.6]], rtol=1e-12)


def test_dynamic_decoupling_takes_the_interaction_out(benchmark):
    """Least over the band, one at rest, and at the motion's 2 Hz a fraction of the plant's own."""
    ready = Decoupling(band_hz=5.0).prepare(benchmark)
    D = np.asarray(ready.D)
    H, s, _ = plant(benchmark, np.arange(1, 401) / 80)
    for i, j in ((0, 1), (1, 0)):
        rows = H[:, i, i, None] * np.stack([np.ones_like(s), s], axis=1)
        c = np.linalg.lstsq(
            np.vstack([rows.real, rows.imag]), -np.r_[H[:, i, j].real, H[:, i, j].imag]
        )[0]
        np.testing.assert_allclose(D[:, i, j] / D[0, j, j], c, rtol=1e-6)
    H, s, _ = plant(benchmark, [0.0, 2.0])
    whole = H @ (D[0] + s[:, None, None] * D[1])
    np.testing.assert_allclose(np.diag(whole[0]), 1.0, atol=1e-9)
    for i, j in ((0, 1), (1, 0)):
        assert abs(whole[1, i, j]) < 0.35 * abs(H[1, i, j])


@pytest.mark.parametrize("form", ["static", "dynamic"])
def test_leads_are_least_squares_over_both_inputs(benchmark, form):
    ready = Decoupling(form=form, band_hz=5.0).prepare(benchmark)
    D = np.asarray(ready.D)
    H, s, z = plant(benchmark, np.arange(1, 401) / 80)
    dynamic = D[0] + s[:, None, None] * D[1]
    channels = D[0] @ H if form == "static" else H @ dynamic
    difference = np.array([[1, 0, 0], [1.5, -2, 0.5]])
    for i in (0, 1):
        gram, right = 400e-9 * difference @ difference.T, np.zeros(2)
        for j in (0, 1):
            rows = channels[:, i, j, None] * np.stack([np.ones_like(s), s], axis=1)
            gram += (rows.conj().T @ rows).real
            right += (i == j) * (rows.conj().T @ (1 / z)).real
        expected = np.linalg.solve(gram, right)
        np.testing.assert_allclose(np.asarray(ready.lead)[:, i], expected, rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("form", ["static", "dynamic"])
def test_the_command_is_what_the_equations_say(benchmark, form):
    ours = Decoupling(form=form)
    signals = simulate(benchmark, ours, draw_plants(1, seed=1), burst(0.3), keep=True).signals
    ready = ours.prepare(benchmark)
    D, lead, x_a = np.asarray(ready.D), np.asarray(ready.lead), signals["x_a"][0]

    def slope(x):
        past = np.vstack([np.zeros((2, 2)), x])
        return 1.5 * past[2:] - 2 * past[1:-1] + 0.5 * past[:-2]

    compensated = lambda x: lead[0] * x + lead[1] * slope(x)  # noqa: E731
    if form == "static":
        expected = compensated(x_a @ D[0].T)
    else:
        v = compensated(x_a)
        expected = v @ D[0].T + slope(v) @ D[1].T
    np.testing.assert_allclose(signals["u"][0], expected, rtol=1e-9, atol=1e-11)


@pytest.mark.slow
@pytest.mark.parametrize("settings", [{"form": "static"}, {}, {"band_hz": 3.5}])
def test_the_loop_is_stable(benchmark, settings):
    ready = Decoupling(**settings).prepare(benchmark)
    assert spectral_radius(benchmark, ready, draw_plants(4, seed=1)).max() < 0.9996


def test_it_tracks_uncertain_plants_better_than_nothing(benchmark):
    plants, motion, names = draw_plants(64, seed=1), burst(2.0), ["J2true_1", "J2true_2"]
    static, dynamic, none = (
        indices(simulate(benchmark, c, plants, motion, indices=names))
        for c in (Decoupling(form="static"), Decoupling(), Passthrough())
    )
    for name in names:  # false for NaN, which a lost trial has
        assert np.all(static[name] < 0.6 * none[name])
        assert np.all(dynamic[name] < 0.6 * none[name])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"form": "none"}, r"`form` must be one of \('static', 'dynamic'\)"),
        ({"band_hz": 512.0}, "`band_hz` must lie above 0 and below half the sampling rate, 512 Hz"),
        ({"band_hz": 3.0}, "`band_hz` must be at least 3.5 Hz with a dynamic decoupling"),
        ({"lead_ms": (1.0, 2.0, 3.0)}, r"`lead_ms` must be two numbers \(ms\)"),
        ({"q": 0.0}, "`q` must be positive"),
    ],
)
def test_what_cannot_be_used_is_refused(benchmark, settings, message):
    with pytest.raises(InputError, match=message):
        simulate(benchmark, Decoupling(**settings), draw_plants(1), burst(0.3))
