"""Guards of adaptive controllers, each beside its textbook, and their algebra."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax.algebra import least_squares as ls
from martths_jax.control.adaptive import (
    BackwardDifferences,
    Bounds,
    ConditionGate,
    ExcitationGate,
    Fading,
    MotionThreshold,
    NoiseRemoval,
    Pull,
    PullToLast,
    RandomWalk,
    RateLimit,
    ShapedPull,
    Window,
    fir,
    noise_covariance,
)
from martths_jax.control.controllers import AdaptiveFeedforward
from martths_jax.control.estimators import design_kalman
from martths_jax.structure.modal import to_dense
from tests.control.pieces_oracle import NOISE, PLANT, TARGET, engine, textbook, window

NB, REACH = 12, 2
VELOCITY = BackwardDifferences(order=1, accuracy=2)
RNG = np.random.default_rng(11)
ANCHOR, PULL = RNG.standard_normal((4, 2)), np.array([0.3, 2.0, 0.1, 0.7])
SHAPED = np.diag(PULL) + 0.05
NOISY = 0.02 * (np.eye(4) + 0.3)


def compare(benchmark, guards, joint=True, still=0, **textbook_guard):
    """A window with guards beside its textbook; `still` samples of nearly no motion first."""
    quiet = np.where(np.arange(len(TARGET)) < still, 0.03, 1.0)[:, None, None]
    given = {"target": quiet * TARGET, "noise": quiet * NOISE}
    controller = AdaptiveFeedforward(VELOCITY, Window(NB), guards, joint=joint)
    found = engine(controller, benchmark, **given)
    learn = window(NB, reach=REACH, **textbook_guard)
    expected = textbook(VELOCITY.matrix, joint, learn, **given)
    for name, a, b in zip(("C", "u", "held"), found, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-11, err_msg=name)
    free = engine(replace(controller, guards=()), benchmark, **given)
    assert np.abs(free[0] - found[0]).max() > 0.01  # the guard has done something
    return found


@pytest.mark.parametrize(
    ("guard", "change"),
    [
        (Pull(0.8, ANCHOR), lambda G, h, last, part: (G + 0.8 * np.eye(4), h + 0.8 * ANCHOR)),
        (Pull(0.8), lambda G, h, last, part: (G + 0.8 * np.eye(4), h + 0.8 * FOLLOW)),
        (ShapedPull(PULL, ANCHOR),
         lambda G, h, last, part: (G + np.diag(PULL), h + PULL[:, None] * ANCHOR)),
        (ShapedPull(SHAPED, ANCHOR), lambda G, h, last, part: (G + SHAPED, h + SHAPED @ ANCHOR)),
        (PullToLast(5.0), lambda G, h, last, part: (G + 5 * np.eye(4), h + 5 * last)),
        (NoiseRemoval(NOISY), lambda G, h, last, part: (G - NB * NOISY, h)),
    ],
    ids=["number", "towards start", "diagonal", "matrix", "last", "noise"],
)  # fmt: skip
def test_what_changes_the_normal_equations(benchmark, guard, change):
    compare(benchmark, (guard,), change=change)


FOLLOW = np.zeros((4, 2))
FOLLOW[0, 0] = FOLLOW[2, 1] = 1.0


def test_guards_of_one_actuator_use_its_own_column(benchmark):
    anchor = RNG.standard_normal((2, 2))
    weight = np.stack([np.diag([0.5, 1.0]), np.diag([2.0, 0.1])])
    compare(
        benchmark, (ShapedPull(weight, anchor),), joint=False,
        change=lambda G, h, last, part: (
            G + weight[part], h + weight[part] @ anchor[:, [part]]
        ),
    )  # fmt: skip


def test_guards_apply_one_after_another(benchmark):
    """The pull comes on top of what noise removal has left, the rate limit after the bounds."""
    low, high, most = np.full((4, 2), -0.3), np.full((4, 2), 0.9), 0.05
    held = compare(
        benchmark,
        (NoiseRemoval(NOISY), Pull(0.8, ANCHOR), Bounds(low, high), RateLimit(most)),
        change=lambda G, h, *_: (G - NB * NOISY + 0.8 * np.eye(4), h + 0.8 * ANCHOR),
        cut=lambda C, last, part: last + np.clip(np.clip(C, low, high) - last, -most, most),
    )[2]
    assert not held.any()


def test_the_condition_gate_holds_what_is_ill(benchmark):
    """Some fits are held at a limit in the middle of what these have."""

    def good(C, G, phi, part):
        pivots = np.diag(np.linalg.cholesky(G)) ** 2
        return np.min(pivots / np.diag(G)) >= 1 / 3.0

    held = compare(benchmark, (ConditionGate(3.0),), good=good)[2]
    assert 0 < held[-1].min() and held[-1].max() < len(TARGET) - NB - REACH


def test_the_excitation_gate_holds_until_the_motion_tops_the_noise(benchmark):
    variance = np.array([1.0, 0.5, 1.0, 0.5]) * 0.1

    def good(C, G, phi, part):
        return np.all(np.diag(np.linalg.cholesky(G)) ** 2 > 3.0 * NB * variance)

    held = compare(benchmark, (ExcitationGate(3.0, variance),), still=30, good=good)[2]
    assert 10 < held[-1].min() and held[-1].max() < len(TARGET) - NB - REACH


@pytest.mark.parametrize("joint", [True, False])
def test_coefficients_are_held_while_nothing_moves(benchmark, joint):
    columns = [0, 2] if joint else [0]

    def good(C, G, phi, part):
        mean = 0.0
        for row in phi:
            mean += (np.abs(row[columns]).max() - mean) / 4
        return mean > 0.2

    guards = (MotionThreshold(0.2, 4.0),)
    held = compare(benchmark, guards, joint=joint, still=30, good=good)[2]
    assert held[-1].min() > 10


@pytest.mark.parametrize("refuse", [False, True])
def test_bounds_cut_or_refuse(benchmark, refuse):
    low, high = FOLLOW - 0.4, FOLLOW + RNG.uniform(0.2, 0.5, (4, 2))
    inside = lambda C, *_: not refuse or np.all((C >= low) & (C <= high))  # noqa: E731
    C, _, held = compare(
        benchmark, (Bounds(low, high, refuse),), good=inside,
        cut=lambda C, *_: np.clip(C, low, high),
    )  # fmt: skip
    assert np.all((C >= low[..., None]) & (C <= high[..., None]))
    assert bool(held[-1].min() > 0) == refuse


def test_a_rate_limit_for_each_coefficient(benchmark):
    most = RNG.uniform(0.01, 0.1, (4, 2))
    cut = lambda C, last, part: last + np.clip(C - last, -most, most)  # noqa: E731
    C, *_ = compare(benchmark, (RateLimit(most),), cut=cut)
    np.testing.assert_allclose(np.abs(np.diff(C, axis=0)).max(axis=(0, 3)), most, rtol=1e-9)


def test_a_held_sample_leaves_a_recursive_fit_as_it_was(benchmark):
    """Its covariance too: samples that are not used might as well not have been."""
    moving = np.arange(len(TARGET)) % 3 == 0
    jumps = np.where(moving, 1.0, 0.0)[:, None, None]
    given = {"target": TARGET, "noise": 10.0 * jumps + NOISE}
    free = AdaptiveFeedforward(fir(1), RandomWalk(0.5), (MotionThreshold(4.0),), joint=False)
    C, _, held = engine(free, benchmark, **given)
    strokes = [np.zeros(2)] * 2
    P, last = np.full((2, 2), 0.5), np.ones((2, 2))  # actuator, trial
    u = np.zeros((2, 2))
    for k in range(len(TARGET)):
        strokes = PLANT @ u + given["noise"][k]
        gain = P * strokes / (strokes * P * strokes + 1)
        use = np.abs(strokes) > 4.0
        last = np.where(use, last + gain * (u - strokes * last), last)
        P = np.where(use, P - gain * strokes * P, P)
        np.testing.assert_allclose(C[k, 0], last, rtol=1e-9)
        u = last * TARGET[k]
    assert 0 < held[-1].min() < 2 * len(TARGET)


def test_packed_algebra_is_that_of_whole_matrices():
    rng = np.random.default_rng(1)
    A, W, c = rng.standard_normal((9, 4)), rng.standard_normal((4, 4)), rng.standard_normal((4, 2))
    W, G, h = W + W.T, A.T @ A, rng.standard_normal((4, 2))
    rows = tuple(tuple(jnp.full(1, x) for x in (*G[j, j:], *h[j])) for j in range(4))
    found = [np.asarray(x)[..., 0] for x in ls.full_matrices(ls.weighted(rows, W, c))]
    np.testing.assert_allclose(found[0], G + W, rtol=1e-12)
    np.testing.assert_allclose(found[1], h + W @ c, rtol=1e-12)
    found = [np.asarray(x)[..., 0] for x in ls.full_matrices(ls.weighted(rows, W))]
    np.testing.assert_allclose(found[1], h, rtol=0)
    expected = np.diag(np.linalg.cholesky(G)) ** 2
    np.testing.assert_allclose(np.ravel(ls.pivots(rows)), expected, rtol=1e-12)


def test_noise_alone_in_a_regressor(benchmark):
    """The Kalman filter's response to a noisy sample, with dense matrices, and many samples."""
    controller = AdaptiveFeedforward().prepare(benchmark)
    found = noise_covariance(benchmark, controller)
    A, _, C, _ = to_dense(benchmark.plant_model)
    gain = np.asarray(design_kalman(benchmark.plant_model, 3e-5, benchmark.r_mm2).filter_gain)
    L = np.swapaxes(gain, 0, 1).reshape(-1, 2)
    left = np.eye(len(A)) - L @ C
    impulse, state = [C @ L], A @ L
    for _ in range(5999):
        impulse.append(C @ left @ state)
        state = A @ left @ state
    total = np.sum(impulse, axis=2)  # both sensors hear the same noise
    rows = BackwardDifferences().matrix
    phi = np.array([np.convolve(total[:, a], row) for a in range(2) for row in rows])
    np.testing.assert_allclose(found[0], benchmark.r_mm2 * phi @ phi.T, rtol=1e-9, atol=1e-20)

    apart = noise_covariance(benchmark, replace(controller, joint=False))
    np.testing.assert_array_equal(apart, [found[0][:4, :4], found[0][4:, 4:]])
    raw = replace(controller, learns_from="measurement")
    own = np.kron(np.eye(2), rows @ rows.T) * benchmark.r_mm2
    np.testing.assert_allclose(noise_covariance(benchmark, raw, shared=False)[0], own, rtol=1e-12)


def test_gates_find_the_noise_by_themselves(benchmark):
    whole = AdaptiveFeedforward(guards=(ExcitationGate(2.0), NoiseRemoval()))
    gate, removal = whole.prepare(benchmark).guards
    covariance = noise_covariance(benchmark, whole.prepare(benchmark))
    np.testing.assert_array_equal(removal.covariance, covariance)
    np.testing.assert_array_equal(gate.variance, covariance)
    assert gate.pairs == removal.pairs == 1024
    fading = replace(whole, fit=Fading(forgetting=0.99)).prepare(benchmark)
    assert fading.guards[0].pairs == pytest.approx(100)
