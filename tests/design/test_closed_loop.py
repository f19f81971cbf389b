"""LQG.design refuses what runs away on its own plant; its quick check is the engine's own loop."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from martths_jax import LQG, InputError, build_benchmark, nominal_plant
from martths_jax.control.controllers.lqg import check_weights
from martths_jax.control.design.closed_loop import lowest_stable_rate, nominal_radius
from martths_jax.stability import spectral_radius

Q = 3e-5


def looked_at(benchmark, **weights):
    """A design, stable or not, and its step in NumPy."""
    made = LQG.design(benchmark, q=Q, allow_unstable=True, **weights)
    return made, jax.tree.map(np.asarray, replace(made, estimator=None)).step


@pytest.mark.parametrize("weights", [{}, {"y": (0.0, 0.0)}, {"r": (1e-3, 1e-3)}])
def test_the_quick_radius_is_the_engines(benchmark, weights):
    made, step = looked_at(benchmark, **weights)
    quick = nominal_radius(benchmark, made.estimator.filter_gain, step)
    assert quick == pytest.approx(spectral_radius(benchmark, made, nominal_plant())[0], abs=1e-10)


def test_a_design_that_runs_away_names_the_lowest_rate_that_holds():
    """At 512 Hz every run of the default ended in NaN at its third sample."""
    slow = build_benchmark(512)
    lowest = lowest_stable_rate(slow, Q, looked_at(slow)[1])
    assert 600 < lowest < 1024
    message = f"pole of magnitude .* at 512 Hz. .* lowest sampling rate that holds is {lowest:g} Hz"
    with pytest.raises(InputError, match=message):
        LQG.design(slow)
    LQG.design(build_benchmark(lowest))
    with pytest.raises(InputError, match=f"holds is {lowest:g} Hz"):
        LQG.design(build_benchmark(lowest - 1))


def test_where_the_rate_is_not_the_cause_it_is_not_blamed(benchmark):
    """Without a weight on the strokes plant and filter hold, and the structure swings up."""
    with pytest.raises(InputError, match=r"magnitude 1\.0019.* Raise r or lower e, or design with"):
        LQG.design(benchmark, y=(0.0, 0.0))


def test_a_design_under_jit_is_checked_as_outside(benchmark):
    gain = jax.jit(lambda s: s * LQG.design(benchmark).K_e)(2.0)
    np.testing.assert_array_equal(gain, 2 * LQG.design(benchmark).K_e)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"q": 1e30}, "`q` must give a filter's Riccati equation that can be solved"),
        ({"q": "a"}, "`q` must be a positive number, but got 'a'"),
        ({"q": (1.0, 1.0)}, "`q` must be a positive number"),
        ({"e": ("a", 1)}, r"`e` must be two positive numbers, but got \('a', 1\)"),
        ({"e": 1.0}, "`e` must be two positive numbers"),
        ({"y": (1.0, np.nan)}, "`y` must be two non-negative numbers"),
        ({"r": (0.0, 1.0)}, "`r` must be two positive numbers"),
    ],
)
def test_weights_that_are_none(benchmark, given, message):
    with pytest.raises(InputError, match=message):
        LQG.design(benchmark, **given)


@pytest.mark.parametrize("name", ["e", "r", "y", "q"])
def test_traced_weights_are_told_where_to_go(name):
    given = {"e": (1.0, 1.0), "r": (1.0, 1.0), "y": (1.0, 1.0), "q": 1.0}

    def traced(x):
        value = x if name == "q" else (x, 1.0)
        check_weights(**(given | {name: value}))

    with pytest.raises(InputError, match=f"`{name}` .* traced value. .*lqg_from_weights"):
        jax.eval_shape(traced, 1.0)


def test_no_benchmark():
    with pytest.raises(InputError, match="`benchmark` must be a Benchmark, but got int"):
        LQG.design(3)
