"""A filter that finds its noise: on noise that is known; and ADFC behind it."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import optimize

from martths_jax import ADFC, InputError, draw_plants, simulate
from martths_jax.control.controllers import AdaptiveFilterADFC, adfc_akf
from martths_jax.control.estimators import design_adaptive, design_kalman
from martths_jax.control.estimators.kalman import steady_state_gains
from martths_jax.stability import spectral_radius
from martths_jax.structure.modal import to_dense
from tests.engine.motions import burst

Q, MEMORY, TRIALS = 3e-3, 300, 64


@pytest.fixture(autouse=True)
def short(monkeypatch):
    """Delays are looked for in the widest range at once: one program instead of three."""
    for kind in (ADFC, AdaptiveFilterADFC):
        monkeypatch.setattr(kind, "first_lag_range", 2)


def measured(benchmark, r, samples, seed):
    """(N, 2, T) strokes of the nominal plant under process noise Q and sensor noise r.

    The same for a seed but for the size of the sensors' noise.
    """
    A, B, C, _ = to_dense(benchmark.plant_model)
    rng = np.random.default_rng(seed)
    w = np.sqrt(Q) * rng.normal(size=(samples, 2, TRIALS))
    z, found = np.zeros((len(A), TRIALS)), []
    for one in w:
        found.append(C @ z)
        z = A @ z + B @ one
    return np.array(found) + np.sqrt(r) * rng.normal(size=w.shape)


def filtered(estimator, x_m):
    """r_hat (N, T) and x_hat (N, 2, T) of a plant that is not commanded."""

    def sample(predicted, x):
        state, estimate = estimator.correct(predicted, x)
        return estimator.predict(state, jnp.zeros_like(x)), (estimator.noise(state), estimate)

    start = estimator.init(x_m.shape[-1])
    return [np.asarray(x) for x in jax.lax.scan(sample, start, jnp.asarray(x_m))[1]]


@pytest.mark.parametrize("factor", [5.0, 0.2, 1.0])
def test_it_finds_the_noise_within_its_statistical_error(benchmark, factor):
    """A mean that fades over M of the squares of two white channels has the variance 1/(2M - 1)."""
    r = factor * benchmark.r_mm2
    estimator = design_adaptive(benchmark.plant_model, Q, benchmark.r_mm2, MEMORY)
    x_m = measured(benchmark, r, 10 * MEMORY, seed=int(10 * factor))
    found = filtered(estimator, x_m)[0][-1] / r
    A, B, C, _ = to_dense(benchmark.plant_model)
    P = steady_state_gains(A, B, C, Q, r)[2]
    whole = 1 + np.trace(C @ P @ C.T) / 2 / r  # s has the error of all of it
    error = whole / np.sqrt(2 * MEMORY - 1)
    assert abs(found.mean() - 1) < 4 * error / np.sqrt(TRIALS) + 0.01  # a table's entry is 33 % off
    assert 0.6 * error < found.std() < 1.6 * error


def test_its_gains_are_those_of_the_noise_it_found(benchmark):
    """At entries of the table, and between them."""
    A, B, C, _ = to_dense(benchmark.plant_model)
    model, r0 = benchmark.plant_model, benchmark.r_mm2
    estimator = design_adaptive(model, Q, r0, 2.0)
    for factor in (0.01, 0.013, 0.3, 1.0, 7.0, 100.0):
        L, _, P = steady_state_gains(A, B, C, Q, factor * r0)
        s = jnp.asarray([np.trace(C @ P @ C.T) / 2 + factor * r0])
        shares = estimator.shares(s)
        gain = sum(g * w[0] for g, w in zip(estimator.gains, shares, strict=True))
        expected = np.transpose(L.reshape(-1, 2, 2), (1, 0, 2))
        between = 0.0 if factor in (0.01, 1.0, 100.0) else 0.01
        scale = np.abs(expected).max()
        np.testing.assert_allclose(gain, expected, atol=(between + 1e-7) * scale)
        noise = estimator.noise({"s": s})[0] / r0
        np.testing.assert_allclose(noise, factor, rtol=0.003 if between else 1e-7)


def test_the_equations_solved_anew_each_sample(benchmark):
    """r as the root of s = tr(C P(r) C') / 2 + r, found by bisection, and its own gain."""
    A, B, C, _ = to_dense(benchmark.plant_model)
    x_m = measured(benchmark, 5 * benchmark.r_mm2, 1200, seed=4)[1000:1060, :, :1]
    estimator = design_adaptive(benchmark.plant_model, Q, benchmark.r_mm2, 8.0)
    r_hat, x_hat = filtered(estimator, x_m)

    def matched(s, log_r):
        P = steady_state_gains(A, B, C, Q, np.exp(log_r))[2]
        return np.log(np.trace(C @ P @ C.T) / 2 + np.exp(log_r)) - np.log(s)

    z, noises, found = np.zeros(len(A)), [], []
    P = steady_state_gains(A, B, C, Q, benchmark.r_mm2)[2]
    s = np.trace(C @ P @ C.T) / 2 + benchmark.r_mm2
    for x in x_m[..., 0]:
        innovation = x - C @ z
        s += (innovation @ innovation / 2 - s) / 8
        bounds = np.log(benchmark.r_mm2) + np.array([-4.6, 4.6])
        r = np.exp(optimize.brentq(partial(matched, s), *bounds))
        z = z + steady_state_gains(A, B, C, Q, r)[0] @ innovation
        noises.append(r)
        found.append(C @ z)
        z = A @ z
    assert max(noises) > 3 * min(noises)
    np.testing.assert_allclose(r_hat[:, 0], noises, rtol=0.02)
    np.testing.assert_allclose(x_hat[..., 0], found, atol=0.01 * np.abs(found).max())


def test_it_estimates_as_well_as_a_filter_that_knows_the_noise(benchmark):
    """Both beside one that takes it for a twentieth, in whole matrices."""
    r, model, N = 20 * benchmark.r_mm2, benchmark.plant_model, 2500
    A, B, C, _ = to_dense(model)
    true, x_m = (measured(benchmark, noise, N, seed=3) for noise in (0.0, r))

    def error(estimate):
        return np.sqrt(np.mean((estimate - true)[1500:] ** 2))

    def plain(noise):
        L = steady_state_gains(A, B, C, Q, noise)[0]
        z, found = np.zeros((len(A), TRIALS)), []
        for x in x_m:
            z = z + L @ (x - C @ z)
            found.append(C @ z)
            z = A @ z
        return np.array(found)

    own = design_adaptive(model, Q, benchmark.r_mm2, MEMORY)
    ours, knows, wrong = (
        error(one) for one in (filtered(own, x_m)[1], plain(r), plain(benchmark.r_mm2))
    )
    assert knows < 0.9 * wrong and ours - knows < 0.02 * (wrong - knows)


@pytest.mark.slow
def test_without_adaptation_it_is_adfc_to_the_bit(benchmark):
    plants, settings = draw_plants(2, seed=1), {"nb": 64, "no": 63}
    one, other = (
        simulate(benchmark, c, plants, burst(0.4), keep=True).signals
        for c in (AdaptiveFilterADFC(adapt=False, **settings), ADFC(**settings))
    )
    for name in ("u", "x_hat", "C_A", "x_a"):
        np.testing.assert_array_equal(one[name], other[name], err_msg=name)
    np.testing.assert_array_equal(one["r_hat"], benchmark.r_mm2)


@pytest.mark.slow
def test_a_memory_without_end_is_adfc_too(benchmark):
    """The table's middle is the filter that it starts from."""
    plants = draw_plants(2, seed=1)
    one, other = (
        simulate(benchmark, c, plants, burst(0.3), keep=True).signals["x_hat"]
        for c in (AdaptiveFilterADFC(memory=1e300), ADFC())
    )
    np.testing.assert_allclose(one, other, rtol=1e-7, atol=1e-9)
    middle = design_adaptive(benchmark.plant_model, 3e-5, benchmark.r_mm2, 2.0).gains[16]
    exact = design_kalman(benchmark.plant_model, 3e-5, benchmark.r_mm2).filter_gain
    np.testing.assert_allclose(middle, exact, rtol=1e-6, atol=1e-12)


@pytest.mark.slow
def test_numbers_may_differ_from_trial_to_trial_and_it_can_be_frozen(benchmark):
    plants = draw_plants(2, seed=1)
    settings = {"q": np.array([3e-5, 1e-3]), "memory": np.array([50.0, 500.0])}
    each = [AdaptiveFilterADFC(**{n: float(v[i]) for n, v in settings.items()}) for i in range(2)]
    one, other = (
        simulate(benchmark, c, plants, burst(0.3), keep=True).signals["r_hat"]
        for c in (AdaptiveFilterADFC(**settings), each)
    )
    np.testing.assert_allclose(one, other, rtol=1e-9)
    assert np.ptp(one, axis=0).max() > 1e-6
    ready = ADFC().prepare(benchmark)
    radius = [
        spectral_radius(benchmark, c.frozen(benchmark, ready.anchor), plants)
        for c in (AdaptiveFilterADFC(), ADFC())
    ]
    np.testing.assert_array_equal(*radius)


def test_settings_that_cannot_be_used(benchmark):
    for given, name in (((0.0, 1e-4, 9.0), "q"), ((1e-4, -1.0, 9.0), "r")):
        with pytest.raises(InputError, match=rf"`{name}` must be positive and finite \(mm\^2\)"):
            design_adaptive(benchmark.plant_model, *given)
    with pytest.raises(InputError, match=r"`memory` must be above 1 \(samples\), but got 1.0"):
        design_adaptive(benchmark.plant_model, 1e-4, 1e-4, 1.0)
    with pytest.raises(InputError, match=r"`memory` must be a number above 1 \(samples\)"):
        adfc_akf.ENTRY.build(benchmark, memory=1.0)
    with pytest.raises(InputError, match="`memory` must be above 1"):
        simulate(benchmark, AdaptiveFilterADFC(memory=0.5), draw_plants(1), burst(0.1))
