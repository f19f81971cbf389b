"""ADFC that forgets: by recursion, and by weights within its buffer."""

import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax import InputError
from martths_jax.control.adaptive.inverse import nominal_inverse
from martths_jax.control.adaptive.weighted import WeightedWindow
from martths_jax.control.controllers import ADFC, adfc_rls, adfc_weighted
from martths_jax.control.controllers.feedforward import AdaptiveFeedforward, follow_target
from tests.control.pieces_oracle import engine, textbook

#: x, dt x', dt^2 x'', dt^3 x''' of Calayir, Tao & Mercan 2025.
MATRIX = np.array(
    [[1, 0, 0, 0, 0], [1.5, -2, 0.5, 0, 0], [2, -5, 4, -1, 0], [2.5, -9, 12, -7, 1.5]]
)


def alike(found, expected):
    for name, a, b in zip(("C", "u", "held"), found, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-7, atol=1e-9 * np.abs(b).max(), err_msg=name)
    assert np.abs(expected[0][-1] - expected[0][0]).max() > 0.05


def weighted_fit(weights, phi, u, pull, anchor):
    """(sum w phi phi' + lambda I)^-1 (sum w phi u' + lambda C_n)."""
    G, h = (weights[:, None] * phi).T @ phi, (weights[:, None] * phi).T @ u
    return np.linalg.solve(G + pull * np.eye(len(anchor)), h + pull * anchor)


def test_a_fading_fit_is_weighted_by_age(benchmark):
    made = adfc_rls.ENTRY.build(benchmark, memory=20.0, pull=0.01, wait=30)
    anchor = nominal_inverse(benchmark.plant_model, 1024.0, MATRIX)

    def learn(k, phi, u, last, part):
        weights = (1 - 1 / 20.0) ** np.arange(k, -1.0, -1)
        return (weighted_fit(weights, phi, u, 0.01, anchor), 0) if k >= 34 else (last, 0)

    alike(engine(made, benchmark), textbook(MATRIX, True, learn))


def test_without_a_pull_it_is_the_recursion(benchmark):
    """P = (P - g phi' P) / mu from P_0 = I / lambda is the fit whose pull fades with the rows."""
    made = adfc_rls.ENTRY.build(benchmark, memory=20.0, pull=1e-12, wait=40)
    mu, kept = 1 - 1 / 20.0, {}

    def learn(k, phi, u, last, part):
        if k == 0:
            kept["P"], kept["C"] = np.eye(8) * 1e7, np.zeros((8, 2))
        P, row, C = kept["P"], phi[-1], kept["C"]
        g = P @ row / (mu + row @ P @ row)
        kept["C"], kept["P"] = C + np.outer(g, u[-1] - row @ C), (P - np.outer(g, row @ P)) / mu
        kept["P"] = (kept["P"] + kept["P"].T) / 2
        return (kept["C"], 0) if k >= 44 else (last, 0)

    found, expected = engine(made, benchmark), textbook(MATRIX, True, learn)
    np.testing.assert_allclose(found[0], expected[0], rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("last", [0.1, 1.0])
def test_a_weighted_buffer(benchmark, last):
    """Across two turns of the line, where the running sum is replaced."""
    made = adfc_weighted.ENTRY.build(benchmark, nb=24, last=last, pull=0.01)
    anchor = nominal_inverse(benchmark.plant_model, 1024.0, MATRIX)

    def learn(k, phi, u, before, part):
        weights = last ** (np.arange(23.0, -1.0, -1) / 24)
        if k < 24 + 4:
            return before, 0
        return weighted_fit(weights, phi[-24:], u[-24:], 0.01, anchor), 0

    alike(engine(made, benchmark), textbook(MATRIX, True, learn))


def test_equal_weights_are_adfc(benchmark):
    made = adfc_weighted.ENTRY.build(benchmark, nb=24, last=1.0, pull=0.01)
    special = ADFC(nb=24, no=23, pull=0.01, towards="inverse").prepare(benchmark).composed()
    for one, other in zip(engine(made, benchmark), engine(special, benchmark), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-11)


def test_both_start_by_following_the_target(benchmark):
    for entry in (adfc_rls.ENTRY, adfc_weighted.ENTRY):
        ready = entry.build(benchmark).prepare(benchmark)
        np.testing.assert_array_equal(ready.start, follow_target(4, joint=True))


def test_length_is_the_sum_of_the_weights():
    for mu, every in ((1.0, 1), (0.9, 1), (0.9, 4), (1.0, 4)):
        fit = WeightedWindow(12, forgetting=mu, every=every)
        wanted = sum(mu**age for age in range(0, 12, every))
        np.testing.assert_allclose(fit.length, wanted, rtol=1e-14)
    several = WeightedWindow(12, forgetting=jnp.array([0.9, 1.0])).length
    np.testing.assert_allclose(several, [(1 - 0.9**12) / 0.1, 12.0], rtol=1e-12)


def test_settings_that_cannot_be_used(benchmark):
    for entry, settings, message in (
        (adfc_rls.ENTRY, {"memory": 8.0}, "`memory` must be a number of at least 9"),
        (adfc_weighted.ENTRY, {"nb": 8}, "`nb` must be a whole number of at least 9"),
        (adfc_weighted.ENTRY, {"last": 0.0}, "`last` must be a number from 0 to 1"),
    ):
        with pytest.raises(InputError, match=message):
            entry.build(benchmark, **settings)
    for fit, message in (
        (WeightedWindow(24, every=5), "`fit.every` must be a whole divisor of nb = 24"),
        (WeightedWindow(24, every=3), "`fit.every` must leave at least 9 pairs in the window"),
        (WeightedWindow(24, forgetting=1.1), "`fit.forgetting` must be above 0 and at most 1"),
    ):
        assert message in " ".join(AdaptiveFeedforward(fit=fit).problems(benchmark))
