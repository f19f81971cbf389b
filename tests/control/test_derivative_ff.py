"""Derivative feedforward: Taylor's series of polynomials, and the published differences."""

import numpy as np
import pytest

from martths_jax import InputError, nominal_plant, simulate
from martths_jax.control.controllers import DerivativeFeedforward
from martths_jax.stability import spectral_radius
from tests.control.driven import driven, strokes, tracking
from tests.engine.motions import burst


def test_a_parabola_is_led_exactly_by_order_2(benchmark):
    """Second-order differences are exact on parabolas, and so is their Taylor series."""
    t = np.arange(300) / benchmark.fs
    x = lambda t: 1.0 + 3.0 * t - 20.0 * t**2  # noqa: E731
    x_a = np.broadcast_to(x(t)[:, None, None], (300, 2, 1))
    own = DerivativeFeedforward(tau_1=0.03, tau_2=0.02, order=2).prepare(benchmark)
    u, _ = driven(own, benchmark, x_a)
    expected = np.stack([x(t + 0.03), x(t + 0.02)], axis=1)
    np.testing.assert_allclose(u[10:, :, 0], expected[10:], rtol=0, atol=1e-9)


@pytest.mark.parametrize("order", [1, 2])
def test_commands_are_a_plain_loop_over_differences(benchmark, order):
    x_a, dt = strokes(), benchmark.dt
    tau = ((0.04, 0.04, 0.04), (0.01, 0.02, 0.03))
    own = DerivativeFeedforward(0.9, 1.1, 0.04, np.array(tau[1]), order).prepare(benchmark)
    u, _ = driven(own, benchmark, x_a)
    for k in range(4, len(x_a)):
        now, *past = (x_a[k - j] for j in range(5))
        v = (1.5 * now - 2 * past[0] + 0.5 * past[1]) / dt
        a = (2 * now - 5 * past[0] + 4 * past[1] - past[2]) / dt**2
        expected = now + np.array(tau) * v + (order == 2) * np.array(tau) ** 2 / 2 * a
        expected *= np.array([[0.9], [1.1]])
        np.testing.assert_allclose(u[k], expected, rtol=0, atol=1e-10)


def test_the_loop_of_the_nominal_plant_is_stable(benchmark):
    for order in (1, 2):
        own = DerivativeFeedforward(order=order).prepare(benchmark)
        assert spectral_radius(benchmark, own, nominal_plant())[0] < 1


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"order": 3}, "`order` must be a whole number from 1 to 2, but got 3"),
        ({"tau_2": 0.3}, r"`tau_2` must be a number from 0 to 0.2 \(s\)"),
        ({"gain_1": -1.0}, "`gain_1` must be a number above 0"),
    ],
)
def test_what_cannot_be_used_is_refused(benchmark, given, message):
    with pytest.raises(InputError, match=message):
        simulate(benchmark, DerivativeFeedforward(**given), nominal_plant(), burst(0.3))


@pytest.mark.slow
def test_it_tracks_better_than_no_compensation(benchmark):
    none, *own = tracking(benchmark, DerivativeFeedforward(), DerivativeFeedforward(order=2))
    assert np.all(np.array(own) < none / 2)
