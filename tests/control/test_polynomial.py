"""Polynomial extrapolation against Horiuchi's table, Lagrange's weights and NumPy's fit."""

from math import comb

import numpy as np
import pytest

from martths_jax import InputError, nominal_plant, simulate
from martths_jax.control.controllers import Polynomial
from martths_jax.control.extrapolation import Extrapolation
from martths_jax.stability import spectral_radius
from tests.control.driven import driven, strokes, tracking
from tests.engine.motions import burst

TABLE = {1: (2, -1), 2: (3, -3, 1), 3: (4, -6, 4, -1), 4: (5, -10, 10, -5, 1)}


@pytest.mark.parametrize("order", TABLE)
def test_spacing_as_long_as_the_delay_gives_the_papers_weights(order):
    np.testing.assert_allclose(
        Extrapolation(order, order + 1, 13).weights(13.0), TABLE[order], rtol=0, atol=1e-10
    )
    assert TABLE[order] == tuple((-1) ** j * comb(order + 1, j + 1) for j in range(order + 1))


def test_any_spacing_and_delay_give_lagranges_weights():
    tau, h, n = 0.0313, 0.009, 3
    expected = [
        np.prod([(tau + j * h) / ((j - i) * h) for j in range(n + 1) if j != i])
        for i in range(n + 1)
    ]
    found = Extrapolation(n, n + 1, 9).weights(tau / h * 9)
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_more_points_are_the_least_squares_fit():
    x = np.random.default_rng(2).standard_normal(16)
    t = -3.0 * np.arange(16)
    ahead = 27.4
    one = Extrapolation(4, 16, 3)
    fit = np.polynomial.Polynomial.fit(t, x, 4)
    np.testing.assert_allclose(one.weights(ahead) @ x, fit(ahead), rtol=1e-10)
    c = one.matrix @ x
    np.testing.assert_allclose(one.value(c, ahead), fit(ahead), rtol=1e-10)
    np.testing.assert_allclose(one.slope(c), fit.deriv()(0.0), rtol=1e-10)


def test_commands_are_a_plain_sum_over_past_targets(benchmark):
    x_a = strokes()
    own = Polynomial(
        tau_1=0.03, tau_2=np.array([0.01, 0.02, 0.03]), order_1=2, order_2=1, points_2=7,
        spacing_1=11.4 / 1024, spacing_2=4 / 1024,
    ).prepare(benchmark)  # fmt: skip
    u, _ = driven(own, benchmark, x_a)
    for i, (n, points, h) in enumerate(((2, 3, 11), (1, 7, 4))):
        for trial, tau in enumerate(([0.03] * 3, [0.01, 0.02, 0.03])[i]):
            V = np.vander(-np.arange(points) * h / 1024, n + 1, increasing=True)
            w = np.linalg.solve(V.T @ V, V.T).T @ tau ** np.arange(n + 1)
            at = lambda k, x=x_a[:, i, trial]: x[k] if k >= 0 else 0.0  # noqa: E731
            expected = [sum(w[j] * at(k - j * h) for j in range(points)) for k in range(len(x_a))]
            np.testing.assert_allclose(u[:, i, trial], expected, rtol=0, atol=1e-10)


def test_a_polynomial_is_predicted_exactly(benchmark):
    k = np.arange(400.0)
    x_a = np.stack([1 + 0.3 * k - 0.002 * k**2, 2 - 0.1 * k])[:, :, None].swapaxes(0, 1)
    u, _ = driven(Polynomial().prepare(benchmark), benchmark, x_a)
    late, ahead = slice(100, None), (k + 40, k + 26)
    expected = np.stack([1 + 0.3 * ahead[0] - 0.002 * ahead[0] ** 2, 2 - 0.1 * ahead[1]], axis=1)
    np.testing.assert_allclose(u[late, :, 0], expected[late], rtol=1e-11)


def test_the_frozen_loop_is_stable_to_order_2_and_not_at_order_3(benchmark):
    radius = lambda c: spectral_radius(benchmark, c.prepare(benchmark), nominal_plant())[0]  # noqa: E731
    cubic = {"order_1": 3, "order_2": 3, "tau_1": 42 / 1024, "spacing_1": 42 / 1024,
             "tau_2": 20 / 1024, "spacing_2": 20 / 1024}  # fmt: skip
    assert radius(Polynomial()) < 1 < radius(Polynomial(**cubic))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"points_1": 2}, "`points_1` must be at least 3, as many as a polynomial of order 2"),
        ({"spacing_2": 0.06}, r"`spacing_2` must be a number from 0.0001 to 0.05 \(s\)"),
        ({"spacing_2": 0.0003}, "`spacing_2` must be at least half a sample"),
        ({"points_1": 40}, "`points_1` must keep the points within 0.5 s"),
        ({"order_1": 5}, "`order_1` must be a whole number from 0 to 4"),
        ({"tau_1": np.array([0.01, np.nan])}, "`tau_1` must be a number from 0 to 0.08"),
        ({"estimate": "guess"}, "`estimate` must be one of 'kalman', 'measured'"),
    ],
)
def test_what_cannot_be_used_is_refused(benchmark, given, message):
    with pytest.raises(InputError, match=message):
        simulate(benchmark, Polynomial(**given), nominal_plant(), burst(0.3))


@pytest.mark.slow
def test_it_tracks_better_than_no_compensation(benchmark):
    none, own = tracking(benchmark, Polynomial())
    assert np.all(own < none / 4)
