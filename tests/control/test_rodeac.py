"""RoDeAC against a plain loop of its published equations."""

import numpy as np
import pytest
from scipy import signal

from martths_jax import InputError, Passthrough, build_benchmark, draw_plants, indices, simulate
from martths_jax.control.adaptive import Recursive, butterworth, fir
from martths_jax.control.controllers import AdaptiveFeedforward, RoDeAC
from martths_jax.control.controllers.rodeac import START, prior, solve_loop
from tests.engine.motions import burst


@pytest.fixture(autouse=True)
def short(monkeypatch):
    """Delays are looked for in the widest range at once: one program instead of three."""
    for kind in (AdaptiveFeedforward, Passthrough, RoDeAC):
        monkeypatch.setattr(kind, "first_lag_range", 2)


def published(x_a, x_m, P, mu=1.0):
    """Commands and taps of an actuator: the equations as they stand, the loop by iteration."""
    b, a = signal.butter(4, 20, fs=1024)
    samples, column = len(x_a), START
    y = signal.lfilter(b, a, x_m, axis=0)
    u, taps = np.zeros_like(x_a), np.zeros((samples, 4, 2))
    back = lambda x, k: np.array([x[k - j] if k >= j else 0.0 for j in range(4)])  # noqa: E731
    for i in range(2):
        theta, Pi, filtered = column[:, i], P[i].copy(), np.zeros(samples)
        for k in range(samples):
            phi, q = back(y[:, i], k), back(x_a[:, i], k)
            g = Pi @ phi / (mu + phi @ Pi @ phi)
            Pi = (Pi - np.outer(g, phi @ Pi)) / mu
            past = sum(b[j] * u[k - j, i] - a[j] * filtered[k - j] for j in range(1, 5) if k >= j)
            new = theta
            for _ in range(60):
                u[k, i] = new @ q
                filtered[k] = b[0] * u[k, i] + past
                new = theta + g * (filtered[k] - phi @ theta)
            theta = taps[k, :, i] = new
    return u, taps


@pytest.mark.parametrize(("units", "scale"), [("published", 1.0), ("consistent", 1e-6)])
def test_the_published_equations(benchmark, units, scale):
    result = simulate(benchmark, RoDeAC(units=units), draw_plants(1, seed=1), burst(0.4), keep=True)
    x_a, x_m = (result.signals[n][0] for n in ("x_a", "x_m"))
    u, taps = published(x_a, x_m, scale * prior())
    np.testing.assert_array_equal(result.signals["x_hat"][0], x_m)
    np.testing.assert_allclose(result.signals["C_A"][0], taps, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(result.signals["u"][0], u, rtol=1e-7, atol=1e-8)


def test_taps_and_command_solve_both_equations():
    """The closed form put back into the two equations that it comes from."""
    rng = np.random.default_rng(5)
    theta, g, phi, q = rng.normal(size=(4, 4, 3))
    b0, h = 0.3, rng.normal(size=3)
    new, u = solve_loop(theta, g, phi, q, b0, h)
    np.testing.assert_allclose(np.sum(new * q, axis=0), u, rtol=1e-12)
    expected = theta + g * (b0 * u + h - np.sum(phi * theta, axis=0))
    np.testing.assert_allclose(new, expected, rtol=1e-12)


@pytest.mark.slow
def test_paired_with_the_command_before_it_is_a_choice_of_pieces(benchmark):
    pieces = AdaptiveFeedforward(
        fir(4), Recursive(prior(), 0.9995), start=START, joint=False, learns_from="measurement",
        low_pass=butterworth(4, 20.0, 1024.0), q=1e-4,
    )  # fmt: skip
    own = RoDeAC(pairing="previous", forgetting=0.9995, q=1e-4)
    one, other = (
        simulate(benchmark, c, draw_plants(2, seed=1), burst(0.3), keep=True) for c in (pieces, own)
    )
    for name in ("C_A", "u", "x_hat"):
        np.testing.assert_array_equal(one.signals[name], other.signals[name])


@pytest.mark.slow
@pytest.mark.parametrize("pairing", ["same", "previous"])
def test_numbers_may_differ_from_trial_to_trial(benchmark, pairing):
    plants, scales, mu = draw_plants(2, seed=1), np.array([1e-3, 1.0]), np.array([1.0, 0.999])
    together = RoDeAC(prior_scale=scales, forgetting=mu, pairing=pairing)
    each = [
        RoDeAC(prior_scale=float(s), forgetting=float(m), pairing=pairing)
        for s, m in zip(scales, mu, strict=True)
    ]
    one, other = (simulate(benchmark, c, plants, burst(0.3), keep=True) for c in (together, each))
    np.testing.assert_allclose(one.signals["C_A"], other.signals["C_A"], rtol=1e-9, atol=1e-12)


def test_the_published_start(benchmark):
    """Sums of the taps and leads as the package has them."""
    ready = RoDeAC().prepare(benchmark)
    np.testing.assert_allclose(np.sum(ready.start, axis=0), [0.915, 1.045], atol=1e-3)
    leads = -np.arange(4) @ START / START.sum(axis=0)
    np.testing.assert_allclose(leads, [17.4, 17.0], atol=0.1)
    assert np.all(np.linalg.eigvalsh(np.asarray(ready.prior)) > 0)
    halved = RoDeAC(units="consistent", prior_scale=0.5).prepare(benchmark).prior
    np.testing.assert_allclose(halved, 0.5e-6 * prior(), rtol=1e-15)


def test_it_tracks_uncertain_plants_better_than_nothing(benchmark):
    plants, motion, names = draw_plants(64, seed=1), burst(2.0), ["J2true_1", "J2true_2"]
    ours, none = (
        indices(result)
        for result in (
            simulate(benchmark, c, plants, motion, indices=names) for c in (RoDeAC(), Passthrough())
        )
    )
    for name in names:
        assert np.all(ours[name] < 0.5 * none[name])  # false for NaN, which a lost trial has


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"units": "mm"}, r"`units` must be one of \('published', 'consistent'\), but got 'mm'"),
        ({"pairing": "next"}, "`pairing` must be one of"),
        ({"prior_scale": 0.0}, "`prior_scale` must be positive"),
        ({"forgetting": 1.1}, "`forgetting` must be above 0 and at most 1"),
        ({"cutoff_hz": 512.0}, "`cutoff_hz` must lie between 0 and half the sampling rate, 512 Hz"),
        ({"q": -1.0}, "`q` must be positive"),
        ({"prior": np.eye(3)}, r"`fit.prior` must have shape .*\(4, 4\)"),
        ({"start": np.zeros((8, 2))}, r"`start` must have shape \(4, 2\)"),
    ],
)
def test_what_cannot_be_used_is_refused(benchmark, settings, message):
    with pytest.raises(InputError, match=message):
        simulate(benchmark, RoDeAC(**settings), draw_plants(1), burst(0.3))


def test_the_published_taps_belong_to_one_rate():
    with pytest.raises(InputError, match="`start` must be given at 512 Hz, since the published"):
        simulate(build_benchmark(fs=512), RoDeAC(), draw_plants(1), burst(0.3, fs=512))
