"""What a run hands back: its axes, its statuses, and that it is a pytree."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax import (
    LQG,
    Motion,
    Passthrough,
    Result,
    SensorNoise,
    Status,
    draw_plants,
    indices,
    nominal_plant,
    simulate,
)
from martths_jax.indices import (
    DELAYS,
    NAMES,
    Delay,
    Rms,
    correlate,
    trials_first,
    trials_last,
)
from martths_jax.study import run_study
from tests.engine.motions import burst

MOTION, QUIET = burst(0.4), SensorNoise(noise_power=0.0)


@pytest.fixture(scope="module")
def result(benchmark):
    return simulate(benchmark, LQG.design(benchmark), draw_plants(5, 1), MOTION, keep=True)


def test_trials_are_the_first_axis_of_every_array(result):
    leaves = jax.tree_util.tree_leaves_with_path(result)
    first = {jax.tree_util.keystr(path): leaf.shape[0] for path, leaf in leaves}
    assert first.pop(".reference") == MOTION.acceleration.size
    assert set(first.values()) == {5}
    assert result.watch.saturated.shape == (5, 2)
    assert result.sums.of(Rms)["error_square"].shape == (5, 10)
    assert result.sums.of(Delay)["correlation"].shape[::2] == (5, 4)
    one = jax.tree.map(lambda x: x[3:4], result)
    assert indices(one)["J2_1"] == indices(result)["J2_1"][3]


def test_turning_and_turning_back_is_nothing(result):
    for name, value in vars(trials_last(trials_first(result.watch))).items():
        np.testing.assert_array_equal(value, getattr(result.watch, name))


def test_a_compiled_function_may_return_it(benchmark, result):
    """Its status is traced inside and known outside; the indices are those of a plain run."""
    start, plants = LQG.design(benchmark), draw_plants(5, 1)

    @jax.jit
    def run(scale):
        inside = simulate(benchmark, replace(start, K_e=scale * start.K_e), plants, MOTION)
        assert isinstance(inside.status, jax.core.Tracer)
        assert str(inside).endswith("410 samples; traced")
        return inside, inside.lost

    found, lost = run(1.0)
    assert isinstance(found, Result) and (found.fs, found.motion) == (1024.0, "burst")
    assert found.status.tolist() == [Status.OK] * 5 and not lost.any()
    assert str(found) == str(result) == "lqg on burst: 5 trials at 1024 Hz, 410 samples; 5 ok"
    ours, theirs = indices(found), indices(result)
    for name in NAMES:
        np.testing.assert_allclose(ours[name], theirs[name], rtol=1e-8, err_msg=name)


@pytest.mark.parametrize("size", [0.0, 1e-300])
def test_a_target_that_does_not_move_gives_no_number(benchmark, size):
    """Indices over a target of zero were infinite, delays the end of their range, all "ok"."""
    still = Motion("still", size * MOTION.acceleration, 1024.0)
    plants = draw_plants(2, 1)
    found = simulate(benchmark, Passthrough(), plants, still)
    assert found.status.tolist() == [Status.UNDEFINED] * 2 and not found.lost.any()
    J = indices(found)
    # The sensors' noise moves the frame, so that the strokes have targets; the reference is still.
    assert all(np.isfinite(J[n]).all() for n in (*DELAYS, "J2_1", "J3_2", "J5_4", "J6_28"))
    assert all(np.isnan(J[n]).all() for n in ("J7_4", "J7_28", "J8_2", "J9_4", "J10_27"))
    assert str(found).endswith("; 2 undefined")
    assert found.describe(1).startswith("Trial 2 undefined: J7_4, J7_28, J8_2, ")
    assert found.describe(1).endswith("without a value, since the target does not move")
    silent = simulate(benchmark, Passthrough(), plants, still, QUIET)
    assert all(np.isnan(value).all() for value in indices(silent).values())


def test_a_study_marks_it(tmp_path):
    still = Motion("still", np.zeros(300), 1024.0)
    study = run_study(
        trials=2, controllers=["passthrough"], motions=[still], out=tmp_path / "s", signals=False
    )
    data = study.dataset
    assert np.all(data.status.values == Status.UNDEFINED) and study.failed == 0
    flags = data.status.attrs
    meanings = dict(zip(flags["flag_values"], flags["flag_meanings"].split(), strict=True))
    assert meanings[Status.UNDEFINED] == "undefined"
    assert np.isnan(data.value.sel(index="J7_4")).all()
    assert np.isfinite(data.value.sel(index="J2_1")).all()
    assert "passthrough on still: 0 of 2 trials" in study.summary().markdown()
    assert ",undefined," in (tmp_path / "s" / "study.csv").read_text()


def test_undefined_beside_lost_and_saturated(benchmark):
    """A trial that is lost says so whatever its target does."""
    wild = replace(LQG.design(benchmark), K_z=-20 * LQG.design(benchmark).K_z)
    still = Motion("still", np.zeros(410), 1024.0)
    assert simulate(benchmark, wild, nominal_plant(), still).status == [Status.DIVERGED]
    assert [s for s in Status if s >= Status.DIVERGED] == [Status.DIVERGED, Status.NONFINITE]


def test_a_target_above_the_smallest_squares_is_defined(benchmark):
    small = Motion("small", 1e-120 * MOTION.acceleration, 1024.0)
    found = simulate(benchmark, Passthrough(), nominal_plant(), small, QUIET)
    usual = simulate(benchmark, Passthrough(), nominal_plant(), MOTION, QUIET)
    assert found.status == [Status.OK]
    assert indices(found)["J8_2"] == pytest.approx(indices(usual)["J8_2"], rel=1e-2)


def test_the_gradient_of_a_delay(benchmark):
    """Whole samples have none; the interpolated delay has that of finite differences."""
    start, plants = LQG.design(benchmark), nominal_plant()

    def delays(scale):
        controller = replace(start, K_e=scale * start.K_e)
        run = simulate(benchmark, controller, plants, MOTION, QUIET)
        fine, whole = indices(run, interpolate=True), indices(run)
        return jnp.stack([jnp.stack([found[n][0] for n in DELAYS]) for found in (fine, whole)])

    both = jax.jit(lambda scale: jax.jvp(delays, (scale,), (1.0,)))
    _, (slope, whole) = both(1.0)
    np.testing.assert_array_equal(whole, np.zeros(4))
    h = 1e-4
    difference = (both(1 + h)[0] - both(1 - h)[0])[0] / (2 * h)
    np.testing.assert_allclose(slope, difference, rtol=1e-5)
    assert np.all(np.abs(slope) > 1e-3)


def test_the_interpolated_delay_of_a_known_one():
    """A wave that comes 3.3 samples late, by its correlation."""
    lags, n = (6, 13), 4096
    t = np.arange(-lags[1], n + lags[0])
    wave = lambda t: np.sin(2 * np.pi * t / 97) * np.exp(-(((t - n / 2) / 600) ** 2))  # noqa: E731
    r = correlate(jnp.asarray(wave(t[lags[1] : lags[1] + n] - 3.3))[:, None],
                  jnp.asarray(wave(t))[:, None], lags)  # fmt: skip
    state = {"correlation": np.asarray(r)[:, None], "target_square": np.ones((1, 1))}
    delay = Delay(fs=1000.0, lags=lags)
    np.testing.assert_allclose(delay.interpolated().result(state)[""][0], 3.3, atol=2e-3)
    np.testing.assert_array_equal(delay.result(state)[""][0], 3.0)
