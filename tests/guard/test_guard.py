"""The identification falls back on the inverse plant, keeps the last good fit, loses no trial."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax import (
    ADFC,
    LQG,
    Motion,
    Passthrough,
    SensorNoise,
    Status,
    blocks,
    draw_plants,
    indices,
    nominal_plant,
    simulate,
)
from martths_jax.algebra import least_squares as ls
from martths_jax.control.adaptive.differences import BACKWARD_DIFFERENCES
from martths_jax.control.adaptive.inverse import nominal_inverse
from martths_jax.control.controllers import adfc
from martths_jax.control.controllers.adfc import CONDITION_LIMIT
from martths_jax.control.controllers.feedforward import follow_target
from martths_jax.indices import trials_last
from martths_jax.transfer import frequency_response
from tests.engine.motions import burst

NB = 128


@pytest.fixture(scope="module")
def late() -> Motion:
    """Almost no motion while the buffer fills, then a burst: what real records do."""
    motion = burst(1.5)
    quiet = np.where(motion.time < 0.3, 0.01, 1.0)
    return replace(motion, name="late burst", acceleration=quiet * motion.acceleration)


def test_inverse_undoes_the_nominal_plant(benchmark):
    """C' Phi H = 1/z in the band, with the continuous plant, hold and delay written anew."""
    C = nominal_inverse(benchmark.plant_model, benchmark.fs, BACKWARD_DIFFERENCES)
    f = np.array([1.0, 2.3, 5.0, 10.0, 14.0])
    w = 2j * np.pi * f
    hold = (1 - np.exp(-w / 1024)) / (w / 1024)
    H = np.asarray(frequency_response(nominal_plant().parameters_hz, f))[..., 0]
    H = H * hold[:, None, None]
    derivatives = np.stack([np.ones(5), w / 1024, (w / 1024) ** 2, (w / 1024) ** 3])  # exact ones
    phi = np.einsum("df,foc->fodc", derivatives, H).reshape(5, 8, 2)
    loop = np.einsum("jk,fjc->fkc", C, phi)
    wanted = np.exp(-w / 1024)[:, None, None] * np.eye(2)
    assert np.abs(loop - wanted).max() < 0.2
    assert np.sqrt(np.mean(np.abs(loop - wanted) ** 2)) < 0.05


def test_literal_loses_trials_that_the_default_keeps(benchmark, late):
    plants = draw_plants(16, seed=1)
    literal = simulate(benchmark, ADFC(nb=NB, no=NB - 1, pull=0.0), plants, late)
    guarded = simulate(benchmark, ADFC(nb=NB, no=NB - 1), plants, late)
    assert literal.lost.sum() >= 4
    assert guarded.lost.sum() == 0
    found = indices(guarded)
    assert max(found[name].max() for name in ("J3_1", "J3_2", "J6_4", "J6_28")) < 15
    # Who is lost says so, and is NaN in every index; who is not is a number in every index.
    for name, value in indices(literal).items():
        np.testing.assert_array_equal(np.isnan(value), literal.lost, err_msg=name)
    for position in np.flatnonzero(literal.lost):
        assert "left +-100 mm or became NaN at sample" in literal.describe(position)


def test_a_singular_fit_keeps_the_last_good_coefficients(benchmark):
    """Without motion and noise the normal matrix is zero: each fit is held, and counted."""
    still = Motion("still", np.zeros(300), 1024.0)
    quiet = SensorNoise(noise_power=0.0)
    start = np.zeros((8, 2))
    start[0, 0] = start[4, 1] = 0.9
    literal = ADFC(nb=NB, no=NB - 4, pull=0.0, start=start)
    result = simulate(benchmark, literal, nominal_plant(), still, quiet, keep=True)
    due = len(range(NB + 4, 300, 4))
    assert result.counts["held"].tolist() == [due]
    assert np.all(result.signals["C_A"] == start)
    # Nothing moves: the delays and all that is measured on a target have no value.
    assert result.status[0] == Status.UNDEFINED
    assert all(np.isnan(value[0]) for value in indices(result).values())
    told = "fits that the controller did not use"
    assert result.describe(0).endswith(f"since the target does not move; {told}: {due}")

    pulled = replace(literal, pull=1e-5, towards="inverse")
    result = simulate(benchmark, pulled, nominal_plant(), still, quiet, keep=True)
    assert result.counts["held"].tolist() == [0]
    anchor = nominal_inverse(benchmark.plant_model, benchmark.fs, BACKWARD_DIFFERENCES)
    np.testing.assert_allclose(result.signals["C_A"][0, -1], anchor, rtol=1e-12)


def test_a_fit_beyond_the_condition_limit_is_held(benchmark, monkeypatch):
    """With a limit that no fit meets all are held, though each has a solution."""
    shaken = Motion("shaken", np.sin(np.arange(400.0) / 20), 1024.0)
    controller = ADFC(nb=80, no=79, pull=1e-6)
    free = simulate(benchmark, controller, nominal_plant(), shaken, keep=True)
    assert free.counts["held"].tolist() == [0]
    monkeypatch.setattr(adfc, "CONDITION_LIMIT", 1.0)
    blocks.compiled.cache_clear()
    held = simulate(benchmark, controller, nominal_plant(), shaken, keep=True)
    blocks.compiled.cache_clear()
    assert held.counts["held"].tolist() == [len(range(80 + 4, 400))]
    assert np.all(held.signals["C_A"] == follow_target(4, joint=True))
    assert not np.allclose(free.signals["C_A"][0, -1], follow_target(4, joint=True))


@pytest.mark.parametrize("solver", sorted(ls.SOLVERS))
def test_smallest_pivot_bounds_the_condition_number(solver):
    """Both solvers report min d_j / G_jj, whose inverse never exceeds the condition number."""
    rng = np.random.default_rng(3)
    phi = rng.standard_normal((40, 8, 3))
    phi[:, 5, 1] = phi[:, 2, 1] + 1e-5 * rng.standard_normal(40)  # nearly the same regressor
    phi[:, 5, 2] = 0.0  # no regressor at all
    rows = ls.zeros(8, 1, 3)
    for row in phi:
        rows = ls.add_observation(rows, list(jnp.asarray(row)), [jnp.ones(3)])
    tolerance = np.asarray(ls.SOLVERS[solver](rows)[1])
    for trial in range(2):
        G = phi[..., trial].T @ phi[..., trial]
        scale = 1 / np.sqrt(np.diag(G))
        condition = np.linalg.cond(scale[:, None] * G * scale)
        assert 1 <= 1 / tolerance[trial] <= condition
        # The share that one regressor keeps after projection on those before it.
        shares = []
        for j in range(8):
            before = phi[:, :j, trial]
            rest = phi[:, j, trial] - before @ np.linalg.lstsq(before, phi[:, j, trial])[0]
            shares.append(rest @ rest / G[j, j])
        assert tolerance[trial] == pytest.approx(min(shares), rel=1e-4)
    assert not tolerance[2] >= 1 / CONDITION_LIMIT


def test_statuses_name_actuator_time_and_volts(benchmark):
    start = LQG.design(benchmark)
    wild = replace(start, K_z=-20 * start.K_z)
    motion = burst()
    strong = replace(motion, acceleration=15 * motion.acceleration)
    kept = simulate(benchmark, [start, wild], draw_plants(2, 1), strong, keep=True)
    volts = np.abs(kept.signals["u"][0] / [7.4921 * 1.053, 7.3907 * 1.055] + [-0.00123, 0.0008])
    first = np.argmax(volts > 3.8, axis=0)
    line = kept.describe(0)
    assert line.startswith("Trial 1 saturated: ")
    for i in range(2):
        assert (volts[:, i] > 3.8).any()
        said = f"actuator {i + 1} beyond 3.8 V from sample {first[i]} ({first[i] / 1024:.3f} s)"
        assert f"{said}, peak {volts[:, i].max():.2f}"[:-1] in line
    u = kept.signals["u"][1]
    bad = ~(np.abs(u) <= 100)
    sample, actuator = np.unravel_index(np.argmax(bad), bad.shape)
    assert kept.describe(1).startswith(
        f"Trial 2 diverged: command u of actuator {actuator + 1} left +-100 mm or became NaN at "
        f"sample {sample} "
    )
    assert np.all(kept.watch.volt_peak < 100 / 7.7)
    assert kept.status.tolist() == [Status.SATURATED, Status.DIVERGED]


def test_a_stroke_that_is_not_finite_at_once(benchmark):
    """A broken sensor: no range was left before, so the status says what it is."""
    from martths_jax import watch

    watcher = watch.Watcher(benchmark.layout)
    seen = watcher.init(1)
    good = {"u": jnp.ones((2, 1)), "x_m": jnp.ones((2, 1))}
    broken = good | {"x_m": jnp.array([[1.0], [jnp.inf]])}
    for k, signals in enumerate((good, broken, good)):
        seen = watcher.add(seen, signals, None, jnp.asarray(k), jnp.asarray(True))
    sums = simulate(benchmark, Passthrough(), nominal_plant(), burst(0.3)).sums
    sums = trials_last(sums)
    assert watch.status_of(seen, sums).tolist() == [Status.NONFINITE]
    assert watch.describe(seen, sums, 0, 1024.0, benchmark.layout) == (
        "nonfinite: measured stroke x_m of actuator 2 is not finite at sample 1 (0.001 s)"
    )
