"""Filters of an actuator's parameters: beside whole matrices, and on plants that are the model."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import signal

from martths_jax import InputError, draw_plants, simulate
from martths_jax.control.adaptive import joint
from martths_jax.control.adaptive.actuator import StateSpace, TransferFunction
from martths_jax.control.controllers import EKFSS, EKFTF, UKFSS, UKFTF, ekf_tf, ukf_ss
from martths_jax.control.controllers.parameter_filter import COUPLING, CURVATURE, GAIN, LEAD_S
from martths_jax.stability import spectral_radius
from tests.control.driven import driven, strokes
from tests.engine.motions import burst

FS = 1024.0
KINDS = (EKFTF, UKFTF, EKFSS, UKFSS)
MODELS = (TransferFunction(), StateSpace())
STARTS = np.array([GAIN, LEAD_S, CURVATURE, COUPLING])


def rise_of(tf, p, x, d, u, other):
    """Either model, written down again."""
    if tf:
        return (p[2] * d + u + p[3] * other - p[0] * x) / (p[1] + p[2])
    return p[1] * d - p[0] * x + p[2] * u + p[3] * other


def rise_in(tf, start, u, other, z):
    """The same of a state (x, d, parameters relative to the start)."""
    return rise_of(tf, start * z[2:], z[0], z[1], u, other)


def start_of(tf):
    """(4, 2) parameters in samples: p_2 x'' + p_1 x' + p_0 x = u + c u_j in differences."""
    p0, p1, p2, c = STARTS * np.array([1, FS, FS**2, 1])[:, None]
    if tf:
        return np.stack([p0, p1, p2, c])
    return np.stack([p0, p2, np.ones(2), c]) / (p1 + p2)


def spread_out(P):
    """Upper triangle, row by row, of a dense matrix."""
    return tuple(tuple(jnp.asarray([P[i, j]]) for j in range(i, len(P))) for i in range(len(P)))


def dense(P):
    n = len(P)
    return np.array([[P[min(i, j)][abs(i - j)][0] for j in range(n)] for i in range(n)])


def numbers(x):
    return tuple(jnp.asarray([v]) for v in x)


def positive(rng, n=6):
    M = rng.normal(size=(n, n))
    return M @ M.T / n + 0.1 * np.eye(n)


def unscented_textbook(move, x, P, alpha):
    """Mean and covariance after ``move``, from weighted sigma points; beta = 2, kappa = 0."""
    n = len(x)
    lam = alpha**2 * n - n
    L = np.linalg.cholesky((n + lam) * P)
    points = np.array([x, *(x + L.T), *(x - L.T)])
    w = np.full(2 * n + 1, 0.5 / (n + lam))
    mean_w, cov_w = w.copy(), w.copy()
    mean_w[0] = lam / (n + lam)
    cov_w[0] = mean_w[0] + 1 - alpha**2 + 2
    moved = np.array([move(p) for p in points])
    mean = mean_w @ moved
    away = moved - mean
    return mean, away.T @ (cov_w[:, None] * away)


def whole(f):
    """xi at k + 1 from xi at k, given its rise."""
    return lambda x: np.concatenate([[x[0] + f(x), f(x)], x[2:]])


@pytest.mark.parametrize("model", MODELS, ids=["tf", "ss"])
def test_a_models_slopes_and_demand_are_those_of_its_rise(model):
    rng = np.random.default_rng(1)
    p, (x, d, u, other) = list(rng.uniform(0.5, 2, 4)), rng.normal(size=4)
    tf = model == MODELS[0]
    rise = model.rise(p, x, d, u, other)
    np.testing.assert_allclose(rise, rise_of(tf, p, x, d, u, other), rtol=1e-14)
    expected = jax.grad(lambda z: model.rise(list(z[2:]), z[0], z[1], u, other))(
        jnp.array([x, d, *p])
    )
    np.testing.assert_allclose(model.slopes(p, x, d, u, other), expected, rtol=1e-12)
    wanted = u + model.coupling(p) * other
    np.testing.assert_allclose(model.demand(p, x, d, rise), wanted, rtol=1e-12)


def test_both_models_are_the_continuous_actuator():
    """A step through p_2 x'' + p_1 x' + p_0 x = u by SciPy; the error falls as the period does."""
    p0, p1, p2, _ = STARTS[:, 0]
    seconds, errors = 0.1, []
    for fs in (4096, 8192):
        t = np.arange(round(seconds * fs)) / fs
        _, exact = signal.step((1.0, (p2, p1, p0)), T=t)
        both = []
        for model in MODELS:
            p, x, d, path = model.from_seconds(*STARTS[:, 0], fs), 0.0, 0.0, []
            for _ in t:
                path.append(x)
                d = model.rise(p, x, d, 1.0, 0.0)
                x = x + d
            both.append(path)
        np.testing.assert_allclose(*both, rtol=1e-9)
        errors.append(np.abs(both[0] - exact).max())
    assert errors[0] < 5e-3
    assert 1.9 < errors[0] / errors[1] < 2.1


def test_where_the_model_is_linear_all_filters_are_the_linear_one():
    """f = a' xi, any covariance: both predictions and the correction beside whole matrices."""
    rng = np.random.default_rng(2)
    a, x, P = 0.4 * rng.normal(size=6), rng.normal(size=6), positive(rng)
    F = np.eye(6)
    F[1], F[0] = a, np.eye(6)[0] + a
    H, r, w, v = np.eye(6)[:1], 0.3, 0.02, 0.01 * np.arange(1.0, 5.0)
    Q = np.diag([0.0, 0.0, *v])
    Q[:2, :2] = w
    f = lambda xi: sum(c * z for c, z in zip(a, xi, strict=True))  # noqa: E731
    extended = lambda xi, P: joint.extended(f(xi), a, xi, P)  # noqa: E731
    ways = [extended, *(lambda xi, P, s=s: joint.unscented(f, xi, P, s) for s in (1.0, 0.3))]
    for predict in ways:
        xi, T, mean, cov = numbers(x), spread_out(P), x, P
        for y in rng.normal(size=8):
            gain = cov @ H.T / (H @ cov @ H.T + r)
            mean = mean + gain[:, 0] * (y - mean[0])
            cov = (np.eye(6) - gain @ H) @ cov
            mean, cov = F @ mean, F @ cov @ F.T + Q
            xi, T = joint.correct(xi, T, jnp.asarray([y]), r)
            xi, T = predict(xi, T)
            T = joint.add(T, w, tuple(v))
            np.testing.assert_allclose(np.ravel(xi), mean, rtol=1e-9, atol=1e-11)
            np.testing.assert_allclose(dense(T), cov, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("alpha", [1.0, 0.4])
def test_sigma_points_beside_whole_matrices(alpha):
    rng = np.random.default_rng(3)
    x, P = np.array([0.5, 0.1, 1.0, 1.2, 0.9, 0.3]), 0.05 * positive(rng)
    f = lambda z: rise_of(True, z[2:], z[0], z[1], 0.7, -0.4)  # noqa: E731
    mean, cov = unscented_textbook(whole(f), x, P, alpha)
    xi, T = joint.unscented(f, numbers(x), spread_out(P), alpha)
    np.testing.assert_allclose(np.ravel(xi), mean, rtol=1e-11)
    np.testing.assert_allclose(dense(T), cov, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("alpha", [1.0, 0.2])
def test_sigma_points_have_the_mean_of_a_quadratic(alpha):
    """E f = f(m) + tr(S P) for f = x' S x."""
    rng = np.random.default_rng(4)
    x, P, S = rng.normal(size=6), positive(rng), rng.normal(size=(6, 6))
    S = S + S.T
    f = lambda z: sum(S[i, j] * z[i] * z[j] for i in range(6) for j in range(6))  # noqa: E731
    xi, _ = joint.unscented(f, numbers(x), spread_out(P), alpha)
    np.testing.assert_allclose(xi[1], x @ S @ x + np.trace(S @ P), rtol=1e-9)


def test_the_root_of_a_matrix_with_and_without_variance_in_all():
    rng = np.random.default_rng(5)
    P = positive(rng)
    P[:, 1] = P[1] = 0.0
    for full in (positive(rng), P):
        columns = joint.cholesky(spread_out(full))
        L = np.zeros((6, 6))
        for j, column in enumerate(columns):
            L[j:, j] = np.ravel(column)
        np.testing.assert_allclose(L @ L.T, full, rtol=1e-12, atol=1e-14)


def textbook(kind, x_a, x_m, r, spread, walk, disturbance, alpha=1.0):
    """Commands (N, 2) and relative parameters (N, 4, 2) by whole matrices, step after step."""
    tf, extended = kind in (EKFTF, UKFTF), kind in (EKFTF, EKFSS)
    start = start_of(tf)
    xi = [np.array([0, 0, 1.0, 1, 1, 1]) for _ in range(2)]
    P = [np.diag([0.0, 0, *[spread**2] * 4]) for _ in range(2)]
    Q = np.diag([0.0, 0, *[walk**2 / FS] * 4])
    Q[:2, :2] += disturbance**2
    low, high = (0.5, 0.25, 0.0, -3.0), (2.0, 4.0, 8.0, 3.0)
    if not tf:  # phi < 1 decays
        low, high = (0.25, 0.0, 0.25, -3.0), (4.0, 0.95 / start[1], 4.0, 3.0)
    low, high = (np.array([np.broadcast_to(x, 2) for x in limit]) for limit in (low, high))
    past = np.vstack([np.zeros((2, 2)), x_a])
    u_all, theta_all = [], []
    for k in range(len(x_a)):
        for i in range(2):
            gain = P[i][:, 0] / (P[i][0, 0] + r)
            xi[i] = xi[i] + gain * (x_m[k, i] - xi[i][0])
            P[i] = P[i] - np.outer(gain, P[i][0])
            xi[i][2:] = np.clip(xi[i][2:], low[:, i], high[:, i])
        theta = np.array([one[2:] for one in xi]).T
        p = start * theta
        x, one, two = past[k + 2], past[k + 1], past[k]
        after = 3 * x - 3 * one + two
        # M u = what is left of the model's rise without commands
        M, rest = np.zeros((2, 2)), np.zeros(2)
        for i in range(2):
            free = rise_of(tf, p[:, i], x[i], x[i] - one[i], 0.0, 0.0)
            M[i, i] = rise_of(tf, p[:, i], 0.0, 0.0, 1.0, 0.0)
            M[i, 1 - i] = rise_of(tf, p[:, i], 0.0, 0.0, 0.0, 1.0)
            rest[i] = after[i] - x[i] - free
        u = np.linalg.solve(M, rest)
        u_all.append(u)
        theta_all.append(theta)
        for i in range(2):
            f = partial(rise_in, tf, start[:, i], u[i], u[1 - i])
            if extended:
                small = 1e-30j
                slopes = [f(xi[i] + small * e).imag / 1e-30 for e in np.eye(6)]
                F = np.eye(6)
                F[1], F[0] = slopes, np.eye(6)[0] + slopes
                xi[i], P[i] = whole(f)(xi[i]), F @ P[i] @ F.T + Q
            else:
                tiny = 1e-18 * np.eye(6)  # Cholesky's of LAPACK wants a variance in all
                xi[i], moved = unscented_textbook(whole(f), xi[i], P[i] + tiny, alpha)
                P[i] = moved + Q
    return np.array(u_all), np.array(theta_all)


@pytest.mark.parametrize("kind", KINDS)
def test_the_whole_controller_beside_whole_matrices(benchmark, kind):
    numbers = {"spread": 0.05, "walk": 0.2, "disturbance": 0.02}
    x_a = strokes(80, 2)
    x_m = 0.8 * np.roll(x_a, 20, axis=0) + 0.01 * np.random.default_rng(6).normal(size=x_a.shape)
    u, said = driven(kind(**numbers).prepare(benchmark), benchmark, x_a, x_m)
    for trial in range(2):
        expected, theta = textbook(
            kind, x_a[..., trial], x_m[..., trial], benchmark.r_mm2, **numbers
        )
        np.testing.assert_allclose(said["theta"][..., trial], theta, rtol=1e-6, atol=1e-7)
        np.testing.assert_allclose(u[..., trial], expected, rtol=1e-6, atol=1e-6)
    assert np.abs(theta[-1] - 1).max() > 0.05


@pytest.mark.parametrize("kind", KINDS)
def test_a_plant_that_is_the_model_is_found(benchmark, kind):
    """Two coupled actuators, noiseless, commands of many frequencies."""
    made = kind(spread=0.3, walk=0.0, disturbance=1e-7).prepare(benchmark)
    made = type(made)(**{**vars(made), "r": jnp.asarray(1e-12)})
    tf = kind in (EKFTF, UKFTF)
    truth = np.array([[1.1, 0.9], [0.85, 1.2], [1.2, 0.8], [0.7, 1.3]])
    p = start_of(tf) * truth
    commands = 3 * strokes(900, 1, seed=8)[..., 0] + np.random.default_rng(9).normal(size=(900, 2))
    x, d = np.zeros(2), np.zeros(2)
    measured = []
    for u in commands:
        measured.append(x)
        d = np.array([rise_of(tf, p[:, i], x[i], d[i], u[i], u[1 - i]) for i in range(2)])
        x = x + d

    def sample(carry, given):
        xi, P = joint.correct(*carry, given[0][:, None], made.r)
        xi, P = made.predicted(xi, P, made.p(xi[2:]), given[1][:, None])
        return (xi, joint.add(P, made.disturbance**2, (0.0,) * 4)), jnp.stack(xi[2:])

    state = made.init(1)
    series = jnp.asarray(np.array(measured)), jnp.asarray(commands)
    found = np.asarray(jax.lax.scan(sample, (state["xi"], state["P"]), series)[1][-1])[..., 0]
    np.testing.assert_allclose(found, truth, rtol=3e-3)


@pytest.mark.parametrize("kind", [EKFTF, EKFSS])
def test_a_known_plant_follows_a_parabola_exactly(benchmark, kind):
    """The frozen inverse before a plant that is its model, from where the target is at first."""
    tf = kind is EKFTF
    theta = np.array([[1.1, 0.9], [0.8, 1.1], [1.3, 0.7], [0.9, 1.2]])
    p = start_of(tf) * theta
    t = np.arange(40)[:, None] / FS
    x_a = np.array([1.0, -2.0]) + np.array([30.0, 10.0]) * t + np.array([-400.0, 900.0]) * t**2
    frozen = kind().frozen(benchmark, theta)
    u = driven(frozen, benchmark, x_a[..., None])[0][..., 0]
    first = 3  # samples that make a whole parabola
    x, d = x_a[first], x_a[first] - x_a[first - 1]
    for k in range(first, 39):
        d = np.array([rise_of(tf, p[:, i], x[i], d[i], u[k, i], u[k, 1 - i]) for i in range(2)])
        x = x + d
        np.testing.assert_allclose(x, x_a[k + 1], rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [EKFTF, EKFSS])
def test_the_frozen_loop_is_stable(benchmark, kind):
    """At the start, and about where a run on ``elcentro-like`` ends."""
    end = np.array([[1.15, 1.1], [0.8, 1.1], [1.4, 0.0], [1.4, 1.7]])
    if kind is EKFSS:
        end = np.array([[1.0, 0.85], [1.25, 1.2], [0.85, 0.75], [1.3, 1.3]])
    for theta in (np.ones((4, 2)), end, np.stack([end] * 8, axis=-1)):
        frozen = kind().frozen(benchmark, theta)
        assert spectral_radius(benchmark, frozen, draw_plants(8, seed=1)).max() < 0.9996


@pytest.mark.slow
@pytest.mark.parametrize("kind", [EKFTF, UKFSS])
def test_numbers_may_differ_from_trial_to_trial(benchmark, kind, monkeypatch):
    monkeypatch.setattr(kind, "first_lag_range", 2)
    lead = np.array([[0.06, 0.08], [0.02, 0.03]])
    walk, plants = np.array([0.01, 0.1]), draw_plants(2, seed=1)
    each = [kind(lead=lead[:, i], walk=float(walk[i])) for i in range(2)]
    one, other = (
        simulate(benchmark, c, plants, burst(0.2), keep=True).signals["theta"]
        for c in (kind(lead=lead, walk=walk), each)
    )
    np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize(
    ("module", "settings", "message"),
    [
        (ekf_tf, {"lead": (0.0, 0.02)}, r"`lead` must be 2 numbers"),
        (ekf_tf, {"coupling": (0.5, 0.1)}, r"`coupling` must be 2 numbers from -0.3 to 0.3"),
        (ekf_tf, {"alpha": 1.0}, "`settings` must be among gain, lead"),
        (ukf_ss, {"alpha": 1.5}, "`alpha` must be a number from 0 to 1"),
        (ukf_ss, {"disturbance": 0.0}, r"`disturbance` must be a number above 0 \(mm\)"),
    ],
)
def test_settings_that_cannot_be_used(benchmark, module, settings, message):
    with pytest.raises(InputError, match=message):
        module.ENTRY.build(benchmark, **settings)


def test_arguments_of_the_class_that_cannot_be_used(benchmark):
    for settings, message in (
        ({"gain": 1.0}, "`gain` must be two numbers"),
        ({"coupling": (0.4, 0.0)}, "`coupling` must lie from -0.3 to 0.3"),
        ({"walk": -1.0}, "`walk` must be zero or positive"),
    ):
        assert any(message in text for text in EKFTF(**settings).problems(benchmark)), message
