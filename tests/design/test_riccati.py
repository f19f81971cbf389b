"""Riccati solvers against SciPy, and their derivatives against finite differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import linalg

from martths_jax.algebra.riccati import care, dare

SOLVERS = {"care": (care, linalg.solve_continuous_are), "dare": (dare, linalg.solve_discrete_are)}


def systems(count, n, i, seed):
    """Random systems, a third of them with a mode that no input reaches but that is stable."""
    rng = np.random.default_rng(seed)
    A, B = rng.normal(size=(count, n, n)), rng.normal(size=(count, n, i))
    third = count // 3
    A[:third, -1, :] = 0.0
    A[:third, -1, -1] = -rng.uniform(0.1, 0.9, third)
    B[:third, -1] = 0.0
    C, D = rng.normal(size=(count, n, n)), rng.normal(size=(count, i, i))
    return A, B, np.swapaxes(C, 1, 2) @ C, np.eye(i) + np.swapaxes(D, 1, 2) @ D


@pytest.mark.parametrize("name", SOLVERS)
@pytest.mark.parametrize(
    ("count", "n", "i"), [pytest.param(700, 3, 1, marks=pytest.mark.slow), (300, 6, 2)]
)
def test_agrees_with_scipy(name, count, n, i):
    ours, scipys = SOLVERS[name]
    given = systems(count, n, i, seed=n)
    found = np.asarray(jax.jit(jax.vmap(ours))(*given))
    expected = np.stack([scipys(*one) for one in zip(*given, strict=True)])
    error = np.abs(found - expected).max((1, 2)) / np.abs(expected).max((1, 2))
    for k in np.flatnonzero(error > 1e-9):
        # A system that an input hardly reaches: SciPy's own answer moves when its data are rounded.
        signs = np.random.default_rng(k).choice([-1, 1], size=(20, *given[0][k].shape))
        rounded = [scipys(given[0][k] * (1 + 2e-16 * s), *(x[k] for x in given[1:])) for s in signs]
        own = np.abs(np.array(rounded) - expected[k]).max() / np.abs(expected[k]).max()
        assert error[k] < max(1e-8, 10 * own)
    assert np.count_nonzero(error > 1e-9) <= 0.01 * count


@pytest.mark.parametrize("name", SOLVERS)
def test_gradient_agrees_with_finite_differences_and_forward_mode(name):
    ours, _ = SOLVERS[name]
    A, B, Q, R = (x[0] for x in systems(3, 4, 2, seed=7))
    weights = np.random.default_rng(8).normal(size=(4, 4))
    change = [np.random.default_rng(9).normal(size=x.shape) for x in (A, B, Q, R)]
    change[2:] = [x + x.T for x in change[2:]]

    def scalar(h):
        moved = (x + h * d for x, d in zip((A, B, Q, R), change, strict=True))
        return jnp.sum(weights * ours(*moved))

    h = 1e-4
    values, reverse, forward = jax.jit(
        lambda steps: (
            jax.vmap(scalar)(steps),
            jax.grad(scalar)(0.0),
            jax.jvp(scalar, (0.0,), (1.0,))[1],
        )
    )(h * jnp.array([-2.0, -1, 1, 2]))
    slope = float((8 * (values[2] - values[1]) - (values[3] - values[0])) / (12 * h))
    assert float(reverse) == pytest.approx(slope, rel=1e-5)
    assert float(forward) == pytest.approx(slope, rel=1e-5)


def test_unsolvable_equation_gives_no_number_that_looks_like_a_solution():
    A, B = np.diag([1.0, -1.0]), np.array([[0.0], [1.0]])  # the unstable mode is out of reach
    X = np.asarray(jax.jit(care)(A, B, np.eye(2), np.eye(1)))
    closed = A - B @ B.T @ X
    assert not np.all(np.isfinite(X)) or np.linalg.eigvals(closed).real.max() > 0
