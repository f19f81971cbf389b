"""Plants, their draws, the Kalman filter and the coupler against independent formulas."""

import control
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import signal

from martths_jax import InputError, build_coupler, draw_plants, nominal_plant, plant_from_draws
from martths_jax.benchmark import continuous_plant
from martths_jax.control.estimators.kalman import design_kalman, steady_state_gains
from martths_jax.coupler import actuator_to_frame, frame_to_actuator
from martths_jax.plant import SIGMA
from martths_jax.structure.modal import to_dense
from martths_jax.transfer import HZ, frequency_response

DT = 1 / 1024


def transfer_functions(draws):
    """The four transfer functions written out as the benchmark prints them (zeros, poles, gain)."""
    f = 1 + SIGMA * np.asarray(draws)
    frame = [f[4] * complex(-50, 63) * HZ, f[4] * complex(-50, -63) * HZ]
    column_1 = [-2.65 * HZ * f[2], -40 * HZ * f[3], *frame]
    column_2 = [-3.5 * HZ * f[7], -18.5 * HZ * f[8], *frame]
    zeros_1 = [-120 * HZ * f[0], -90 * HZ * f[1]]
    dc = np.array([[0.863812, 0.131070], [0.139613, 0.925792]])
    parts = {
        (0, 0): (zeros_1, column_1),
        (1, 0): (zeros_1, column_1),
        (0, 1): ([-3 * HZ * f[5]], column_2),
        (1, 1): ([-5 * HZ * f[6]], column_2),
    }
    return {
        ij: (z, p, dc[ij] * np.real(np.prod(-np.array(p)) / np.prod(-np.array(z))))
        for ij, (z, p) in parts.items()
    }


@pytest.mark.parametrize("seed", [None, 0, 1])
def test_plant_is_the_zero_order_hold_of_its_transfer_functions(seed):
    draws = np.zeros(9) if seed is None else np.random.default_rng(seed).standard_normal(9)
    A, B, C, _ = to_dense(plant_from_draws(draws).discretise(DT))
    steps = 300
    ours = [C @ np.linalg.matrix_power(A, k) @ B for k in range(steps)]
    for (i, j), (z, p, k) in transfer_functions(draws).items():
        discrete = control.sample_system(control.zpk(z, p, k), DT, method="zoh")
        response = control.impulse_response(discrete, np.arange(steps + 1) * DT).outputs * DT
        expected = np.ravel(response)[1:]
        found = np.array([y[i, j] for y in ours])
        np.testing.assert_allclose(found, expected, atol=5e-6 * np.abs(expected).max())


def test_dc_gain_stays_nominal_under_uncertainty():
    response = np.asarray(frequency_response(draw_plants(50, 3).parameters_hz, [0.0]))[0]
    nominal = np.array([[0.863812, 0.131070], [0.139613, 0.925792]])
    np.testing.assert_allclose(response.real, np.repeat(nominal[..., None], 50, -1), rtol=1e-5)


def test_frequency_response_is_that_of_the_state_space():
    A, B, C = continuous_plant()
    f = np.array([0.5, 5.0, 50.0])
    expected = [C @ np.linalg.solve(2j * np.pi * x * np.eye(8) - A, B) for x in f]
    found = np.asarray(frequency_response(nominal_plant().parameters_hz, f))[..., 0]
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_continuous_plant_belongs_to_the_discrete_one():
    A, B, C = continuous_plant()
    expected = signal.cont2discrete((A, B, C, np.zeros((2, 2))), DT)
    for ours, theirs in zip(
        to_dense(nominal_plant().discretise(DT))[:3], expected[:3], strict=True
    ):
        np.testing.assert_allclose(ours, theirs, atol=1e-12 * np.abs(theirs).max(), rtol=1e-9)


def test_draws_depend_on_seed_and_trial_alone():
    many, few = draw_plants(50, 7), draw_plants(3, 7, first=17)
    np.testing.assert_array_equal(many.draws[16:19], few.draws)
    np.testing.assert_array_equal(many[16:19].trial, [17, 18, 19])
    assert not np.array_equal(draw_plants(3, 8).draws, draw_plants(3, 7).draws)


def test_draws_are_standard_normal_and_scaled_by_table_2():
    plants = draw_plants(4000, 1)
    np.testing.assert_allclose(np.mean(plants.draws, axis=0), 0, atol=0.06)
    np.testing.assert_allclose(np.std(plants.draws, axis=0), 1, atol=0.05)
    relative = np.std(plants.parameters_hz, axis=0) / np.abs(np.mean(plants.parameters_hz, axis=0))
    np.testing.assert_allclose(relative, SIGMA, rtol=0.06)


@pytest.mark.parametrize(
    ("draws", "message"),
    [
        (np.zeros(8), r"`draws` must have shape \(9,\) or \(trials, 9\), but got shape \(8,\)"),
        (np.zeros((9, 2)), r"but got shape \(9, 2\)"),
        (np.zeros((0, 9)), r"but got shape \(0, 9\)"),
        (np.full(9, np.nan), "be finite, but got nan for zero1_col1 in row 0"),
        (np.eye(9)[[2]] * -17, "stable plants, but row 0 moves pole1_col1"),
        (np.eye(9)[[4, 4]] * -21, "moves frame_pair"),
    ],
)
def test_bad_draws(draws, message):
    with pytest.raises(InputError, match=message):
        plant_from_draws(draws)


def test_no_plants():
    with pytest.raises(
        InputError, match="`n` must be a whole number from 1 to 4294967295, but got 0"
    ):
        draw_plants(0)


def test_kalman_gains_solve_their_riccati_equation():
    A, B, C, _ = to_dense(nominal_plant().discretise(DT))
    q, r = 3e-5, 1.536e-4
    L, predictor, P = steady_state_gains(A, B, C, q, r)
    S = C @ P @ C.T + r * np.eye(2)
    np.testing.assert_allclose(L @ S, P @ C.T, atol=1e-12 * np.abs(P @ C.T).max())
    np.testing.assert_allclose(predictor, A @ L)
    corrected = P - L @ C @ P
    np.testing.assert_allclose(
        A @ corrected @ A.T + q * B @ B.T, P, rtol=1e-6, atol=1e-10 * np.abs(P).max()
    )
    theirs, _, _ = control.dlqe(A, B, C, q * np.eye(2), r * np.eye(2))
    np.testing.assert_allclose(predictor, theirs, rtol=1e-5, atol=1e-8 * np.abs(L).max())


@pytest.mark.parametrize(
    ("name", "q", "r"), [("q", 0.0, 1e-4), ("q", np.nan, 1e-4), ("r", 1.0, -1.0)]
)
def test_bad_noise_levels(name, q, r):
    with pytest.raises(InputError, match=f"`{name}` must be positive"):
        design_kalman(nominal_plant().discretise(DT), q, r)


def test_coupler_is_the_published_geometry():
    coupler = build_coupler()
    x, theta = np.linspace(-0.02, 0.02, 7), np.linspace(-0.3, 0.3, 7)
    p, alpha = 0.29539446508017037, np.deg2rad([-25.4633, 25.4633])
    strokes = np.asarray(frame_to_actuator(coupler, jnp.stack([x, theta])))
    expected = x + p * (np.cos(alpha[:, None] + theta) - np.cos(alpha[:, None]))
    np.testing.assert_allclose(strokes, 1e3 * expected, atol=1e-12)
    back = np.asarray(actuator_to_frame(coupler, jnp.asarray(strokes)))
    np.testing.assert_allclose(back, [x, theta], atol=1e-15)


def test_coupler_has_no_position_for_strokes_too_far_apart():
    assert np.isnan(actuator_to_frame(build_coupler(), jnp.array([200.0, -200.0]))[1])
