"""Estimator and controller as one box: what is simulated is what runs on recorded signals."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax import (
    ADFC,
    LQG,
    Compensator,
    DirectMeasurement,
    InputError,
    Passthrough,
    build_benchmark,
    design_kalman,
    draw_plants,
    indices,
    simulate,
)
from tests.engine.motions import burst

KINDS = {
    "passthrough": lambda b: Passthrough(),
    "lqg": lambda b: LQG.design(b),
    "adfc": lambda b: ADFC(nb=48, no=40),
}


def run_box(box, target, measured):
    """Commands (N, 2, T) of a compensator on recorded strokes (T, N, 2)."""
    first = lambda x: jnp.asarray(np.moveaxis(x, 0, -1))  # noqa: E731

    def sample(state, strokes):
        state, command, signals = box.step(state, *strokes)
        return state, (command, signals)

    strokes = first(target), first(measured)
    return jax.lax.scan(sample, box.init(target.shape[0]), strokes)[1]


@pytest.mark.parametrize("kind", KINDS)
def test_recorded_signals_give_the_loop_s_commands(kind, benchmark):
    controller = KINDS[kind](benchmark)
    result = simulate(benchmark, controller, draw_plants(3, seed=2), burst(0.4), keep=True)
    box = Compensator.of(controller, benchmark)
    command, signals = run_box(box, result.signals["x_a"], result.signals["x_m"])
    np.testing.assert_allclose(
        np.moveaxis(command, -1, 0), result.signals["u"], rtol=1e-7, atol=1e-9
    )
    for name, values in signals.items():
        stored = result.signals[name]
        np.testing.assert_allclose(np.moveaxis(values, -1, 0), stored, rtol=1e-5, atol=1e-7)


@pytest.mark.slow
def test_the_delay_line_comes_out_n_samples_later(benchmark):
    """Longer than its line, so that it has gone through several times and was renewed."""
    box = Compensator.of(ADFC(nb=9, no=8), benchmark)
    state = box.init(2)
    assert state.line.shape == (9, 4, 2)
    rng = np.random.default_rng(4)
    stored = []
    for k in range(30):
        observed, estimate = box.observe(state, jnp.asarray(rng.standard_normal((2, 2))))
        before = state.controller["command"]
        oldest = state.line[k % 9]
        expected = stored[k - 9] if k >= 9 else np.zeros((4, 2))
        np.testing.assert_array_equal(oldest, expected)
        stored.append(np.concatenate([estimate, np.stack(before)]))
        state, _, _ = box.decide(observed, jnp.asarray(rng.standard_normal((2, 2))))
    assert int(state.k) == 30
    # Renewed at 9, 18 and 27: the fresh sums hold the last three rows only.
    (sums,) = state.controller["fits"]
    assert float(sums["new"][0][0][0]) < float(sums["rows"][0][0][0])


@pytest.mark.parametrize("kind", KINDS)
def test_the_force_can_be_made_from_the_measurement(kind, benchmark):
    """What is felt is what the sensors say, whatever filter the controller runs."""
    measuring = build_benchmark(force_from="measurement")
    plants, motion = draw_plants(2, seed=5), burst(0.3)
    results = [
        simulate(b, KINDS[kind](b), plants, motion, keep=True) for b in (benchmark, measuring)
    ]
    signals = results[1].signals
    np.testing.assert_array_equal(signals["x_hat"], signals["x_m"])
    if kind != "passthrough":  # it runs no filter, so both are the measurement
        assert not np.array_equal(results[0].signals["force"], signals["force"])
        assert np.all(indices(results[0])["J4_1"] != np.nan)
    else:
        np.testing.assert_array_equal(results[0].signals["force"], signals["force"])


def test_the_force_path_may_have_a_filter_of_its_own(benchmark):
    """The same Kalman filter as the controller's gives the same force, to the last bits."""
    plants, motion = draw_plants(2, seed=6), burst(0.3)
    own = design_kalman(benchmark.plant_model, 3e-5, benchmark.r_mm2)
    filtered = build_benchmark(force_from=own)
    assert filtered.force_from == "filter"
    usual = simulate(benchmark, Passthrough(q=3e-5), plants, motion, keep=True)
    found = simulate(filtered, Passthrough(), plants, motion, keep=True)
    np.testing.assert_allclose(found.signals["force"], usual.signals["force"], rtol=1e-9, atol=1e-6)
    direct = simulate(
        build_benchmark(force_from=DirectMeasurement()),
        Passthrough(q=3e-5),
        plants,
        motion,
        keep=True,
    )
    plain = simulate(
        build_benchmark(force_from="measurement"), Passthrough(q=3e-5), plants, motion, keep=True
    )
    np.testing.assert_array_equal(direct.signals["u"], plain.signals["u"])


@pytest.mark.parametrize("wrong", ["measured", 3, None, DirectMeasurement])
def test_what_the_force_cannot_be_made_from(wrong):
    with pytest.raises(InputError, match=r"`force_from` must be one of \['estimate', 'measuremen"):
        build_benchmark(force_from=wrong)
