"""A plant of one's own: given once, known to filter, gains and anchor; and said where it is not."""

import warnings
from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax import (
    ADFC,
    LQG,
    IdealPlants,
    InputError,
    Passthrough,
    build_benchmark,
    draw_plants,
    indices,
    nominal_plant,
    plant_from_draws,
    plant_from_hz,
    simulate,
)
from martths_jax.checks import OTHER_PLANT, plant_notice
from martths_jax.structure.modal import to_dense
from martths_jax.transfer import NOMINAL_HZ, frequency_response
from tests.engine.motions import burst

#: Real poles half as fast as the benchmark's.
SLOWER = NOMINAL_HZ * np.where(np.isin(np.arange(9), [2, 3, 7, 8]), 0.5, 1.0)


@pytest.fixture(scope="module")
def own():
    return build_benchmark(plant=plant_from_hz(SLOWER))


def test_everything_that_knows_a_plant_knows_this_one(benchmark, own):
    wanted, _, _, _ = to_dense(plant_from_hz(SLOWER).discretise(own.dt))
    A, _, _ = own.plant_continuous
    poles = np.sort(np.linalg.eigvals(A).real / (2 * np.pi))
    assert np.allclose(poles, np.sort([*SLOWER[[2, 3, 7, 8]], *[-50.0] * 4]))
    np.testing.assert_array_equal(to_dense(own.plant_model)[0], wanted)
    for controller in (ADFC().prepare(own), LQG.design(own), Passthrough(q=3e-5).prepare(own)):
        np.testing.assert_array_equal(to_dense(controller.estimator.model)[0], wanted)
    assert not np.allclose(LQG.design(own).K_z, LQG.design(benchmark).K_z, rtol=0.1)
    # The anchor undoes this plant: the response of C' phi is close to one sample's advance.
    anchor = np.asarray(ADFC().prepare(own).anchor)
    f = np.array([1.0, 2.3, 5.0, 10.0])
    w = 2j * np.pi * f / own.fs
    hold = ((1 - np.exp(-w)) / w)[:, None, None]
    H = hold * frequency_response(SLOWER[None], f)[..., 0]
    derivatives = np.stack([w**n for n in range(4)])
    loop = np.einsum(
        "jk,fjc->fkc", anchor, np.einsum("df,foc->fodc", derivatives, H).reshape(4, 8, 2)
    )
    assert np.abs(loop - np.exp(-w)[:, None, None] * np.eye(2)).max() < 0.2


def test_static_gains_stay_the_benchmarks():
    f = np.array([1e-6])
    gains = [frequency_response(hz[None], f) for hz in (NOMINAL_HZ, SLOWER)]
    np.testing.assert_allclose(gains[1], gains[0], rtol=1e-5)


def test_the_benchmarks_own_plant_given_by_hand_changes_no_bit(benchmark):
    same = build_benchmark(plant=plant_from_hz(NOMINAL_HZ))
    np.testing.assert_array_equal(same.plant_model.C, benchmark.plant_model.C)
    for ours, theirs in zip(same.plant_continuous, benchmark.plant_continuous, strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_adfc_with_a_plant_it_does_not_know_and_one_it_does(benchmark, own):
    """With the benchmark's anchor and filter the error is six times as large; that is said."""
    plants, motion = plant_from_hz(SLOWER), burst(1.2)
    controller = ADFC(nb=128, no=127)
    with pytest.warns(UserWarning, match=r"others than the one that controller `adfc` .* \d+ %"):
        blind = indices(simulate(benchmark, controller, plants, motion))["J2_1"][0]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        knowing = indices(simulate(own, controller, plants, motion))["J2_1"][0]
    assert knowing < 8 and blind > 40


def test_draws_about_a_plant(own):
    about = plant_from_hz(SLOWER)
    drawn = draw_plants(40, seed=3, around=about)
    usual = draw_plants(40, seed=3)
    np.testing.assert_array_equal(drawn.draws, usual.draws)
    np.testing.assert_allclose(
        np.asarray(drawn.parameters_hz) / SLOWER,
        np.asarray(usual.parameters_hz) / NOMINAL_HZ,
        rtol=1e-14,
    )
    np.testing.assert_array_equal(
        drawn[[3, 5]].parameters_hz, np.asarray(drawn.parameters_hz)[[3, 5]]
    )
    assert plant_notice(own, LQG.design(own), drawn) == ""


def test_nobody_is_warned_of_draws_of_table_2(benchmark):
    lqg = LQG.design(benchmark)
    for plants in (
        nominal_plant(),
        draw_plants(300, seed=5),
        draw_plants(300, seed=5, spread=3.0),
        plant_from_draws(3 * np.random.default_rng(0).choice([-1, 1], (6, 9))),
        *(draw_plants(1, seed=5, first=i) for i in range(1, 40)),
    ):
        assert plant_notice(benchmark, lqg, plants) == ""


def test_who_is_told_and_who_is_not(benchmark, own):
    lqg, slower = LQG.design(benchmark), plant_from_hz(SLOWER)
    quicker = plant_from_draws([0, 0, 15, 15, 0, 0, 0, 30, 30.0])
    for plants in (slower, quicker, draw_plants(5, around=slower)):
        assert "build_benchmark(plant=plant_from_hz(...))" in plant_notice(benchmark, lqg, plants)
    assert "IdealPlants have no dynamics" in plant_notice(
        benchmark, lqg, IdealPlants(jnp.arange(1))
    )
    # A filter that was designed for the plants by hand, and a controller that knows no plant.
    assert plant_notice(benchmark, LQG.design(own), slower) == ""
    by_hand = replace(benchmark, plant_model=slower.discretise(benchmark.dt))
    assert plant_notice(by_hand, ADFC().prepare(by_hand), slower) == ""
    assert plant_notice(benchmark, Passthrough().prepare(benchmark), slower) == ""
    assert OTHER_PLANT == 0.35  # draws of Table 2 reach 0.16


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (np.zeros(8), r"`parameters_hz` must have shape \(9,\) or \(trials, 9\)"),
        (-NOMINAL_HZ, "must give stable plants, but row 0 moves pole1_col1 to 2.65"),
        (NOMINAL_HZ * np.nan, "`parameters_hz` must be finite, but got nan for zero1_col1"),
        (NOMINAL_HZ * (np.arange(9) != 5), "zeros other than 0 Hz, .* zero_h12 = 0 in row 0"),
        (np.where(np.arange(9) == 3, -2.65, NOMINAL_HZ), "have another pole1_col1 than pole2_col1"),
    ],
)
def test_a_plant_that_is_none(given, message):
    with pytest.raises(InputError, match=message):
        plant_from_hz(given)


def test_a_plant_too_fast_for_the_rate():
    quick = plant_from_hz(np.where(np.arange(9) == 3, -300.0, NOMINAL_HZ))
    with pytest.raises(InputError, match=r"`fs` must be at least 600 Hz, .* pole \(300 Hz\)"):
        build_benchmark(512, plant=quick)
    with pytest.raises(InputError, match="`plant` must be one plant, but got 2 plants"):
        build_benchmark(plant=draw_plants(2))
