"""Darby's delay: the published law by hand, and the delay of a stroke that is late by so much."""

import numpy as np
import pytest

from martths_jax import InputError, nominal_plant, simulate
from martths_jax.control.controllers import Polynomial, PolynomialDarby
from martths_jax.stability import spectral_radius
from tests.control.driven import driven, late_rig, strokes, tracking
from tests.engine.motions import burst


def quadratic(x, k, h):
    """Value, slope and half the curvature at k, a sample, of the parabola through x(k-jh)."""
    past = [x[k - j * h] if k >= j * h else 0.0 for j in range(3)]
    curve = (past[0] - 2 * past[1] + past[2]) / (2 * h**2)
    return past[0], (past[0] - past[1]) / h + curve * h, curve


def test_commands_and_delays_are_a_plain_loop_of_the_law(benchmark):
    x_a = strokes(400)
    x_hat = np.concatenate([np.zeros((20, 2, 3)), x_a[:-20]])
    rates = np.array([0.1, 0.5, 1.0])
    own = PolynomialDarby(C_p=rates, C_v=0.05, spacing=9 / 1024).prepare(benchmark)
    u, signals = driven(own, benchmark, x_a, x_hat)
    dt = benchmark.dt
    for i, start in enumerate((40 / 1024, 26 / 1024)):
        for trial in range(3):
            x, tau = x_a[:, i, trial], start
            for k in range(len(x)):
                value, slope, curve = quadratic(x, k, 9)
                error = x[k] - x_hat[k, i, trial]
                tau += dt * rates[trial] * np.tanh(0.05 * slope / dt) * error
                tau = min(max(tau, 0.0), 0.08)
                expected = value + slope * tau / dt + curve * (tau / dt) ** 2
                np.testing.assert_allclose(signals["tau"][k, i, trial], tau, rtol=1e-12)
                np.testing.assert_allclose(u[k, i, trial], expected, rtol=0, atol=1e-9)


def test_a_constant_delay_is_found(benchmark):
    """A rig that is late by 30 and 12 samples: the delay settles there, from above and below."""
    n = 8192
    t = np.arange(n) / benchmark.fs
    x_a = np.broadcast_to(6 * np.sin(2 * np.pi * t)[:, None], (n, 2)).copy()
    own = PolynomialDarby(C_p=0.3, order=3, spacing=20 / 1024).prepare(benchmark)
    late, tau = late_rig(own, benchmark, x_a, (30, 12))
    np.testing.assert_allclose(tau[-1], np.array([30, 12]) / 1024, rtol=0, atol=1e-4)
    assert np.abs(late[-600:] - x_a[-600:]).max() < 0.02


def test_without_a_rate_it_is_the_fixed_polynomial(benchmark):
    x_a = strokes()
    shape = {"order_2": 2, "spacing_1": 26 / 1024, "tau_2": 0.02}
    fixed, _ = driven(Polynomial(**shape).prepare(benchmark), benchmark, x_a)
    moving = PolynomialDarby(C_p=0.0, tau_2=0.02).prepare(benchmark)
    found, signals = driven(moving, benchmark, x_a, 0 * x_a)
    np.testing.assert_allclose(found, fixed, rtol=0, atol=1e-12)
    assert np.ptp(signals["tau"], axis=0).max() == 0


def test_frozen_delays_are_the_fixed_polynomial(benchmark):
    x_a, tau = strokes(), np.array([[0.04, 0.03, 0.02], [0.01, 0.02, 0.03]])
    own = PolynomialDarby(spacing=15 / 1024)
    fixed = Polynomial(*tau, order_2=2, spacing_1=15 / 1024, spacing_2=15 / 1024)
    expected, _ = driven(fixed.prepare(benchmark), benchmark, x_a)
    found, _ = driven(own.frozen(benchmark, tau), benchmark, x_a)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)
    start = own.frozen(benchmark, np.array([40, 26]) / 1024)
    assert spectral_radius(benchmark, start, nominal_plant())[0] < 1


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"points": 2}, "`points` must be at least 3, as many as a polynomial of order 2"),
        ({"C_p": -1.0}, r"`C_p` must be a number of at least 0 \(1/mm\)"),
        ({"C_v": 0.0}, r"`C_v` must be a number above 0 \(s/mm\)"),
        ({"tau_1": 0.1}, r"`tau_1` must be a number from 0 to 0.08 \(s\)"),
    ],
)
def test_what_cannot_be_used_is_refused(benchmark, given, message):
    with pytest.raises(InputError, match=message):
        simulate(benchmark, PolynomialDarby(**given), nominal_plant(), burst(0.3))


@pytest.mark.slow
def test_it_tracks_better_than_none_and_than_where_it_starts(benchmark):
    none, start, own = tracking(benchmark, PolynomialDarby(C_p=0.0), PolynomialDarby())
    assert np.all(own < none / 3) and np.all(own < start)
