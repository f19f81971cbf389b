"""Gradients of whole runs, and the descent on a short motion."""

import json
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax import (
    ADFC,
    LQG,
    InputError,
    Motion,
    build_benchmark,
    draw_plants,
    load_motion,
    loop,
)
from martths_jax.campaign.owner import owned
from martths_jax.control.controllers.adfc import GUARD_PULL
from martths_jax.control.entry import Entry, Parameter
from martths_jax.sensors import SensorNoise
from martths_jax.simulation import reference_response
from martths_jax.tune import Options, tune
from martths_jax.tune import search as searching
from martths_jax.tune.gradient import Gradient
from martths_jax.tune.objective import Objective
from martths_jax.tune.parameters import start_of, tuned
from tests.tune import guest as guests
from tests.tune.bowl import Bowl
from tests.tune.guest import Lead


@pytest.fixture(scope="module")
def benchmark():
    return build_benchmark()


@pytest.fixture(scope="module")
def motion():
    whole = load_motion("elcentro-like", scale=0.4, fs=1024)
    first = int(np.argmax(np.abs(whole.acceleration))) - 512
    return replace(whole, acceleration=whole.acceleration[first : first + 2048])


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["lqg", "adfc"])
def test_gradient_through_checkpointed_segments(benchmark, motion, kind):
    """Reverse mode against finite differences and forward mode, over three windows."""
    objective = Objective.parse("j2+j3+j5+j1")
    plants = draw_plants(2, seed=3)
    ground = jnp.asarray(motion.acceleration)
    reference = reference_response(benchmark, ground)
    noise = SensorNoise().draw(plants.trial, ground.size, benchmark.fs)
    base = (LQG.design(benchmark) if kind == "lqg" else ADFC(nb=640, no=639)).prepare(benchmark)

    observers = objective.observers(benchmark.fs)

    def value(x, segment):
        gain = base.estimator.filter_gain * (1 + x[1])
        changed = replace(base, estimator=replace(base.estimator, filter_gain=gain))
        if kind == "lqg":
            changed = replace(changed, K_z=base.K_z * (1 + x[0]))
        else:
            changed = replace(changed, pull=base.pull * jnp.exp(x[0]))
        states, _ = loop.run(
            benchmark, changed, plants.discretise(benchmark.dt), ground, reference, noise,
            trials=2, observers=observers, segment=segment,
        )  # fmt: skip
        return jnp.mean(objective.evaluate(observers, states)[0])

    points = 1e-5 * jnp.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    plain = jax.jit(lambda x: value(x, 0))
    at = [float(plain(x)) for x in points]
    slope = [(at[1] - at[2]) / 2e-5, (at[3] - at[4]) / 2e-5]
    result, reverse = jax.jit(jax.value_and_grad(lambda x: value(x, 32)))(points[0])
    assert float(result) == pytest.approx(at[0], rel=1e-10)
    np.testing.assert_allclose(reverse, slope, rtol=1e-4)
    forward = jax.jit(lambda x, d: jax.jvp(lambda y: value(y, 0), (x,), (d,))[1])
    both = forward(points[0], jnp.array([1.0, 1.0]))
    assert float(both) == pytest.approx(float(jnp.sum(reverse)), rel=1e-7)


@pytest.fixture
def bowl(monkeypatch):
    monkeypatch.setattr(searching, "Gradient", Bowl)
    monkeypatch.setattr(Bowl, "wall", np.inf)
    return Options(
        "adfc", "j2", trials=1, steps=60, rate=0.2, start=(("pull", 1e-5), ("q", 1e-3)),
        method="adam",
    )  # fmt: skip


def test_descent_finds_the_minimum_and_stops_early(bowl, tmp_path):
    state = tune(None, replace(bowl, steps=400), [], tmp_path)
    assert state["best"]["pull"] == pytest.approx(-3, abs=0.05)
    assert state["best"]["q"] == pytest.approx(-4, abs=0.05)
    assert state["ended"] and len(state["history"]) < 400


@pytest.mark.parametrize("wall", [np.inf, -3.9])
@pytest.mark.parametrize("method", ["lbfgs", "adam"])
def test_interrupted_tuning_goes_on_as_if_nothing_had_happened(
    bowl, tmp_path, monkeypatch, method, wall
):
    """Killed after any evaluation, also in the middle of a line search."""
    monkeypatch.setattr(Bowl, "wall", wall)
    bowl = replace(bowl, method=method, steps=25)
    whole = tune(None, bowl, [], tmp_path / "whole")
    for steps in range(1, len(whole["history"]) + 1):
        parts = tune(None, replace(bowl, steps=steps), [], tmp_path / "parts")
        assert repr(parts["history"]) == repr(whole["history"][:steps])  # NaN is not itself
    assert (parts["best"], parts["ended"]) == (whole["best"], whole["ended"])
    if np.isfinite(wall):
        assert any(row["diverged"] for row in whole["history"])
    with pytest.raises(InputError, match="other options"):
        tune(None, replace(bowl, seed=2), [], tmp_path / "parts")


def test_lbfgs_needs_few_evaluations(bowl, tmp_path):
    state = tune(None, replace(bowl, method="lbfgs"), [], tmp_path)
    assert state["best"] == pytest.approx({"pull": -3, "q": -4}, abs=1e-9)
    assert len(state["history"]) < 12 and state["ended"]


def test_a_fresh_start_and_what_is_left_of_a_session(bowl, tmp_path):
    tune(None, replace(bowl, steps=4), [], tmp_path)
    (tmp_path / "design.json").write_text("{}")
    (tmp_path / "mine.txt").write_text("kept")
    state = tune(None, replace(bowl, steps=2, seed=2), [], tmp_path, fresh=True)
    assert len(state["history"]) == 2
    assert not (tmp_path / "design.json").exists() and (tmp_path / "mine.txt").exists()
    sessions = json.loads((tmp_path / "provenance.json").read_text())["sessions"]
    assert [s["trials"] for s in sessions] == [0] and sessions[0]["compile_seconds"] >= 0


@pytest.mark.parametrize("change", ["scale", "samples"])
def test_a_tuning_goes_on_with_the_same_samples_only(bowl, tmp_path, change):
    """The same name and length are not the same record."""
    plain = Motion("one", np.arange(1.0, 9.0), 1024.0, scale=0.4)
    double = replace(plain, acceleration=2 * plain.acceleration, scale=0.8)
    other = double if change == "scale" else replace(plain, acceleration=plain.acceleration[::-1])
    tune(None, replace(bowl, steps=3), [plain], tmp_path)
    with pytest.raises(InputError, match="motions"):
        tune(None, bowl, [other], tmp_path)


def test_no_bit_of_a_state_changes_without_a_word(bowl, tmp_path):
    whole = tune(None, replace(bowl, steps=5), [], tmp_path)
    content = (tmp_path / "state.json").read_bytes()
    for bit in range(5, 8 * len(content), 997):
        changed = bytearray(content)
        changed[bit // 8] ^= 1 << (bit % 8)
        (tmp_path / "state.json").write_bytes(changed)
        said = []
        try:
            again = tune(None, replace(bowl, steps=5), [], tmp_path, notice=said.append)
        except InputError as error:  # a letter of an option, say
            assert "state.json" in str(error)
            continue
        assert again["history"] == whole["history"] and again["best"] == whole["best"]
        assert any("damaged" in text for text in said) or json.loads(changed) == json.loads(content)
        for aside in tmp_path.glob("*.damaged*"):
            aside.unlink()


def test_two_tunings_do_not_share_a_folder(bowl, tmp_path):
    with owned(tmp_path, "martths tune"), pytest.raises(InputError, match="in use"):
        tune(None, bowl, [], tmp_path)


def test_unstable_steps_are_backed_off(bowl, tmp_path, monkeypatch):
    monkeypatch.setattr(Bowl, "wall", -4.0)
    state = tune(None, bowl, [], tmp_path)
    refused = [row for row in state["history"] if not row["accepted"]]
    assert refused and state["best"]["pull"] <= -4.0
    assert state["best"]["pull"] > -4.2
    assert np.all(np.isfinite([r["objective"] for r in state["history"] if r["accepted"]]))


def test_unstable_start_is_refused(bowl, tmp_path, monkeypatch):
    monkeypatch.setattr(Bowl, "wall", -6.0)
    with pytest.raises(InputError, match="start"):
        tune(None, bowl, [], tmp_path)


def test_only_free_numbers_move(bowl, tmp_path):
    state = tune(None, replace(bowl, free=("q",)), [], tmp_path)
    assert state["best"]["pull"] == -5 and state["best"]["q"] < -3.5


@pytest.mark.slow
def test_gradient_of_plants_and_motions_and_of_other_weights(benchmark, motion):
    """Forward mode against finite differences; one program for all weights of the same indices."""
    short = replace(motion, acceleration=motion.acceleration[512:1100])
    gradient = Gradient(
        benchmark, "lqg", Objective.parse("j5+j8"), draw_plants(2, seed=3), [short, short]
    )
    start = start_of("lqg")
    other = gradient.of(Objective.parse("3*j5+0.5*j8"))
    loss, slope, smooth, lost = other(start)
    groups = {g: np.mean([v for n, v in smooth.items() if n[:2] == g]) for g in ("J5", "J8")}
    assert lost == 0
    assert loss == pytest.approx(3 * groups["J5"] + 0.5 * groups["J8"], rel=1e-12)
    assert gradient(start)[0] == pytest.approx(groups["J5"] + groups["J8"], rel=1e-12)
    for name in ("e1", "q"):
        ends = [other(start | {name: start[name] + step})[0] for step in (1e-4, -1e-4)]
        assert slope[name] == pytest.approx((ends[0] - ends[1]) / 2e-4, rel=1e-4)
    with pytest.raises(InputError, match="J2_1"):
        other.of(Objective.parse("j2"))


def lead(benchmark, motion, **more):
    """Gradient of the guest's only number."""
    guest = f"{Lead.__module__}:Lead"
    return Gradient(benchmark, guest, Objective.parse("j2+j5"), draw_plants(2, seed=3), [motion],
                    **more)  # fmt: skip


def test_both_modes_give_the_same_slope(benchmark, motion):
    short = replace(motion, acceleration=motion.acceleration[512:1300])
    start = start_of(f"{Lead.__module__}:Lead")
    ways = {mode: lead(benchmark, short, mode=mode) for mode in ("forward", "reverse")}
    assert lead(benchmark, short).mode == "forward"
    found = {mode: gradient(start) for mode, gradient in ways.items()}
    assert found["forward"][0] == pytest.approx(found["reverse"][0], rel=1e-12)
    assert found["forward"][1]["lead"] == pytest.approx(found["reverse"][1]["lead"], rel=1e-8)
    ends = [ways["forward"]({"lead": start["lead"] + h})[0] for h in (1e-4, -1e-4)]
    assert found["forward"][1]["lead"] == pytest.approx((ends[0] - ends[1]) / 2e-4, rel=1e-5)
    with pytest.raises(InputError, match="`mode` must be one of forward, reverse"):
        lead(benchmark, short, mode="sideways")


def test_the_slope_is_of_the_free_numbers_only(benchmark, motion):
    short = replace(motion, acceleration=motion.acceleration[512:1100])
    given = ("lqg", Objective.parse("j5+j8"), draw_plants(2, seed=3), [short])
    some = Gradient(benchmark, *given, free=("q",))
    assert set(some(start_of("lqg"))[1]) == {"q"}


def test_a_number_of_any_sign_is_tuned_as_it_is(benchmark):
    found = tuned(f"{Lead.__module__}:Lead{{lead=-0.01}}")
    assert not found.is_log("lead") and found.start == {"lead": -0.01}
    at = found.coordinates(found.start)
    assert at == {"lead": -1.0} and found.values(at) == found.shown(at) == found.start
    assert found.on_host(benchmark, {"lead": 2.0}).lead == 0.02
    assert float(found.build(benchmark, {"lead": 2.0}).lead) == 0.02


def test_what_an_entry_gives_is_where_tuning_starts():
    assert start_of("adfc") == {"pull": float(np.log10(GUARD_PULL)), "q": float(np.log10(3e-5))}
    assert tuned("slow=adfc{nb=64,no=63,q=1e-6}").start["q"] == 1e-6
    assert tuned("slow=adfc{nb=64,no=63,q=1e-6}").fixed == {"nb": 64, "no": 63}


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("passthrough", "no number that can be tuned"),
        ("adfc{nbs=64}", "settings among pull, q, nb"),
        ("adfc{nb=2}", "`nb` must be a whole number of at least 9"),
        ("adfc{q=-1}", "positive q"),
        ("lqgg", "'lqgg' is unknown; the nearest are lqg"),
    ],
)
def test_controllers_that_cannot_be_tuned(given, words):
    with pytest.raises(InputError, match=words):
        tuned(given)


def test_a_setting_that_only_the_constructor_takes_is_refused_before_compiling(benchmark, tmp_path):
    options = Options("lqg{allow_unstable=true}", "j2")
    with pytest.raises(InputError, match="cannot be tuned with allow_unstable set"):
        tune(benchmark, options, [], tmp_path)


def test_an_entry_without_a_start_asks_for_one(tmp_path):
    entry = Entry("mine", Lead, parameters=(Parameter("lead", kind="tunable"),))
    guests.MINE = entry
    try:
        with pytest.raises(InputError, match="`start` must give lead a value"):
            tuned(f"{Lead.__module__}:MINE")
        assert tuned(f"{Lead.__module__}:MINE", {"lead": 0.01}).start == {"lead": 0.01}
    finally:
        del guests.MINE


def test_settings_stay_while_numbers_move(benchmark):
    for text, name, value in (("lqg{error=measured}", "error", "measured"),
                              ("adfc{towards=start,nb=64,no=63}", "towards", "start")):  # fmt: skip
        one = tuned(text)
        at = one.coordinates(one.start)
        assert getattr(one.build(benchmark, at), name) == value
        assert getattr(one.on_host(benchmark, at), name) == value
