"""Adaptive inverse compensation: the inverse, the indicator in closed form, and the loop."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax import Compensator, DirectMeasurement, InputError
from martths_jax.control.base import Observation
from martths_jax.control.controllers import aic

RNG = np.random.default_rng(11)
DT = 1 / 1024


def run(benchmark, target, measured, **settings):
    """Commands, alpha and indicator (N, 2, T) of the box, its filter left out."""
    made = aic.AIC(**settings)
    assert not made.problems(benchmark)
    made = replace(made.prepare(benchmark), estimator=DirectMeasurement())
    box = Compensator(made, made.estimator, DT)

    def sample(state, strokes):
        state, command, signals = box.step(state, *strokes)
        return state, (command, signals["alpha"], signals["indicator"])

    start = box.init(target.shape[2])
    return jax.jit(lambda s: jax.lax.scan(sample, start, s)[1])(
        (jnp.asarray(target), jnp.asarray(measured))
    )


def test_it_is_the_published_loop(benchmark):
    """A and B summed apart, as published; alpha reaches both bounds; gains a trial."""
    N, T = 400, 3
    target, measured = 3 * RNG.standard_normal((2, N, 2, T)).cumsum(axis=1) / 10
    k_p, k_i, leak, gain = np.array([2.0, 10.0, 200.0]), 40.0, 0.05, np.array([0.9, 1.05])
    u, alpha, indicator = run(
        benchmark,
        target,
        measured,
        lead=(48 * DT, 26 * DT),
        gain=gain,
        k_p=k_p * DT,
        k_i=k_i * DT,
        leak=leak,
    )
    expected = np.zeros((3, N, 2, T))
    for t in range(T):
        for i, alpha_0 in enumerate((49.0, 27.0)):
            x_a, x_m = (np.append(0.0, s[:, i, t]) for s in (target, measured))
            ti = integral = 0.0
            for k in range(1, N + 1):
                dA = 0.5 * (x_m[k] + x_m[k - 1]) * (x_a[k] - x_a[k - 1])
                dB = 0.5 * (x_m[k] - x_m[k - 1]) * (x_a[k] + x_a[k - 1])
                ti += 0.5 * (dB - dA) - DT / leak * ti
                wanted = alpha_0 + k_p[t] * ti + integral + k_i * DT * ti
                if 1 < wanted < 90:
                    integral += k_i * DT * ti
                a = min(max(alpha_0 + k_p[t] * ti + integral, 1.0), 90.0)
                command = gain[i] * (a * x_a[k] - (a - 1) * x_a[k - 1])
                expected[:, k - 1, i, t] = command, a, ti
    for found, wanted in zip((u, alpha, indicator), expected, strict=True):
        np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9)
    assert expected[1].min() == 1.0 and expected[1].max() == 90.0


@pytest.mark.parametrize("lag", [0.002, -0.003])
def test_a_cycle_of_lag_adds_its_sine(lag):
    """N samples a cycle: N/2 sin(2 pi / N) X Y sin phi exactly, pi X Y sin phi as N grows."""
    N, X, Y, f = 512, 2.0, 1.7, 2.0
    t = np.arange(N + 1) / (N * f)
    x_a, x = X * np.sin(2 * np.pi * f * t), Y * np.sin(2 * np.pi * f * (t - lag))
    found = np.sum(aic.indicated(x_a[:-1], x_a[1:], x[:-1], x[1:]))
    sine = np.sin(2 * np.pi * f * lag)
    np.testing.assert_allclose(found, N / 2 * np.sin(2 * np.pi / N) * X * Y * sine, rtol=1e-12)
    np.testing.assert_allclose(found, np.pi * X * Y * sine, rtol=1e-4)


def test_the_default_gain_moves_alpha_by_a_third_for_a_millisecond():
    """One cycle at 1 mm and 1.9 Hz: pi sin(2 pi 1.9 Hz 1 ms) = 0.037 mm^2."""
    assert aic.K_P / DT * np.pi * np.sin(2 * np.pi * 1.9e-3) == pytest.approx(0.3, rel=0.01)


def test_it_inverts_its_own_actuator(benchmark):
    """x(k) = x(k-1) + (u(k) - x(k-1)) / alpha reaches every target where nothing adapts."""
    target = RNG.standard_normal((60, 2, 2))
    alpha = np.array([49.0, 27.0])
    u = run(
        benchmark, target, target, lead=tuple((alpha - 1) * DT), gain=(1.0, 1.0), k_p=0.0, k_i=0.0
    )[0]  # fmt: skip
    x, reached = np.zeros((2, 2)), []
    for command in np.asarray(u):
        x = x + (command - x) / alpha[:, None]
        reached.append(x)
    np.testing.assert_allclose(reached, target, atol=1e-12)


@pytest.mark.parametrize("true", [40.0, 60.0])
def test_alpha_goes_to_that_of_the_actuator(benchmark, true):
    """An actuator of another alpha: the loop through the box ends near it, from either side."""
    made = aic.AIC(lead=(49 * DT, 49 * DT), gain=(1.0, 1.0), k_i=8.0 * DT)
    made = made.prepare(benchmark)
    state, k = made.init(1), np.arange(12 * 1024)
    wave = np.sin(2 * np.pi * 2.0 * k * DT)

    def sample(carry, x_a):
        state, x = carry
        both = jnp.full((2, 1), x_a)
        seen = aic_seen(both, x)
        state, decision = made.step(state, seen)
        x = x + (decision.u - x) / true
        return (state, x), decision.signals["alpha"]

    # The stroke seen at k is that of u(k-1), as in the loop: a sample of lag that is its own.
    alpha = jax.lax.scan(sample, (state, jnp.zeros((2, 1))), jnp.asarray(wave))[1]
    found = float(np.mean(np.asarray(alpha)[-1024:]))
    assert abs(found - true) < 0.2 * abs(50.0 - true) + 1.0


def aic_seen(x_a, x_hat):
    """An observation with what the controller looks at."""
    return Observation(jnp.asarray(0), DT, x_a, x_hat, x_hat, (), None)


def test_settings_that_cannot_be_used(benchmark):
    for settings, message in (
        ({"lead": (0.1, 0.02)}, "`lead` must lie from 0 to 0.0869 s"),
        ({"lead": (0.02, 0.02, 0.02)}, "`lead` must be two numbers"),
        ({"leak": 1e-5}, "`leak` must be at least the sample period, 0.000976562 s"),
        ({"k_p": -1.0}, "`k_p` must be zero or positive"),
    ):
        assert message in " ".join(aic.AIC(**settings).problems(benchmark))
    with pytest.raises(InputError, match=r"`lead` must be 2 numbers from 0 to 0.0869\d* \(s\)"):
        aic.ENTRY.build(benchmark, lead=(0.0, 1.0))
