"""Regressors, fits, filter and command law of adaptive controllers, each beside its textbook."""

from fractions import Fraction

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import signal

from martths_jax.control.adaptive import (
    BackwardDifferences,
    Fading,
    Linear,
    NormalisedGradient,
    Pair,
    RandomWalk,
    Recursive,
    TapMap,
    Window,
    butterworth,
    fir,
)
from martths_jax.control.adaptive.differences import BACKWARD_DIFFERENCES
from martths_jax.control.controllers import AdaptiveFeedforward
from tests.control.pieces_oracle import DT, TARGET, engine, textbook, window

VELOCITY = BackwardDifferences(order=1, accuracy=2)  # 2 columns, 3 samples
RNG = np.random.default_rng(7)


def spread(n, parts):
    """Symmetric positive matrices (parts, n, n)."""
    root = RNG.standard_normal((parts, n, n))
    return root @ np.swapaxes(root, 1, 2) + 0.5 * np.eye(n)


def compare(benchmark, expected, **pieces):
    found = engine(AdaptiveFeedforward(**{"regressor": VELOCITY} | pieces), benchmark)
    for name, a, b in zip(("C", "u", "held"), found, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-11, err_msg=name)
    # The coefficients have moved far, and apart from trial to trial.
    moved = np.abs(found[0][-1] - found[0][0]).max()
    assert moved > 0.05 and np.ptp(found[0][-1], axis=-1).max() > 0.01
    return found


@pytest.mark.parametrize("joint", [True, False])
@pytest.mark.parametrize("hop", [1, 3])
def test_window(benchmark, joint, hop):
    learn = window(12, hop, reach=2)
    found = compare(
        benchmark, textbook(VELOCITY.matrix, joint, learn), fit=Window(12, 12 - hop), joint=joint
    )
    # Each fit is a new one, and between fits the coefficients stay.
    changes = np.any(np.diff(found[0], axis=0) != 0, axis=(1, 2, 3))
    assert np.flatnonzero(changes).tolist() == list(range(13, 69, hop))


def batch(mu, prior, start, wait):
    """Weighted least squares over the whole past, started from a prior weight."""

    def learn(k, phi, u, last, part):
        if k < wait:
            return last, 0
        first = wait if start is not None else 0
        weight = mu ** np.arange(len(phi) - 1 - first, -1, -1)
        rows = phi[first:]
        L = mu ** len(rows) * prior[part]
        G = (weight[:, None] * rows).T @ rows + L
        h = (weight[:, None] * rows).T @ u[first:]
        sides = [part] if len(prior) > 1 else [0, 1]
        return np.linalg.solve(G, h + L @ (0 if start is None else start[:, sides])), 0

    return learn


@pytest.mark.parametrize("joint", [True, False])
def test_recursive_least_squares_is_the_weighted_fit_of_the_whole_past(benchmark, joint):
    """P_0 is the inverse of the prior's weight; learning begins where whole rows do."""
    n, parts = (4, 1) if joint else (2, 2)
    prior, start, mu = spread(n, parts), RNG.standard_normal((n, 2)), 0.93
    expected = textbook(VELOCITY.matrix, joint, batch(mu, prior, start, 2), start=start)
    compare(
        benchmark, expected, joint=joint, start=start,
        fit=Recursive(prior=np.linalg.inv(prior), forgetting=mu),
    )  # fmt: skip


def test_fading_normal_equations_are_recursive_least_squares(benchmark):
    """The same from the first sample on, but for the rows that reach back before it."""
    prior, start, mu = spread(4, 1), RNG.standard_normal((4, 2)), 0.93

    def learn(k, phi, u, last, part):
        if k < 2 + 9:
            return last, 0
        weight = mu ** np.arange(len(phi) - 1, -1, -1)[:, None]
        L = mu ** len(phi) * prior[0]
        return np.linalg.solve((weight * phi).T @ phi + L, (weight * phi).T @ u + L @ start), 0

    compare(
        benchmark, textbook(VELOCITY.matrix, True, learn, start=start), start=start,
        fit=Fading(forgetting=mu, prior=prior, wait=9),
    )  # fmt: skip


def corrections(prior, walk, r, mu, most, wait):
    """Kalman filter with whole matrices, its covariance in Joseph's form."""
    P = {}

    def learn(k, phi, u, last, part):
        if k == 0:
            P[part] = prior[part]
        if k < wait:
            return last, 0
        row, eye = phi[-1], np.eye(len(prior[part]))
        gain = P[part] @ row / (row @ P[part] @ row + mu * r)
        left = (eye - np.outer(gain, row)) @ P[part] @ (eye - np.outer(gain, row)).T
        P[part] = (left + mu * r * np.outer(gain, gain)) / mu + walk[part]
        P[part] = P[part] * min(1.0, most / np.trace(P[part]))
        return last + np.outer(gain, u[-1] - row @ last), 0

    return learn


def test_random_walk_is_a_kalman_filter(benchmark):
    prior, walk = spread(2, 2), 1e-2 * spread(2, 2)
    learn = corrections(prior, walk, 0.3, 1.0, np.inf, 2 + 5)
    compare(
        benchmark, textbook(VELOCITY.matrix, False, learn), joint=False,
        fit=RandomWalk(prior=prior, walk=walk, r=0.3, wait=5),
    )  # fmt: skip


def test_the_trace_of_recursive_least_squares_is_capped(benchmark):
    prior = spread(4, 1)
    learn = corrections(prior, np.zeros((1, 4, 4)), 1.0, 0.8, 0.4, 2)
    fit = Recursive(prior=prior[0], forgetting=0.8, most=0.4)
    found = compare(benchmark, textbook(VELOCITY.matrix, True, learn), fit=fit)
    free = engine(AdaptiveFeedforward(regressor=VELOCITY, fit=Recursive(prior[0], 0.8)), benchmark)
    assert np.abs(free[0] - found[0]).max() > 0.01


def test_normalised_gradient(benchmark):
    gain = RNG.uniform(50, 200, (4, 2))

    def learn(k, phi, u, last, part):
        row = phi[-1]
        error = u[-1] - row @ last
        move = DT * gain * np.outer(row, error) / (1 + row @ row)
        return last + (move if k >= 2 + 3 else 0), 0

    expected = textbook(VELOCITY.matrix, True, learn)
    compare(benchmark, expected, fit=NormalisedGradient(gain=gain, wait=3))


def test_a_number_stands_for_a_whole_matrix(benchmark):
    """The same start covariance as one number, a diagonal, a matrix, and a matrix a part."""
    forms = [0.7, np.full(2, 0.7), 0.7 * np.eye(2), np.stack([0.7 * np.eye(2)] * 2)]
    found = [
        engine(AdaptiveFeedforward(VELOCITY, RandomWalk(prior=x), joint=False), benchmark)[0]
        for x in forms
    ]
    for other in found[1:]:
        np.testing.assert_array_equal(found[0], other)


def test_strokes_and_commands_pass_the_same_filter(benchmark):
    """RoDeAC's kind: FIR taps an actuator, from measured strokes, both sides through F."""
    low_pass = butterworth(4, 150.0, 1024.0)
    b, a = signal.butter(4, 150.0, fs=1024.0)
    both = lambda x: signal.lfilter(b, a, x, axis=0)  # noqa: E731
    learn = window(15, reach=1)
    expected = textbook(np.eye(2), False, learn, both=both)
    pieces = {"regressor": fir(2), "joint": False, "learns_from": "measurement"}
    found = compare(benchmark, expected, fit=Window(15), low_pass=low_pass, **pieces)
    plain = engine(AdaptiveFeedforward(fit=Window(15), **pieces), benchmark)
    assert np.abs(plain[0] - found[0]).max() > 0.01


def test_commands_are_cut(benchmark):
    """And what was cut is what the next fit is told."""
    learn = window(12, reach=2)
    cut = lambda u: np.clip(u, -0.8, 0.8)  # noqa: E731
    found = compare(
        benchmark, textbook(VELOCITY.matrix, True, learn, law=cut), fit=Window(12), law=Linear(0.8)
    )
    assert np.mean(np.abs(found[1]) == 0.8) > 0.1


@pytest.mark.parametrize("order", [0, 1, 3])
@pytest.mark.parametrize("accuracy", [1, 2, 4])
def test_differences_are_exact_for_polynomials(order, accuracy):
    """Degree order + accuracy - 1 at most: the next power is the first that shows an error."""
    matrix = BackwardDifferences(order, accuracy).matrix
    taps = matrix.shape[1]
    t = [Fraction(3) - i for i in range(taps)]
    for degree in range(order + accuracy + 1):
        samples = np.array([float(x**degree) for x in t])
        for j, row in enumerate(matrix):
            falling = np.prod([float(degree - i) for i in range(j)])
            exact = falling * 3.0 ** (degree - j) if degree >= j else 0.0
            found = row @ samples
            if degree < j + accuracy or j == 0:
                assert found == pytest.approx(exact, abs=1e-9)
            elif degree == j + accuracy:
                assert abs(found - exact) > 0.1


def test_the_papers_differences():
    """C_D of Calayir, Tao & Mercan 2025, and the first-order ones of the literature."""
    np.testing.assert_array_equal(
        BACKWARD_DIFFERENCES,
        [[1, 0, 0, 0, 0], [1.5, -2, 0.5, 0, 0], [2, -5, 4, -1, 0], [2.5, -9, 12, -7, 1.5]],
    )
    np.testing.assert_array_equal(
        BackwardDifferences(3, 1).matrix,
        [[1, 0, 0, 0], [1, -1, 0, 0], [1, -2, 1, 0], [1, -3, 3, -1]],
    )


@pytest.mark.parametrize(
    "regressor", [BackwardDifferences(3, 2), BackwardDifferences(2, 1), fir(4)]
)
def test_recurrences_give_the_matrix(regressor):
    """Each step of a regressor against its matrix, and as a general map of taps."""
    general = TapMap(tuple(map(tuple, regressor.matrix.tolist())))
    taps = regressor.reach + 1
    before = [one.init(2) for one in (regressor, general)]
    padded = np.concatenate([np.zeros((taps - 1, 2, 2)), TARGET[:9]])
    for k in range(9):
        newest = padded[k : k + taps][::-1]
        expected = np.einsum("dn,nat->adt", regressor.matrix, newest)
        for i, one in enumerate((regressor, general)):
            before[i], phi = one.step(before[i], jnp.asarray(newest[0]))
            np.testing.assert_allclose(np.array(phi), expected, rtol=0, atol=1e-13)


def test_gradients_pass_through_the_pieces(benchmark):
    """Forgetting is a traced number like any other."""

    @jax.jit
    def end(mu):
        ready = AdaptiveFeedforward(VELOCITY, Recursive(2.0, mu), joint=False).prepare(benchmark)
        part = ready.parts[0]
        P, last = ready.fit.init(part, 1), ((jnp.ones(1),),) * 2
        for k in range(3):
            pair = Pair(k, DT, [jnp.full(1, np.sin(k + j)) for j in range(2)], [jnp.full(1, k)])
            P, fitted = ready.fit.step(P, part, pair, last, None)
            last = fitted.coefficients
        return last[0][0][0]

    slope = jax.jit(jax.grad(end))(0.9)
    apart = (end(0.9 + 1e-5) - end(0.9 - 1e-5)) / 2e-5
    assert slope == pytest.approx(float(apart), rel=1e-6) and abs(slope) > 1e-3
