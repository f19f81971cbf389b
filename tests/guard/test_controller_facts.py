"""What docs/controllers.md says of the controllers, measured."""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax import (
    ADFC,
    LQG,
    Controller,
    Decision,
    InputError,
    Passthrough,
    SensorNoise,
    build_benchmark,
    draw_plants,
    nominal_plant,
    simulate,
)
from martths_jax.control.adaptive.differences import BACKWARD_DIFFERENCES, TAPS
from martths_jax.control.adaptive.inverse import nominal_inverse
from martths_jax.control.controllers.adfc import GUARD_PULL
from martths_jax.control.estimators import DirectMeasurement
from martths_jax.stability import spectral_radius
from martths_jax.watch import Status
from tests.engine.motions import burst


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Hold(Controller):
    """A constant command, whatever the target."""

    command: float
    estimator: object = None
    name = "hold"

    def prepare(self, benchmark):
        return replace(self, estimator=DirectMeasurement())

    def init(self, trials):
        return ()

    def step(self, state, seen):
        return state, Decision(u=jnp.full_like(seen.x_a, self.command))


@pytest.mark.slow
def test_the_valves_limit_is_watched_and_not_applied(benchmark):
    """Twice the command, beyond the limit, is twice the stroke."""
    strokes, motion = {}, burst(0.3)
    quiet = SensorNoise(noise_power=0.0)
    for command in (20.0, 40.0):
        result = simulate(
            benchmark, Hold(command), nominal_plant(), motion, quiet, keep=True
        )
        strokes[command] = result.signals["x_m"]
        beyond = Status.SATURATED if command > 30 else Status.OK
        assert result.status.tolist() == [beyond]
        np.testing.assert_array_equal(result.signals["u"], command)
    assert np.abs(strokes[40.0]).max() > 30
    np.testing.assert_allclose(strokes[40.0], 2 * strokes[20.0], rtol=1e-12)


@pytest.mark.parametrize(("fs", "stable"), [(956, True), (940, False)])
def test_lqg_needs_a_high_rate(fs, stable):
    benchmark = build_benchmark(fs=fs)
    lqg = LQG.design(benchmark, allow_unstable=True)
    assert bool(spectral_radius(benchmark, lqg, nominal_plant()).max() < 1) == stable
    if not stable:
        with pytest.raises(InputError, match="949 Hz"):
            LQG.design(benchmark)


def test_the_others_need_what_the_plant_needs():
    """Also what ADFC starts from and what it falls back on is stable by itself."""
    benchmark = build_benchmark(fs=161)
    start = ADFC().prepare(benchmark).start
    inverse = nominal_inverse(benchmark.plant_model, benchmark.fs, BACKWARD_DIFFERENCES)
    frozen = ADFC().frozen(benchmark, np.stack([start, inverse] * 4, axis=-1))
    for controller in (Passthrough().prepare(benchmark), frozen):
        assert spectral_radius(benchmark, controller, draw_plants(8, seed=1)).max() < 1
    with pytest.raises(InputError, match="at least 161 Hz"):
        build_benchmark(fs=160)


def test_adfc_is_guarded_unless_it_is_told_not_to_be(benchmark):
    guarded, literal = ADFC().prepare(benchmark), ADFC(pull=0).prepare(benchmark)
    inverse = nominal_inverse(benchmark.plant_model, benchmark.fs, BACKWARD_DIFFERENCES)
    assert guarded.pull == GUARD_PULL == 6e-5 and literal.pull == 0
    np.testing.assert_array_equal(guarded.anchor, inverse)


def test_adfc_follows_the_target_until_its_buffer_is_full(benchmark):
    motion = burst(0.3)
    adfc = ADFC(nb=100, no=99)
    signals = simulate(benchmark, adfc, nominal_plant(), motion, keep=True).signals
    own = np.any(np.abs(signals["u"] - signals["x_a"]) > 0, axis=(0, 2))
    assert np.argmax(own) == 100 + TAPS - 1
    assert ADFC().nb + TAPS - 1 == 1028
