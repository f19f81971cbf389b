"""Sliding mode with a discrete model: the surface by SciPy, both laws by a plain loop."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import linalg, signal

from martths_jax import Compensator, InputError, draw_plants, simulate
from martths_jax.control.controllers import SlidingADM, SlidingSwitching
from martths_jax.control.controllers.sliding_adm import law
from martths_jax.stability import spectral_radius
from tests.control.driven import strokes
from tests.engine.motions import burst

FS, E = 1024.0, (3e6, 2e7)
ROWS = np.array([[1, 0, 0], [1, -1, 0], [1, -2, 1]]) * (0.02 * FS) ** np.arange(3.0)[:, None]


@pytest.fixture(scope="module")
def plant(benchmark):
    """A, B, C; A*, B*, Lambda."""
    A, B, C = benchmark.plant_continuous
    A_s = np.block([[A, np.zeros((8, 2))], [-C, np.zeros((2, 2))]])
    B_s = np.vstack([B, np.zeros((2, 2))])
    P = B_s.T @ linalg.solve_continuous_are(A_s, B_s, np.diag([0.0] * 8 + list(E)), np.eye(2))
    return A, B, C, A_s, B_s, np.linalg.solve(P @ B_s, P)


def test_the_distance_from_the_surface_fades(benchmark, plant):
    """s' = -eta s whatever X is, and on the surface all motions fade too."""
    *_, A_s, B_s, surface = plant
    K, K_e = (np.asarray(x) for x in law(benchmark, E, 40.0))
    closed = A_s + B_s @ np.hstack([-K, K_e])
    np.testing.assert_allclose(
        surface @ closed, -40.0 * surface, rtol=1e-6, atol=1e-6 * np.abs(surface @ A_s).max()
    )
    poles = np.linalg.eigvals(closed)
    assert np.sum(np.abs(poles + 40.0) < 1e-3) == 2 and poles.real.max() < -10.0


@pytest.mark.parametrize("kind", [SlidingADM, SlidingSwitching])
def test_the_start_makes_up_for_the_lag_behind_a_ramp(benchmark, plant, kind):
    """T(s) = I - L s + ... of the inner loop, by its response next to rest."""
    A, B, C, _, _, surface = plant
    made = kind(e=E, reach=40.0)
    K, K_e = (np.asarray(x) for x in law(benchmark, E, 40.0))
    closed = np.block([[A - B @ K, B @ K_e], [-C, np.zeros((2, 2))]])
    direct = B @ surface[:, 8:] if kind is SlidingSwitching else np.zeros((8, 2))
    driven = np.vstack([-direct, np.eye(2)])
    T = [
        np.hstack([C, np.zeros((2, 2))]) @ np.linalg.solve(s * np.eye(10) - closed, driven)
        for s in (-1e-3, 0.0, 1e-3)
    ]
    np.testing.assert_allclose(T[1], np.eye(2), atol=1e-9)
    expected = (T[0] - T[2]) / 2e-3
    np.testing.assert_allclose(made.ramp_lag(benchmark), expected, rtol=1e-5, atol=1e-7)
    start = np.asarray(made.prepare(benchmark).outer.start)
    np.testing.assert_allclose(start, [[1, 1], np.diag(expected) / 0.02, [0, 0]], rtol=1e-5)


def driven_box(ready, benchmark, x_a, x_m):
    """Commands and signals (N, ..., T) of a prepared controller and its filter on strokes."""
    box = Compensator(ready, ready.estimator, benchmark.dt)

    def sample(state, given):
        state, command, signals = box.step(state, *given)
        return state, (command, signals)

    given = jnp.asarray(x_a), jnp.asarray(x_m)
    done = jax.jit(lambda g: jax.lax.scan(sample, box.init(x_a.shape[2]), g)[1])(given)
    return jax.tree.map(np.asarray, done)


def oracle(benchmark, plant, x_a, x_m, theta, eta, q, kappa=None, phi=None):
    """(N, 2) r, u and s of one trial."""
    A, B, C, A_s, _, surface = plant
    dt = benchmark.dt
    F, G = signal.cont2discrete((A, B, C, np.zeros((2, 2))), dt)[:2]
    P = q * G @ G.T
    for _ in range(4000):
        L = P @ C.T @ np.linalg.inv(C @ P @ C.T + benchmark.r_mm2 * np.eye(2))
        P = F @ (P - L @ C @ P) @ F.T + q * G @ G.T
    gain = surface @ A_s + eta * surface
    padded = np.vstack([np.zeros((2, 2)), 2 * x_a - np.vstack([np.zeros((1, 2)), x_a[:-1]])])
    zeta, summed, switched = np.zeros(8), np.zeros(2), np.zeros(2)
    r, u, s = np.zeros_like(x_a), np.zeros((len(x_a) + 1, 2)), np.zeros_like(x_a)
    for k in range(len(x_a)):
        r[k] = np.sum(theta[k] * (ROWS @ padded[k : k + 3][::-1]), axis=0)
        zeta = zeta + L @ (x_m[k] - C @ zeta)
        error = r[k] - C @ zeta
        s[k] = surface @ np.r_[A @ zeta + B @ u[k - 1], error]
        summed = summed + dt * error
        u[k] = -gain @ np.r_[zeta, summed]
        if kappa:
            switched = switched + dt * kappa * np.clip(s[k] / phi, -1, 1)
            u[k] -= surface[:, 8:] @ r[k] + switched
        zeta = F @ zeta + G @ u[k]
    return r, u[:-1], s


def test_the_linear_law_is_its_equations(benchmark, plant):
    x_a, x_m = strokes(200, trials=1), strokes(200, trials=1, seed=9)
    made = SlidingADM(e=E, reach=40.0, q=1e-3)
    assert not made.problems(benchmark)
    u, said = driven_box(made.prepare(benchmark), benchmark, x_a, x_m)
    theta = said["C_A"][..., 0]
    assert np.ptp(theta, axis=0).min() > 1e-3, "the model adapts"
    r, expected, _ = oracle(benchmark, plant, x_a[..., 0], x_m[..., 0], theta, 40.0, 1e-3)
    np.testing.assert_allclose(said["r"][..., 0], r, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(u[..., 0], expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max())


def test_the_switching_law_is_its_equations(benchmark, plant):
    x_a, x_m = strokes(200, trials=1), strokes(200, trials=1, seed=9)
    made = SlidingSwitching(e=E, reach=40.0, q=1e-3, switch=50.0, layer=0.3)
    assert not made.problems(benchmark)
    u, said = driven_box(made.prepare(benchmark), benchmark, x_a, x_m)
    given = benchmark, plant, x_a[..., 0], x_m[..., 0], said["C_A"][..., 0], 40.0, 1e-3
    r, expected, s = oracle(*given, 50.0, 0.3)
    np.testing.assert_allclose(said["r"][..., 0], r, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(u[..., 0], expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max())
    assert 0.05 < np.mean(np.abs(s) > 0.3) < 0.95, "both in and out of the layer"


@pytest.mark.parametrize("kind", [SlidingADM, SlidingSwitching])
def test_frozen_it_is_what_does_not_adapt(benchmark, kind):
    x_a, x_m = strokes(80), strokes(80, seed=9)
    theta = jnp.array([[1.1, 0.9], [0.5, 0.8], [0.1, -0.1]])
    still = kind(threshold=1e9).prepare(benchmark)
    still = replace(still, outer=replace(still.outer, start=theta))
    settled = kind().frozen(benchmark, theta)
    assert not settled.adapts
    u, expected = (driven_box(c, benchmark, x_a, x_m)[0] for c in (settled, still))
    np.testing.assert_allclose(u, expected, rtol=1e-10, atol=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [SlidingADM, SlidingSwitching])
def test_the_loop_is_stable_where_it_starts_and_where_it_ends(benchmark, kind):
    plants, made = draw_plants(8, seed=1), kind()
    C = simulate(benchmark, made, plants, burst(2.0), keep=True).signals["C_A"]
    for theta in (C[:, 0], C[:, -1]):
        frozen = made.frozen(benchmark, np.moveaxis(theta, 0, -1))
        assert spectral_radius(benchmark, frozen, plants).max() < 0.9996


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (SlidingADM(reach=3000.0), "`e, reach` must give an inner loop that is stable at 1024 Hz"),
        (SlidingADM(e=(1.0,)), r"`e` must be 2 numbers above 0 \(1/s\^2\)"),
        (SlidingADM(cutoff=512.0), "`cutoff` must lie below 512 Hz"),
        (SlidingSwitching(switch=300.0), "`e, reach` must give an inner loop that is stable"),
        (SlidingSwitching(layer=0.0), r"`layer` must be a number above 0 \(mm\)"),
    ],
)
def test_what_cannot_be_used_is_refused(benchmark, made, message):
    with pytest.raises(InputError, match=message):
        simulate(benchmark, made, draw_plants(1), burst(0.3))
