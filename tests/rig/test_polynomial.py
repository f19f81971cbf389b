"""Roots of batches of polynomials against NumPy's eigenvalues, and their derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax.errors import InputError
from martths_jax.rig.polynomial import Roots, horner, is_root, nominal_roots, roots

#: Real roots and the upper ones of pairs [rad/s], as those of a servo-hydraulic actuator.
REAL, UPPER = np.array([-48.0, -330.0]), np.array([-180 + 230j, -8 + 420j])
ROOTS = np.array([*REAL, *UPPER, *UPPER.conj()])


def batch(n=40, scatter=0.3, seed=0):
    """(n, 7) coefficients, and the same roots as (n, 6)."""
    rng = np.random.default_rng(seed)
    real = REAL * (1 + scatter * rng.uniform(-1, 1, (n, 2)))
    upper = UPPER.real * (1 + scatter * rng.uniform(-1, 1, (n, 2)))
    upper = upper + 1j * UPPER.imag * (1 + scatter * rng.uniform(-1, 1, (n, 2)))
    every = np.concatenate([real, upper, upper.conj()], axis=1)
    return np.stack([7.0 * np.poly(row).real for row in every]), every


@pytest.mark.parametrize("xp", [np, jnp])
def test_roots_are_those_of_the_companion_matrix(xp):
    coefficients, _ = batch()
    start = nominal_roots(np.poly(ROOTS).real)
    found = roots(xp.asarray(coefficients), start)
    assert [x.dtype for x in found.real] == [np.float64] * 2
    assert np.all(is_root(coefficients, found))
    for row, ours in zip(coefficients, found.stacked().T, strict=True):
        theirs = np.roots(row)
        distance = np.abs(ours[:, None] - theirs[None])
        assert sorted(np.argmin(distance, axis=1)) == list(range(6))
        assert np.max(np.min(distance, axis=1) / np.abs(ours)) < 1e-12


def test_derivatives_by_the_coefficients_are_those_of_the_implicit_function():
    coefficients, _ = batch(5)
    start = nominal_roots(np.poly(ROOTS).real)
    found = roots(jnp.asarray(coefficients), start).stacked()

    def both(c):
        s = roots(c, start)
        return jnp.stack([*s.real, *(f(x) for x in s.upper for f in (jnp.real, jnp.imag))])

    slope = jax.jacfwd(lambda row: both(row[None])[:, 0])(jnp.asarray(coefficients[0]))
    backward = jax.jacrev(lambda row: both(row[None])[:, 0])(jnp.asarray(coefficients[0]))
    np.testing.assert_allclose(slope, backward, rtol=1e-9, atol=1e-12)
    s = found[[0, 1, 2, 4], 0]
    powers = s[:, None] ** np.arange(6, -1, -1)
    expected = -powers / np.polyval(np.polyder(coefficients[0]), s)[:, None]
    expected = [*expected[:2].real, *(f(x) for x in expected[2:] for f in (np.real, np.imag))]
    scale = np.abs(coefficients[0])
    slope, expected = np.asarray(slope) * scale, np.array(expected) * scale
    np.testing.assert_allclose(slope, expected, rtol=1e-9, atol=1e-7)


def test_second_derivative_is_that_of_a_known_root():
    """s^2 + 2 d s + 25: upper root -d + i sqrt(25 - d^2), whose curve is -25 / (25 - d^2)^1.5."""
    start = nominal_roots([1.0, 6.0, 25.0])
    damping = 3.3

    def height(d):
        return roots(jnp.stack([1.0 + 0 * d, 2 * d, 25.0 + 0 * d])[None], start).upper[0][0].imag

    np.testing.assert_allclose(
        jax.grad(jax.grad(height))(damping), -25 / (25 - damping**2) ** 1.5, rtol=1e-9
    )
    step = 1e-5
    difference = (height(damping + step) - height(damping - step)) / (2 * step)
    np.testing.assert_allclose(jax.grad(height)(damping), difference, rtol=1e-8)


def test_a_pair_that_has_become_real_is_no_root():
    start = nominal_roots([1.0, 6.0, 25.0])
    coefficients = np.array([[1.0, 6.0, 25.0], [1.0, 12.0, 25.0]])
    with np.errstate(all="ignore"):
        np.testing.assert_array_equal(
            is_root(coefficients, roots(coefficients, start)), [True, False]
        )


def test_horner_and_the_order_of_roots():
    assert nominal_roots([2.0]) == Roots() and len(nominal_roots([1.0, 2.0, 5.0, 4.0])) == 3
    np.testing.assert_allclose(horner([2.0, -3.0, 1.0], np.array([2.0, 1j])), [3.0, -1 - 3j])
    assert nominal_roots(np.poly([-3.0, -1.0, -2.0])).real == pytest.approx((-1.0, -2.0, -3.0))


@pytest.mark.parametrize("given", [[0.0, 1.0], [1.0, np.inf], [], "s"])
def test_refused_coefficients(given):
    with pytest.raises(InputError, match="the first \\(of the highest power\\) not zero"):
        nominal_roots(given)
