"""Wallace's prediction: the laws by hand, and a rig that is late and short by known amounts."""

import numpy as np
import pytest

from martths_jax import InputError, nominal_plant, simulate
from martths_jax.control.controllers import Polynomial, PolynomialWallace
from martths_jax.stability import spectral_radius
from tests.control.driven import driven, late_rig, strokes, tracking
from tests.engine.motions import burst


def plain(x_a, x_hat, tau, *, order, points, h, rate, gain_rate, dt):
    """Commands, delays and gains (N,) of one actuator: NumPy's fit and the documented laws."""
    rho, of_v, of_x, rows = 1.0, 0.0, 0.0, []
    for k, x in enumerate(x_a):
        past = [x_a[k - j * h] if k >= j * h else 0.0 for j in range(points)]
        times = -np.arange(points) * h * dt
        fit = np.polynomial.Polynomial.fit(times, past, order)
        v, error = fit.deriv()(0.0), x - x_hat[k]
        of_v += dt / 2.0 * (v**2 - of_v)
        of_x += dt / 2.0 * (x**2 - of_x)
        v_rms, x_rms = max(np.sqrt(of_v), 1.0), max(np.sqrt(of_x), 0.1)
        if abs(v) > 0.3 * v_rms:
            tau += dt * rate * error / v
        elif abs(v) < 0.3 * v_rms and abs(x) > x_rms:
            rho += dt * gain_rate * (abs(x) - abs(x_hat[k])) / abs(x)
        tau, rho = min(max(tau, 0.0), 0.08), min(max(rho, 0.5), 1.5)
        rows.append((rho * fit(tau), tau, rho))
    return np.array(rows).T


def test_commands_are_a_plain_loop_of_the_laws(benchmark):
    x_a = strokes(1200, trials=2)
    x_hat = 0.8 * np.concatenate([np.zeros((20, 2, 2)), x_a[:-20]])
    rates = np.array([5.0, 12.0])
    own = PolynomialWallace(rate=rates, gain_rate=6.0, order=2, points=8, spacing=4 / 1024)
    u, signals = driven(own.prepare(benchmark), benchmark, x_a, x_hat)
    for i, start in enumerate((own.tau_1, own.tau_2)):
        for trial in range(2):
            expected = plain(
                x_a[:, i, trial], x_hat[:, i, trial], start, order=2, points=8, h=4,
                rate=rates[trial], gain_rate=6.0, dt=benchmark.dt,
            )  # fmt: skip
            found = u, signals["tau"], signals["rho"]
            for one, wanted in zip(found, expected, strict=True):
                np.testing.assert_allclose(one[:, i, trial], wanted, rtol=0, atol=1e-9)
            assert np.ptp(expected[2]) > 0.05 and np.ptp(expected[1]) > 0.005


def test_delay_and_gain_of_a_rig_are_found(benchmark):
    """Late by 30 and 12 samples, and 20 % short: tau settles there, and rho at 1 / 0.8."""
    t = np.arange(10240) / benchmark.fs
    x_a = np.broadcast_to(6 * np.sin(2 * np.pi * t)[:, None], (len(t), 2)).copy()
    own = PolynomialWallace(order=3, points=8, spacing=8 / 1024).prepare(benchmark)
    x, tau = late_rig(own, benchmark, x_a, (30, 12), size=0.8)
    np.testing.assert_allclose(tau[-1], np.array([30, 12]) / 1024, rtol=0, atol=3e-4)
    assert np.abs(x[-1024:] - x_a[-1024:]).max() < 0.06
    assert np.abs(x[:1024] - x_a[:1024]).max() > 0.5


def test_without_rates_it_is_the_fixed_fit(benchmark):
    x_a = strokes()
    shape = {"order_2": 2, "points_1": 8, "points_2": 8, "spacing_1": 0.004, "spacing_2": 0.004}
    fixed, _ = driven(Polynomial(**shape).prepare(benchmark), benchmark, x_a)
    still = PolynomialWallace(rate=0.0, gain_rate=0.0, order=2, points=8, spacing=0.004)
    found, _ = driven(still.prepare(benchmark), benchmark, x_a, 0 * x_a)
    np.testing.assert_allclose(found, fixed, rtol=0, atol=1e-12)


def test_rest_moves_nothing_and_is_no_nan(benchmark):
    noise = 0.01 * np.random.default_rng(1).standard_normal((400, 2, 1))
    u, signals = driven(PolynomialWallace().prepare(benchmark), benchmark, 0 * noise, noise)
    assert not u.any() and not np.ptp(signals["tau"], axis=0).any()
    assert np.all(signals["rho"] == 1.0)


def test_a_crawl_below_the_floor_moves_nothing(benchmark):
    """At 0.25 mm/s, under 0.3 of the least rms velocity of 1 mm/s, the error is noise."""
    crawl = np.broadcast_to(0.25 * np.arange(400)[:, None, None] / 1024, (400, 2, 1))
    for speed, moves in ((1.0, False), (1.4, True)):
        still = PolynomialWallace(gain_rate=0.0).prepare(benchmark)
        _, signals = driven(still, benchmark, speed * crawl, 0 * crawl)
        assert np.ptp(signals["tau"][50:], axis=0).any() == moves


def test_the_loop_is_stable_where_it_starts(benchmark):
    own = PolynomialWallace()
    start = own.frozen(benchmark, np.array([own.tau_1, own.tau_2]))
    assert spectral_radius(benchmark, start, nominal_plant())[0] < 1


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"points": 2}, "`points` must be at least 3, as many as a polynomial of order 2"),
        ({"rate": 50.0}, r"`rate` must be a number from 0 to 30 \(1/s\)"),
        ({"gain_rate": -1.0}, r"`gain_rate` must be a number from 0 to 30 \(1/s\)"),
        ({"spacing": 0.06}, r"`spacing` must be a number from 0.0001 to 0.05 \(s\)"),
    ],
)
def test_what_cannot_be_used_is_refused(benchmark, given, message):
    with pytest.raises(InputError, match=message):
        simulate(benchmark, PolynomialWallace(**given), nominal_plant(), burst(0.3))


@pytest.mark.slow
def test_it_tracks_better_than_none_and_than_where_it_starts(benchmark):
    still = PolynomialWallace(rate=0.0, gain_rate=0.0)
    none, start, own = tracking(benchmark, still, PolynomialWallace())
    assert np.all(own < none / 3) and np.all(own < start)
