"""Feedforward of a discrete model with feedback: a plain loop, its special case, its limits."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import signal

from martths_jax import InputError, draw_plants, indices, simulate
from martths_jax.control.base import Observation
from martths_jax.control.controllers import MFF, NingFFFB
from martths_jax.stability import spectral_radius
from tests.control.driven import driven, strokes
from tests.engine.motions import burst


def test_the_command_is_the_equations(benchmark):
    x_a, x_m = strokes(150, trials=1), strokes(150, trials=1, seed=9)
    p, i, q = 1.3, 4.0, 0.02
    made = NingFFFB(feedback=p, integral=i, q_fb=q, order=1)
    assert not made.problems(benchmark)
    u, said = driven(made.prepare(benchmark), benchmark, x_a, x_m)
    x_a, x_m, dt = x_a[..., 0], x_m[..., 0], benchmark.dt
    A, B, C = benchmark.plant_continuous
    F, G = signal.cont2discrete((A, B, C, np.zeros((2, 2))), dt)[:2]
    P = q * G @ G.T
    for _ in range(4000):
        L = P @ C.T @ np.linalg.inv(C @ P @ C.T + benchmark.r_mm2 * np.eye(2))
        P = F @ (P - L @ C @ P) @ F.T + q * G @ G.T
    c = np.asarray(MFF(order=1).prepare(benchmark).coefficients)
    target = 2 * x_a - np.vstack([np.zeros((1, 2)), x_a[:-1]])
    past = np.vstack([np.zeros((2, 2)), target])
    slope = 1.5 * past[2:] - 2 * past[1:-1] + 0.5 * past[:-2]
    ahead = target @ c[[0, 2]] + slope @ c[[1, 3]]
    zeta, summed, expected = np.zeros(8), np.zeros(2), np.zeros_like(x_a)
    for k in range(len(x_a)):
        zeta = zeta + L @ (x_m[k] - C @ zeta)
        summed = summed + dt * (x_a[k] - x_m[k])
        expected[k] = ahead[k] + p * (x_a[k] - C @ zeta) + i * summed
        zeta = F @ zeta + G @ expected[k]
    scale = np.abs(expected).max()
    np.testing.assert_allclose(u[..., 0], expected, rtol=1e-5, atol=1e-6 * scale)
    np.testing.assert_allclose(said["u_fb"][..., 0], expected - ahead, rtol=1e-5, atol=1e-6 * scale)


def test_feedback_settles_what_the_feedforward_leaves(benchmark):
    """A target that stays: integral action takes any error of the plant's gain away."""
    made = NingFFFB(feedback=0.5, integral=20.0).prepare(benchmark)
    A, B, C = benchmark.plant_continuous
    F, G = signal.cont2discrete((A, 0.8 * B, C, np.zeros((2, 2))), benchmark.dt)[:2]

    def sample(carry, k):
        state, z = carry
        x = C @ z
        target = jnp.ones((2, 1))
        state, said = made.step(state, Observation(k, benchmark.dt, target, x, x, (), None))
        return (state, F @ z + G @ said.u), x

    start = made.init(1), jnp.zeros((8, 1))
    x = np.asarray(jax.lax.scan(sample, start, jnp.arange(4000))[1])
    np.testing.assert_allclose(x[-1], 1.0, atol=1e-3)


@pytest.mark.slow
def test_the_loop_is_stable(benchmark):
    ready = NingFFFB().prepare(benchmark)
    assert spectral_radius(benchmark, ready, draw_plants(8, seed=1)).max() < 0.9998


@pytest.mark.slow
def test_it_takes_the_plants_spread_away(benchmark):
    plants, motion, names = draw_plants(64, seed=1), burst(2.0), ["J2true_1", "J2true_2"]
    ours, ahead = (
        indices(simulate(benchmark, c, plants, motion, indices=names))
        for c in (NingFFFB(), MFF(order=2))
    )
    for name in names:
        assert ours[name].max() < 0.7 * ahead[name].max()  # false for NaN, which a lost trial has


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"feedback": -1.0}, "`feedback` must be zero or positive"),
        ({"feedback": 50.0}, "`feedback, integral` must give feedback that is stable on the"),
        ({"integral": 1000.0}, "`feedback, integral` must give feedback that is stable on the"),
        ({"q_fb": 0.0}, "`q_fb` must be positive"),
    ],
)
def test_what_cannot_be_used_is_refused(benchmark, settings, message):
    with pytest.raises(InputError, match=message):
        simulate(benchmark, NingFFFB(**settings), draw_plants(1), burst(0.3))
