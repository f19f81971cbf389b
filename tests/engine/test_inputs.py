"""What the benchmark, its frame, coupler and plants are given: honoured, or refused."""

import numpy as np
import pytest

from martths_jax import (
    InputError,
    Quirks,
    SensorNoise,
    build_benchmark,
    build_coupler,
    draw_plants,
    plant_from_draws,
)
from martths_jax.structure.frame import build_reference
from martths_jax.structure.sections import FrameGeometry, Section

STEEL = Section(1e-3, 1e-6, 1e-3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bay": -1}, r"`bay` must be a number above zero \(m\), but got -1"),
        ({"bay": 0}, "`bay` must be a number above zero"),
        ({"storey": np.nan}, "`storey` must be a number above zero"),
        ({"E": "steel"}, r"`E` must be a number above zero \(Pa\), but got 'steel'"),
        ({"G": np.inf}, "`G` must be a number above zero"),
        ({"column": 3.0}, "`column` must be a Section, but got float"),
        ({"pin_offset": -0.1}, "`pin_offset` must be a number of at least zero"),
        ({"pin_offset": 0.7}, "`pin_offset` must be less than a storey, 0.635 m"),
        ({"storey_mass": (1.0, 2.0)}, "`storey_mass` must be 3 numbers above zero"),
        ({"vertical_mass": ((1.0,) * 3,) * 3}, "`vertical_mass` must be 4 x 3 numbers"),
    ],
)
def test_a_geometry_that_is_none(change, message):
    with pytest.raises(InputError, match=message):
        FrameGeometry(**change)


@pytest.mark.parametrize(
    ("given", "name"), [((-1, 1, 1), "A"), ((0, 0, 1), "I"), ((0, 1, 0), "A_s")]
)
def test_a_section_that_is_none(given, name):
    with pytest.raises(InputError, match=f"`{name}` must be a number"):
        Section(*given)


@pytest.mark.parametrize("change", [{"bay": 0.8}, {"storey": 0.7}, {"column": STEEL}, {"E": 2e11}])
def test_a_geometry_that_the_experimental_frame_does_not_have_is_refused(change):
    name = next(iter(change))
    with pytest.raises(
        InputError, match=f"`geometry` must have the published {name}, .*experiment"
    ):
        build_benchmark(geometry=FrameGeometry(**change))
    assert np.all(np.isfinite(build_reference(FrameGeometry(**change)).K))  # the frame alone


def test_the_published_geometry_is_what_none_means(benchmark):
    same = build_benchmark(geometry=FrameGeometry(bay=0.762))
    np.testing.assert_array_equal(same.numerical.C, benchmark.numerical.C)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"alpha_deg": 0}, "`alpha_deg` must lie between 0 and 90 degrees, but got 0"),
        ({"alpha_deg": 90}, "`alpha_deg` must lie between"),
        ({"arm": 0}, "`arm` must be positive and finite"),
        ({"arm": np.ones(3)}, "`arm` must be positive and finite"),
        ({"arm": None}, "`arm` must be positive and finite"),
    ],
)
def test_a_coupler_that_is_none(given, message):
    with pytest.raises(InputError, match=message):
        build_coupler(**given)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"removed_density": -1.0}, "`removed_density` must be a number above zero"),
        ({"mass_factor": 0}, "`mass_factor` must be a number above zero, but got 0"),
        ({"removed_rotation_coupling": np.nan}, "`removed_rotation_coupling` must be a finite"),
        ({"round_frequencies": "no"}, "`round_frequencies` must be True or False"),
    ],
)
def test_quirks_that_are_none(given, message):
    with pytest.raises(InputError, match=message):
        Quirks(**given)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"geometry": 3}, "`geometry` must be a FrameGeometry or None, but got 3"),
        ({"coupler": 0.3}, "`coupler` must be a Coupler or None"),
        ({"quirks": {}}, "`quirks` must be a Quirks or None"),
        ({"quirks": Quirks(removed_density=785e5)}, "`quirks` must leave every floor .* a mass"),
        ({"tolerance": -1.0}, "`tolerance` must be a number above zero, but got -1"),
        ({"fs": True}, "`fs` must be a positive sampling rate"),
        ({"integrator": ["rk4"]}, "`integrator` must be one of"),
        ({"plant": 3}, "`plant` must be one plant, but got int. Use plant_from_hz"),
        ({"fs": 10}, "`fs` must be at least 161 Hz, twice .* fastest pole .80.4 Hz., but got 10"),
        ({"fs": 100}, "`fs` must be at least 161 Hz"),
    ],
)
def test_arguments_of_the_benchmark(given, message):
    with pytest.raises(InputError, match=message):
        build_benchmark(**given)


def test_the_lowest_rate_that_is_said_can_be_built():
    assert build_benchmark(161).fs == 161
    with pytest.raises(InputError, match="at least 161 Hz"):
        build_benchmark(160)


@pytest.mark.parametrize("seed", [1.5, 2**63, -1, "1", None, True, np.float64(2)])
def test_a_seed_that_is_none(seed):
    for make in (lambda: draw_plants(2, seed=seed), lambda: SensorNoise(seed=seed)):
        with pytest.raises(
            InputError, match=r"`seed` must be a whole number from 0 to 92233720368"
        ):
            make()


def test_seeds_of_any_integer_type_are_one():
    expected = draw_plants(2, seed=7).draws
    for seed in (np.int64(7), np.array(7)):
        np.testing.assert_array_equal(draw_plants(2, seed=seed).draws, expected)
    draw_plants(1, seed=2**63 - 1)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"n": 0}, "`n` must be a whole number from 1"),
        ({"n": 1.5}, "`n` must be a whole number from 1"),
        ({"n": 2, "first": -1}, "`first` must be a whole number from 0"),
        # Random streams tell 32 bits of a trial's number apart: beyond, plants would repeat.
        ({"n": 2, "first": 2**32 - 1}, "`first` must be a whole number from 0 to 4294967293"),
        ({"n": 2, "spread": np.nan}, "`spread` must be zero or positive and finite"),
        ({"n": 2, "spread": "wide"}, "`spread` must be zero or positive and finite"),
        ({"n": 2, "around": 3}, "`around` must be one plant"),
    ],
)
def test_draws_that_are_none(given, message):
    with pytest.raises(InputError, match=message):
        draw_plants(**given)


def test_text_is_no_draw():
    with pytest.raises(InputError, match="`draws` must be numbers, but got 'abc'"):
        plant_from_draws("abc")
    with pytest.raises(InputError, match="`noise_power` must be zero or positive and finite"):
        SensorNoise(noise_power="loud")
