"""Properties of any run: it ends, it is the trial's own, and it scales."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from martths_jax import ADFC, Motion, SensorNoise, Status, indices, plant_from_draws, simulate

SAMPLES, TRIALS = 400, 3
BUFFERS = (24, 100)  # each is a program to compile
settings.register_profile(
    "loop", deadline=None, max_examples=8, derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)  # fmt: skip
PROPERTY = settings.get_profile("loop")


draws = st.lists(
    st.lists(st.floats(-3, 3), min_size=9, max_size=9), min_size=TRIALS, max_size=TRIALS
)


@st.composite
def motions(draw) -> Motion:
    """A few waves, jolts and silences between 1e-6 and 10 m/s^2."""
    peak = 10 ** draw(st.floats(-6, 1))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    t = np.arange(SAMPLES) / 1024
    waves = sum(rng.standard_normal() * np.sin(2 * np.pi * f * t) for f in rng.uniform(0.5, 60, 4))
    waves = waves + draw(st.sampled_from([0.0, 1.0])) * rng.standard_normal(SAMPLES)
    silent = draw(st.integers(0, SAMPLES - 10))
    waves[:silent] = 0
    return Motion("random", peak * waves / np.abs(waves).max(), 1024.0)


@st.composite
def controllers(draw) -> ADFC:
    nb = draw(st.sampled_from(BUFFERS))
    pull = draw(st.sampled_from([0.0, 1e-8, 6e-5, 1e-2]))
    return ADFC(nb=nb, no=draw(st.integers(0, nb - 1)), pull=pull, towards="inverse")


@pytest.mark.slow
@PROPERTY
@given(draws=draws, motion=motions(), controller=controllers(), seed=st.integers(0, 99))
def test_any_run_ends_with_a_status_and_numbers_that_belong_to_it(
    benchmark, draws, motion, controller, seed
):
    plants, noise = plant_from_draws(np.array(draws)), SensorNoise(seed=seed)
    result = simulate(benchmark, controller, plants, motion, noise)
    found = indices(result)
    for i, status in enumerate(result.status):
        values = np.array([value[i] for value in found.values()])
        if status >= Status.DIVERGED:
            assert np.all(np.isnan(values))
        else:
            assert np.all(np.isfinite(values))
        assert result.describe(i).startswith(f"Trial {i} {Status(status).name.lower()}")
    # The guarded fit runs away in none of these.
    if controller.pull == 6e-5 and controller.nb == BUFFERS[-1]:
        assert not result.lost.any()

    # One by one, and in another order: the same bits, whoever else is lost.
    order = np.random.default_rng(seed).permutation(TRIALS)
    permuted = indices(simulate(benchmark, controller, plants[order], motion, noise))
    alone = indices(simulate(benchmark, controller, plants[0], motion, noise))
    for name, value in found.items():
        np.testing.assert_array_equal(permuted[name], value[order], err_msg=name)
        np.testing.assert_array_equal(alone[name], value[:1], err_msg=name)


@pytest.mark.slow
@PROPERTY
@given(draws=draws, motion=motions(), exponent=st.integers(-4, 4), seed=st.integers(0, 99))
def test_scaling_the_units_scales_the_run(benchmark, draws, motion, exponent, seed):
    """Motion and noise by s, everything in mm^2 by s^2: the indices stay.

    Only the coupler, whose geometry does not scale, tells them apart: by the square of the
    rotation, so the motion is kept small here.  Volts and the runaway limit are absolute.
    """
    s = 2.0**exponent
    small = Motion("small", 1e-3 * motion.acceleration / np.abs(motion.acceleration).max(), 1024.0)
    plants = plant_from_draws(np.array(draws))
    power = 1.5e-13

    def run(s):
        return simulate(
            replace(benchmark, noise_power=power * s**2),
            ADFC(nb=100, no=99, pull=3e-11 * s**2, towards="inverse", q=3e-11 * s**2),
            plants,
            replace(small, acceleration=s * small.acceleration),
            SensorNoise(noise_power=power * s**2, seed=seed),
        )

    one, other = run(1.0), run(s)
    np.testing.assert_array_equal(one.status, other.status)
    found, scaled = indices(one), indices(other)
    for name in found:
        if name[:2] not in ("J1", "J4"):
            np.testing.assert_allclose(scaled[name], found[name], rtol=1e-4, err_msg=name)
