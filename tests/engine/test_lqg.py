"""LQG's two errors: what is integrated, and the weights that go with it."""

import numpy as np
import pytest

from martths_jax import LQG, InputError, nominal_plant, simulate
from martths_jax.campaign.config import StudyConfig
from martths_jax.campaign.plan import build_controller
from martths_jax.control.controllers.lqg import FITTED
from tests.engine.motions import burst


@pytest.mark.parametrize(("error", "stroke"), [("estimate", "x_hat"), ("measured", "x_m")])
def test_which_error_is_integrated(benchmark, error, stroke):
    controller = LQG.design(benchmark, error=error)
    assert dict(controller.weights) == FITTED[error]
    s = simulate(benchmark, controller, nominal_plant(), burst(0.3), keep=True).signals
    integral = np.cumsum(s["x_a"] - s[stroke], axis=1) * benchmark.dt
    scale = np.abs(integral).max()
    np.testing.assert_allclose(s["error_integral"], integral, atol=1e-12 * scale)


def test_both_errors_have_the_same_gains(benchmark):
    """The design knows no noise, so the weights mean the same for either."""
    weights = FITTED["measured"]
    ours = [LQG.design(benchmark, error=error, **weights) for error in FITTED]
    np.testing.assert_array_equal(ours[0].K_z, ours[1].K_z)
    np.testing.assert_array_equal(ours[0].K_e, ours[1].K_e)
    assert [c.error for c in ours] == list(FITTED)


def test_some_weights_given(benchmark):
    weights = dict(LQG.design(benchmark, r=(1.0, 0.5), error="measured").weights)
    assert weights == FITTED["measured"] | {"r": (1.0, 0.5)}


def test_an_error_that_does_not_exist(benchmark):
    wanted = r"`error` must be one of \['estimate', 'measured'\], but got 'x_m'"
    with pytest.raises(InputError, match=wanted):
        LQG.design(benchmark, error="x_m")
    bare = LQG.design(benchmark)
    wrong = LQG(bare.K_z, bare.K_e, bare.estimator, error="x_m")
    with pytest.raises(InputError, match=wanted):
        simulate(benchmark, wrong, nominal_plant(), burst(0.3))


def test_a_study_names_the_weights_it_ran_with(benchmark):
    """Those left out too: they identify its results."""
    config = StudyConfig(controller={"lqg": {"error": "measured", "q": 1e-4}})
    chosen = build_controller("lqg", config, benchmark)
    made, settings = chosen.controller, chosen.identity
    wanted = FITTED["measured"] | {"q": 1e-4}
    assert made.error == settings["error"] == "measured"
    assert {n: settings[n] for n in "eryq"} == {
        n: list(w) if isinstance(w, tuple) else w for n, w in wanted.items()
    }
