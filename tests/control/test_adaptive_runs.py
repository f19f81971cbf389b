"""The adaptive compensators in the loop: nothing is lost, and each beats no compensation."""

import importlib

import numpy as np
import pytest

from martths_jax import (
    Motion,
    Passthrough,
    build_benchmark,
    draw_plants,
    indices,
    load_motion,
    simulate,
)

NAMES = ("J2true_1", "J2true_2")
MODULES = (
    "ats",
    "ats_rls",
    "aic",
    "error_model",
    "adfc_rls",
    "adfc_weighted",
    "cats_pid",
    "cats_mpc",
    "ekf_tf",
    "ukf_tf",
    "ekf_ss",
    "ukf_ss",
    "adfc_akf",
    "amb",
    "two_stage",
    "sliding_adm",
    "sliding_switching",
)


@pytest.fixture(scope="module")
def given():
    record = load_motion("elcentro-like")
    part = Motion("part", record.acceleration[: 8 * 1024], record.fs)
    return draw_plants(64, seed=1), part


def errors(benchmark, controller, given):
    result = simulate(benchmark, controller, *given, indices=NAMES)
    found = indices(result)
    return [np.asarray(found[name]) for name in NAMES]


@pytest.fixture(scope="module")
def nothing(given):
    return errors(build_benchmark(), Passthrough(), given)


@pytest.mark.slow
@pytest.mark.parametrize("module", MODULES)
def test_it_is_stable_and_better_than_nothing(benchmark, given, nothing, module):
    entry = importlib.import_module(f"martths_jax.control.controllers.{module}").ENTRY
    for own, without in zip(errors(benchmark, entry.build(benchmark), given), nothing, strict=True):
        assert np.all(np.isfinite(own)) and np.all(own < 0.5 * without)
        assert np.median(own) < 0.15 * np.median(without)
