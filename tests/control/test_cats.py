"""Cascades: outside the time series as it is alone, inside a PID and an optimum by Riccati."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import signal

from martths_jax import InputError, draw_plants, simulate
from martths_jax.control.controllers import CATSMPC, CATSPID, RecursiveATS, cats_mpc, cats_pid
from martths_jax.control.controllers.cats_mpc import predictive_gains
from martths_jax.control.estimators.kalman import steady_state_gains
from martths_jax.stability import spectral_radius
from martths_jax.structure.modal import to_dense
from tests.control.driven import driven
from tests.engine.motions import burst

#: What the time series adapts by within so short a motion.
QUICK = {"threshold": 0.0, "spread": 3.0, "cutoff": 60.0}


@pytest.fixture(autouse=True)
def short(monkeypatch):
    """Delays are looked for in the widest range at once: one program instead of three."""
    for kind in (CATSPID, CATSMPC, RecursiveATS):
        monkeypatch.setattr(kind, "first_lag_range", 2)


def run(benchmark, controller, seconds=0.4):
    return simulate(
        benchmark, controller, draw_plants(1, seed=1), burst(seconds), keep=True
    ).signals


def riccati(A, B, C, horizon, moves, rho):
    """K of du = -K (dz, x - r), the first move: dynamic programming from the horizon backwards."""
    n = len(A)
    F = np.block([[A, np.zeros((n, len(C)))], [C @ A, np.eye(len(C))]])
    G = np.vstack([B, C @ B])
    Q = np.zeros_like(F)
    Q[n:, n:] = np.eye(len(C))
    V = Q
    for j in reversed(range(horizon)):
        K = np.zeros(G.T.shape)
        if j < moves:
            K = np.linalg.solve(rho * np.eye(B.shape[1]) + G.T @ V @ G, G.T @ V @ F)
        V = Q + rho * K.T @ K + (F - G @ K).T @ V @ (F - G @ K)
    return K


@pytest.mark.parametrize(("horizon", "moves", "rho"), [(40, 5, 0.1), (12, 12, 3.0), (7, 1, 0.01)])
def test_the_prediction_is_the_riccati_equation_over_the_horizon(benchmark, horizon, moves, rho):
    rng = np.random.default_rng(4)
    for A, B, C in (
        to_dense(benchmark.plant_model)[:3],
        (0.3 * rng.normal(size=(4, 4)), rng.normal(size=(4, 3)), rng.normal(size=(2, 4))),
    ):
        found = np.hstack(predictive_gains(A, B, C, horizon, moves, rho))
        expected = riccati(A, B, C, horizon, moves, rho)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-9 * scale)


def test_the_predictive_loop(benchmark):
    """Commands by a plain loop, from the strokes that the filter gives and what it knows."""
    settings = {"horizon": 20, "moves": 4, "rho": 0.5}
    signals = run(benchmark, cats_mpc.ENTRY.build(benchmark, **settings, **QUICK))
    r, x_m, u = (signals[n][0] for n in ("r", "x_m", "u"))
    A, B, C, _ = to_dense(benchmark.plant_model)
    L = steady_state_gains(A, B, C, 3e-5, benchmark.r_mm2)[0]
    K = riccati(A, B, C, **settings)
    ahead, z, expected = np.zeros(8), np.zeros(8), np.zeros_like(u)
    for k in range(len(u)):
        before, z = z, ahead + L @ (x_m[k] - C @ ahead)
        step = -K @ np.concatenate([z - before, C @ z - r[k]])
        expected[k] = (expected[k - 1] if k else 0.0) + step
        ahead = A @ z + B @ expected[k]
    assert np.abs(u).max() > 0.5
    np.testing.assert_allclose(u, expected, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("error", ["measured", "estimate"])
def test_the_inner_loop_is_a_discrete_pid(benchmark, error):
    k_p, k_i, k_d, corner = 1.5, 7.0, 0.004, 30.0
    made = cats_pid.ENTRY.build(
        benchmark, k_p=k_p, k_i=k_i, k_d=k_d, corner=corner, error=error, **QUICK
    )
    signals, dt = run(benchmark, made), benchmark.dt
    r, u = signals["r"][0], signals["u"][0]
    e = r - signals["x_m" if error == "measured" else "x_hat"][0]
    w = 2 * np.pi * corner
    integral = signal.lfilter([dt], [1, -1], e, axis=0)
    slope = signal.lfilter([w, -w], [1 + w * dt, -1], e, axis=0)
    expected = r + k_p * e + k_i * integral + k_d * slope
    assert np.abs(expected - r).max() > 0.1
    np.testing.assert_allclose(u, expected, rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize("module", [cats_pid, cats_mpc])
def test_outside_is_the_time_series_as_it_is_alone(benchmark, module):
    """What it asks for is taught as if it were the command: alone it learns and asks the same."""
    made = module.ENTRY.build(benchmark, **QUICK)
    signals = run(benchmark, made)
    x_a, x_m = (signals[n][0][:, :, None] for n in ("x_a", "x_m"))
    alone, said = driven(made.outer.prepare(benchmark), benchmark, x_a, x_m)
    np.testing.assert_allclose(signals["r"][0], alone[..., 0], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(signals["C_A"][0], said["C_A"][..., 0], rtol=1e-7, atol=1e-9)
    assert np.ptp(said["C_A"][..., 0], axis=0).max() > 1e-3, "nothing was learnt"
    assert np.abs(signals["u"][0] - signals["r"][0]).max() > 0.1


def test_without_gains_it_is_the_time_series(benchmark):
    none = cats_pid.ENTRY.build(benchmark, k_p=0.0, k_i=0.0, **QUICK)
    one, other = (run(benchmark, c)["u"] for c in (none, none.outer))
    np.testing.assert_array_equal(one, other)


@pytest.mark.slow
@pytest.mark.parametrize("module", [cats_pid, cats_mpc])
def test_the_frozen_loop_is_stable(benchmark, module):
    """At the start, and at coefficients of a plant that the feedback has made ideal."""
    ready = module.ENTRY.build(benchmark)
    start = np.asarray(ready.outer.start)
    ideal = np.array([[1.0, 1.0], [0.0, 0.0], [0.0, 0.0]])
    for coefficients in (start, ideal):
        frozen = ready.frozen(benchmark, coefficients)
        assert spectral_radius(benchmark, frozen, draw_plants(16, seed=1)).max() < 0.9995
    one_each = np.stack([start, ideal], axis=-1)
    frozen = ready.frozen(benchmark, one_each)
    together = spectral_radius(benchmark, frozen, draw_plants(2, seed=1))
    first = spectral_radius(benchmark, ready.frozen(benchmark, start), draw_plants(1, seed=1))
    np.testing.assert_allclose(together[:1], first, rtol=1e-9)


@pytest.mark.slow
def test_numbers_may_differ_from_trial_to_trial(benchmark):
    """Gains of two trials together, and each alone."""
    plants = draw_plants(2, seed=1)
    for module, name, values in ((cats_pid, "k_p", (1.0, 2.0)), (cats_mpc, "rho", (0.1, 2.0))):
        made = [module.ENTRY.build(benchmark, **{name: v}, **QUICK) for v in values]
        both = module.ENTRY.build(benchmark, **QUICK)
        both = type(both)(**{**vars(both), name: jnp.asarray(values)})
        one, other = (
            simulate(benchmark, c, plants, burst(0.3), keep=True).signals["u"] for c in (both, made)
        )
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-10)


def test_the_weight_can_be_traced(benchmark):
    A, B, C, _ = to_dense(benchmark.plant_model)
    gain = lambda rho: predictive_gains(A, B, C, 20, 4, rho)[1][0, 0]  # noqa: E731
    slope = jax.grad(gain)(0.5)
    step = 1e-5
    np.testing.assert_allclose(slope, (gain(0.5 + step) - gain(0.5 - step)) / 2 / step, rtol=1e-6)


@pytest.mark.parametrize(
    ("module", "settings", "message"),
    [
        (cats_pid, {"k_p": -1.0}, "`k_p` must be a number of at least 0, but got -1.0"),
        (cats_pid, {"error": "true"}, "`error` must be one of 'measured', 'estimate'"),
        (cats_pid, {"cutoff": 512.0}, "`cutoff` must lie between 0 and 512 Hz"),
        (cats_mpc, {"moves": 41}, "`moves` must be a whole number from 1 to the horizon, 40"),
        (cats_mpc, {"rho": 0.0}, "`rho` must be a number above 0"),
    ],
)
def test_settings_that_cannot_be_used(benchmark, module, settings, message):
    with pytest.raises(InputError, match=message):
        simulate(benchmark, module.ENTRY.build(benchmark, **settings), draw_plants(1), burst(0.1))
