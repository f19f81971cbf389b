"""The differentiable LQG design against the one on the host."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax import LQG, build_benchmark
from martths_jax.control.controllers import ADFC
from martths_jax.control.controllers.lqg import lqg_from_weights
from martths_jax.control.design.lqg import WEIGHTS, tracking_gains
from martths_jax.control.estimators import design_kalman

START = {"e1": 9.343, "e2": 3.648, "r2": -0.913, "y1": 2.836, "y2": 0.921, "q": -1.82}


@pytest.fixture(scope="module")
def benchmark():
    return build_benchmark()


@pytest.fixture(scope="module")
def design(benchmark):
    return jax.jit(jax.vmap(lambda logs: lqg_from_weights(benchmark, logs)))


def batch(rows):
    return {name: jnp.asarray([row[name] for row in rows]) for name in WEIGHTS}


@pytest.mark.slow
def test_same_controller_as_on_the_host(benchmark, design):
    rng = np.random.default_rng(1)
    rows = [START] + [{n: v + rng.uniform(-3, 3) for n, v in START.items()} for _ in range(11)]
    found = design(batch(rows))
    for i, row in enumerate(rows):
        w = {name: 10**value for name, value in row.items()}
        host = LQG.design(
            benchmark, e=(w["e1"], w["e2"]), r=(1, w["r2"]), y=(w["y1"], w["y2"]), q=w["q"],
            allow_unstable=True,
        )  # fmt: skip
        for ours, theirs in (
            (found.K_z[i], host.K_z),
            (found.K_e[i], host.K_e),
            (found.estimator.filter_gain[i], host.estimator.filter_gain),
        ):
            assert np.abs(ours - theirs).max() < 1e-8 * np.abs(theirs).max()
    assert found.error == host.error == "estimate"
    assert lqg_from_weights(benchmark, START, error="measured").error == "measured"


@pytest.mark.slow
def test_gradient_in_log_weights(benchmark, design):
    def summary(c):
        parts = jax.tree.leaves((c.K_z, c.K_e, c.estimator.filter_gain))
        return jnp.stack([jnp.log(jnp.sum(x**2)) for x in parts])

    logs = {name: jnp.asarray(value) for name, value in START.items()}
    exact = jax.jit(jax.jacrev(lambda w: summary(lqg_from_weights(benchmark, w))))(logs)
    h = 1e-3
    for name in WEIGHTS:
        moved = design(batch([START | {name: START[name] + s * h} for s in (-2, -1, 1, 2)]))
        a, b, c, d = (summary(jax.tree.map(lambda x, i=i: x[i], moved)) for i in range(4))
        slope = (8 * (c - b) - (d - a)) / (12 * h)
        np.testing.assert_allclose(exact[name], slope, rtol=1e-5, atol=1e-7)


def test_cross_weight_is_a_change_of_input(benchmark):
    """With S = -K'R, Q = K'RK the cost is |u + K w|^2 for a stabilising K: u = -K w is optimal."""
    host = LQG.design(benchmark)
    K_z = np.swapaxes(np.asarray(host.K_z), 1, 2).reshape(2, 8)
    K = np.concatenate([K_z, np.asarray(host.K_e)], axis=1)
    R = np.diag([1.0, 0.2])
    K_z, K_e = jax.jit(lambda *x: tracking_gains(benchmark, *x))(K.T @ R @ K, R, K.T @ R)
    np.testing.assert_allclose(K_z, host.K_z, rtol=1e-6, atol=1e-8 * np.abs(K).max())
    np.testing.assert_allclose(K_e, host.K_e, rtol=1e-6, atol=1e-8 * np.abs(K).max())


def test_filter_with_a_traced_process_noise(benchmark):
    q = np.array([1e-5, 3e-3])
    gains = jax.jit(
        jax.vmap(lambda x: ADFC(no=jnp.asarray(1023), q=x).prepare(benchmark).estimator.filter_gain)
    )(q)
    for i in range(2):
        host = design_kalman(benchmark.plant_model, q[i], benchmark.r_mm2).filter_gain
        np.testing.assert_allclose(gains[i], host, rtol=1e-8, atol=1e-10)
