"""Uncertain parameters against SciPy's distributions."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from martths_jax.errors import InputError
from martths_jax.rig.uncertainty import Uncertainty

R = ((1.0, 0.6, -0.3), (0.6, 1.0, 0.2), (-0.3, 0.2, 1.0))


def three(**changes):
    given = {
        "names": ("gain", "pole", "mass"),
        "nominal": (2.0, -40.0, 29.1),
        "sigmas": (0.3, 0.06, 4.0),
        "kinds": ("relative", "relative", "absolute"),
        "distributions": ("lognormal", "normal", "uniform"),
    }
    return Uncertainty(**(given | changes))


def draws(n, seed=0):
    return jnp.asarray(np.random.default_rng(seed).standard_normal((n, 3)))


def lognormal(median, deviation):
    """SciPy's law with that median and standard deviation, its shape by bisection."""
    low, high = 0.0, 5.0
    for _ in range(200):
        s = (low + high) / 2
        low, high = (s, high) if stats.lognorm(s, scale=median).std() < deviation else (low, s)
    return stats.lognorm(s, scale=median)


@pytest.mark.parametrize("spread", [1.0, 0.4])
def test_each_parameter_has_its_distribution(spread):
    z = draws(50)
    found = np.array([[1.0, -1.0, 1.0]]) * np.asarray(three().values(z, spread))
    half = np.sqrt(3) * 4.0 * spread
    laws = (
        lognormal(2.0, 0.6 * spread),
        stats.norm(40.0, 2.4 * spread),
        stats.uniform(29.1 - half, 2 * half),
    )
    for column, law, normal in zip(found.T, laws, np.asarray(z).T, strict=True):
        np.testing.assert_allclose(law.cdf(column), stats.norm.cdf(normal), atol=2e-10)


def test_correlation_leaves_each_distribution_and_gives_the_normals_theirs():
    z = draws(20000, 1)
    plain, joined = three(), three(correlation=R)
    found = np.asarray(joined.values(z))
    half = np.sqrt(3) * 4.0
    ranks = np.stack(
        [
            lognormal(2.0, 0.6).cdf(found[:, 0]),
            1 - stats.norm(-40.0, 2.4).cdf(found[:, 1]),
            stats.uniform(29.1 - half, 2 * half).cdf(found[:, 2]),
        ]
    )
    for rank in ranks:
        assert stats.kstest(rank, "uniform").pvalue > 0.01
    np.testing.assert_allclose(np.corrcoef(stats.norm.ppf(ranks)), R, atol=0.03)
    # The first parameter of the triangle keeps its own draw.
    np.testing.assert_array_equal(found[:, 0], np.asarray(plain.values(z))[:, 0])


def test_zero_draws_are_nominal_and_others_scatter_about_a_given_plant():
    both = three(correlation=R)
    np.testing.assert_array_equal(both.values(jnp.zeros((2, 3))), [[2.0, -40.0, 29.1]] * 2)
    about = jnp.array([[3.0, -10.0, 1.0]])
    np.testing.assert_array_equal(both.values(jnp.zeros((4, 3)), 1.0, about), [[3, -10, 1]] * 4)
    moved = np.asarray(three().values(jnp.ones((1, 3)), 1.0, about))[0]
    np.testing.assert_allclose(moved[1], -10 * 1.06, rtol=1e-15)


@pytest.mark.parametrize("correlation", [None, R])
def test_draws_are_found_from_the_values(correlation):
    both, z = three(correlation=correlation), draws(30, 4)
    np.testing.assert_allclose(both.draws(both.values(z, 0.3), 0.3), z, rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(both.draws(both.nominal, 0.0), np.zeros((1, 3)))
    assert Uncertainty().draws(np.zeros((4, 0))).shape == (4, 0)


@pytest.mark.parametrize(
    ("values", "spread", "message"),
    [
        ([[2.0, -40.0, 36.1]], 1.0, "be within the uniform distribution of mass, but got 36.1 in"),
        ([[2.0, -4.0, 30.0], [-2.0, -4.0, 30.0]], 1.0, "lognormal distribution of gain, .* row 1"),
        ([[2.0, -40.0, 30.0]], 0.0, "be within the uniform distribution of mass, but got 30 in"),
        ([2.0, -40.0], 1.0, r"have shape \(trials, 3\), but got shape \(1, 2\)"),
    ],
)
def test_values_that_no_draw_gives(values, spread, message):
    with pytest.raises(InputError, match=message):
        three().draws(values, spread)


def test_derivatives_are_those_of_differences():
    both, z = three(correlation=R), draws(3)

    def total(z, spread):
        return jnp.sum(both.values(z, spread) * jnp.arange(1.0, 4.0)[None])

    slope, by_spread = jax.grad(total, (0, 1))(z, 0.7)
    step = 1e-5
    for i, j in ((0, 0), (1, 1), (2, 2), (1, 0)):
        there, back = (total(z.at[i, j].add(d), 0.7) for d in (step, -step))
        np.testing.assert_allclose(slope[i, j], (there - back) / (2 * step), rtol=1e-6)
    there, back = total(z, 0.7 + step), total(z, 0.7 - step)
    np.testing.assert_allclose(by_spread, (there - back) / (2 * step), rtol=1e-7)
    # Without spread as well, where the lognormal's s has a root.
    at_rest = jax.grad(total, 1)(z, 0.0)
    np.testing.assert_allclose(at_rest, (total(z, 1e-3) - total(z, -1e-3)) / 2e-3, rtol=1e-5)


def test_no_parameters():
    assert Uncertainty().values(jnp.zeros((4, 0))).shape == (4, 0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"sigmas": (0.1, -0.2, 1.0)}, "`sigmas` must be finite and at least 0, but got -0.2 for"),
        ({"sigmas": (0.1, 0.2)}, "be 3 numbers, one a parameter"),
        ({"nominal": (np.nan, 1.0, 1.0)}, "`nominal` must be finite, but got nan for gain"),
        ({"nominal": (1.0, 0.0, 1.0)}, "got 0 for pole. Use kinds"),
        ({"names": ("a", "b", "a")}, "name every parameter once, but got 'a' twice"),
        ({"kinds": "percent"}, "be one of relative, absolute, but got 'percent' for gain"),
        ({"distributions": ("normal", "beta", "normal")}, "but got 'beta' for pole"),
        ({"units": ("m",)}, "be one word for all parameters or 3 words"),
        ({"correlation": np.eye(2)}, "`correlation` must be 3 x 3 finite numbers"),
        ({"correlation": 2 * np.eye(3)}, "ones on its diagonal, but got 2 for gain"),
        ({"correlation": np.eye(3) + np.eye(3, k=1) / 2}, "symmetric, but got 0.5 and 0 for gain"),
        ({"correlation": np.ones((3, 3))}, "`correlation` must be positive definite"),
    ],
)
def test_refusals(changes, message):
    with pytest.raises(InputError, match=message):
        three(**changes)


def test_a_name_that_is_not_there():
    with pytest.raises(InputError, match="be one of gain, pole, mass, but got 'zero'"):
        three().column(jnp.zeros((1, 3)), "zero")
