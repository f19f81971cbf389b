"""Three-variable control: its variables are derivatives, its command a plain loop's."""

import numpy as np
import pytest
from scipy import linalg, signal

from martths_jax import InputError, draw_plants, indices, simulate
from martths_jax.control.controllers import MFF, ThreeVariable
from martths_jax.stability import delay_margin, spectral_radius
from tests.control.driven import driven, strokes
from tests.engine.motions import burst

NONE = (0.0, 0.0)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_what_is_fed_back_is_the_stroke_and_its_derivatives(benchmark, order):
    """Of the plant's own motion, by its matrix exponential: fourth-order differences."""
    A, B, C = benchmark.plant_continuous
    rng, h = np.random.default_rng(3), 3e-5
    z, u = 1e-3 * rng.standard_normal(8), rng.standard_normal(2)
    generator = np.block([[A, B], [np.zeros((2, 10))]])

    def stroke(t):
        return C @ (linalg.expm(t * generator) @ np.r_[z, u])[:8]

    at = [stroke(n * h) for n in (-2, -1, 0, 1, 2)]
    expected = [
        at[2],
        (at[0] - 8 * at[1] + 8 * at[3] - at[4]) / (12 * h),
        (-at[0] + 16 * at[1] - 30 * at[2] + 16 * at[3] - at[4]) / (12 * h**2),
    ][order]
    gains = {"g_x": NONE, "g_v": NONE, "g_a": NONE, f"g_{'xva'[order]}": (0.7, 0.3)}
    K_z, K_u = ThreeVariable(**gains).gains(benchmark)
    scale = np.abs(expected).max()
    np.testing.assert_allclose(
        K_z @ z + K_u @ u, np.array([0.7, 0.3]) * expected, atol=1e-5 * scale
    )


def oracle(benchmark, x_a, x_m, g, q, band):
    """(N, 2) commands: filter by iteration, closed loop by its frequency response, a plain loop."""
    A, B, C = benchmark.plant_continuous
    dt = benchmark.dt
    F, G = signal.cont2discrete((A, B, C, np.zeros((2, 2))), dt)[:2]
    P = q * G @ G.T
    for _ in range(4000):
        L = P @ C.T @ np.linalg.inv(C @ P @ C.T + benchmark.r_mm2 * np.eye(2))
        P = F @ (P - L @ C @ P) @ F.T + q * G @ G.T
    g_x, g_v, g_a = map(np.diag, g)
    K_z, K_u = g_x @ C + g_v @ C @ A + g_a @ C @ A @ A, g_a @ C @ A @ B
    differences = np.array([[1, 0, 0, 0], [1.5, -2, 0.5, 0], [2, -5, 4, -1]])
    f = np.linspace(0, band, 401)[1:]
    normal, side = 1e-9 * np.kron(np.eye(2), differences @ differences.T) * len(f), 0
    for z in np.exp(2j * np.pi * f * dt):
        # u = r - K_z z - K_u u / z, x = H u: the strokes of a unit r, and what is made of them.
        states = np.linalg.solve(z * np.eye(8) - F, G)
        x = C @ states @ np.linalg.inv(np.eye(2) + K_u / z + K_z @ states)
        phi = np.kron(x, (differences @ z ** -np.arange(4.0))[:, None])
        normal = normal + (phi @ phi.conj().T).real
        side = side + (phi * z).real
    k = np.linalg.solve(normal, side)
    padded, zeta = np.vstack([np.zeros((3, 2)), x_a]), np.zeros(8)
    u = np.zeros((len(x_a) + 1, 2))
    for n in range(len(x_a)):
        late = padded[n : n + 4][::-1]
        zeta = zeta + L @ (x_m[n] - C @ zeta)
        u[n] = k.T @ (differences @ late).T.ravel() - K_z @ zeta - K_u @ u[n - 1]
        zeta = F @ zeta + G @ u[n]
    return u[:-1]


def test_the_command_is_the_equations(benchmark):
    g = ((3.0, 2.0), (0.02, 0.03), (1e-5, 3e-5))
    x_a, x_m = strokes(150, trials=1), strokes(150, trials=1, seed=9)
    made = ThreeVariable(g_x=g[0], g_v=g[1], g_a=g[2], q_fb=0.02, band_hz=4.0)
    assert not made.problems(benchmark)
    u = driven(made.prepare(benchmark), benchmark, x_a, x_m)[0][..., 0]
    expected = oracle(benchmark, x_a[..., 0], x_m[..., 0], g, 0.02, 4.0)
    np.testing.assert_allclose(u, expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max())


def test_without_feedback_it_is_the_feedforward(benchmark):
    x_a = strokes(60)
    one = ThreeVariable(g_x=NONE, g_v=NONE, g_a=NONE, band_hz=5.0)
    u, expected = (
        driven(c.prepare(benchmark), benchmark, x_a)[0] for c in (one, MFF(order=2, band_hz=5.0))
    )
    np.testing.assert_allclose(u, expected, rtol=1e-9, atol=1e-9)


def test_feedback_of_the_stroke_shrinks_an_error_of_gain(benchmark):
    """At rest x = H (r - g x): of an error of H, 1 / (1 + g H) is left in the strokes."""
    A, B, C = ThreeVariable(g_x=(2.0, 2.0), g_v=NONE, g_a=NONE).closed_loop(benchmark)
    own, inner, outer = benchmark.plant_continuous
    H = -outer @ np.linalg.solve(own, inner)
    found = C @ np.linalg.solve(np.eye(len(A)) - A, B)
    np.testing.assert_allclose(found, np.linalg.solve(np.eye(2) + 2 * H, H), rtol=1e-9)


@pytest.mark.slow
def test_the_loop_is_stable_and_bears_delay(benchmark):
    plants, ready = draw_plants(8, seed=1), ThreeVariable().prepare(benchmark)
    assert spectral_radius(benchmark, ready, plants).max() < 0.9995
    assert delay_margin(benchmark, ready, plants).min() > 20.0


@pytest.mark.slow
def test_it_takes_the_plants_spread_away(benchmark):
    plants, motion, names = draw_plants(64, seed=1), burst(2.0), ["J2true_1", "J2true_2"]
    ours, ahead = (
        indices(simulate(benchmark, c, plants, motion, indices=names))
        for c in (ThreeVariable(), MFF(order=2))
    )
    for name in names:
        assert ours[name].max() < 0.7 * ahead[name].max()  # false for NaN, which a lost trial has


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"g_x": (1.0,)}, "`g_x` must be two numbers, known before the run"),
        ({"q_fb": 0.0}, "`q_fb` must be positive"),
        ({"band_hz": np.array([3.0, 4.0])}, "`band_hz` must be one number"),
        ({"g_x": (-2.0, 0.0)}, "`g_x, g_v, g_a` must give feedback that is stable on the nominal"),
    ],
)
def test_what_cannot_be_used_is_refused(benchmark, settings, message):
    with pytest.raises(InputError, match=message):
        simulate(benchmark, ThreeVariable(**settings), draw_plants(2), burst(0.3))
