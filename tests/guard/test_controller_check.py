"""A controller that breaks the protocol is one sentence before anything is compiled."""

from dataclasses import dataclass, make_dataclass, replace
from types import MappingProxyType

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
    blocks,
    draw_plants,
    nominal_plant,
    simulate,
    simulation,
)
from martths_jax.control.base import DelayLine, Signal
from martths_jax.control.check import PROBE, RESERVED, check_controller
from martths_jax.control.estimators import DirectMeasurement
from tests.engine.motions import burst


def own(fields=(), registered=True, estimator=DirectMeasurement(), **methods):
    """An instance of a good controller with some of its methods and fields replaced."""
    good = {
        "init": lambda self, trials: jnp.zeros((2, trials)),
        "step": lambda self, state, seen: (seen.x_a, Decision(seen.x_a)),
    }
    whole = [("estimator", object, estimator), *fields]
    kind = make_dataclass("Own", whole, bases=(Controller,), frozen=True, namespace=good | methods)
    return (jax.tree_util.register_dataclass(kind) if registered else kind)()


def deciding(make):
    """A controller whose step decides what `make` makes of the target."""
    return own(step=lambda self, state, seen: (state, make(seen.x_a)))


def line(samples=8, renew=None):
    """A delay line of strokes."""
    return lambda self, trials: DelayLine(samples, jnp.zeros((2, trials)), renew)


#: name -> controller, what the sentence says.
WRONG = {
    "not registered": (
        lambda: own(registered=False), "must be a pytree, but is none; put @jax.tree_util",
    ),
    "text in a field": (
        lambda: own([("text", str, "a")]), "Field `text` .* must hold numbers, but got str; .*stat",
    ),
    "no estimator": (lambda: own(estimator=None), "must have an `estimator` once"),
    "half an estimator": (
        lambda: own(estimator=1.0), "must have a method `init`, but float has none",
    ),
    "prepare forgot to return": (
        lambda: own(prepare=lambda self, benchmark: None), "`prepare` .* but got NoneType",
    ),
    "command of one actuator": (
        lambda: deciding(lambda x: Decision(x[0])),
        r"give a command of shape \(2, trials\), but got \(trials,\)",
    ),
    "command in single precision": (
        lambda: deciding(lambda x: Decision(x.astype(jnp.float32))), "command of type float64",
    ),
    "no Decision": (lambda: deciding(lambda x: x), "return a Decision from `step`"),
    "no state": (
        lambda: own(step=lambda self, state, seen: Decision(seen.x_a)),
        "return a tuple of state and Decision from step",
    ),
    "record without a line": (
        lambda: deciding(lambda x: Decision(x, record=x)), "have a delay line if `step` returns",
    ),
    "record of another shape": (
        lambda: own(delay_line=line(), step=lambda self, state, seen: (
            state, Decision(seen.x_a, record=seen.x_a[0]))),
        r"shape of its record, but got \(2, trials\) from its delay line and \(trials,\) from step",
    ),
    "line and no record": (lambda: own(delay_line=line()), "keep the structure of its record"),
    "line that is none": (
        lambda: own(delay_line=lambda self, trials: 8), "a DelayLine or None .* but got int",
    ),
    "state in single precision": (
        lambda: own(init=lambda self, trials: jnp.zeros((2, trials), jnp.float32)),
        "keep its state in double precision, but got float32",
    ),
    "state that grows": (
        lambda: own(init=lambda self, trials: jnp.zeros(2)),
        r"keep the shape of its state, but got \(2,\) from init and \(2, trials\) from step",
    ),
    "state of another kind": (
        lambda: own(init=lambda self, trials: jnp.zeros((2, trials), int)),
        "keep the type of its state, but got int64 from init and float64 from step",
    ),
    "state of another structure": (
        lambda: own(step=lambda self, state, seen: ((state, state), Decision(seen.x_a))),
        "keep the structure of its state",
    ),
    "renewal that changes the state": (
        lambda: own(delay_line=line(renew=lambda state: state[0]),
                    step=lambda self, state, seen: (
                        state, Decision(seen.x_a, record=seen.x_a))),
        "shape of its state, .* from renew of its delay line",
    ),
    "signal with other axes than declared": (
        lambda: own(signals=(Signal("a", ("actuator", "tap")),), step=lambda self, state, seen: (
            state, Decision(seen.x_a, signals={"a": seen.x_a}))),
        r"signal `a` the axes that it declares, \(actuator, tap, trials\), but got \(2, trials\)",
    ),
    "signal under a name of the loop": (
        lambda: deciding(lambda x: Decision(x, signals={"x_m": x})), "names other than x_a, x_m",
    ),
    "signal without trials": (
        lambda: deciding(lambda x: Decision(x, signals={"a": x.T})),
        r"signal `a` end in the axis of trials, but got \(trials, 2\)",
    ),
    "signal that is no array": (
        lambda: deciding(lambda x: Decision(x, signals={"a": "b"})), "hold arrays in its signal",
    ),
    "step that asks for a value": (
        lambda: own(step=lambda self, state, seen: (
            state, Decision(seen.x_a if seen.k > 3 else state))),
        "step ends in TracerBoolConversionError",
    ),
    "a former name of what it sees": (
        lambda: own(step=lambda self, state, seen: (state, Decision(seen.target_mm))),
        "step ends in AttributeError .*`target_mm` is called `x_a` now",
    ),
    "a former name of what it gives": (
        lambda: deciding(lambda x: Decision(command_mm=x)), "`command_mm` is called `u` now",
    ),
    "line of half a sample": (lambda: own(delay_line=line(1.5)), "line of a whole number of sam"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_a_broken_rule_is_one_sentence(name, benchmark):
    make, message = WRONG[name]
    with pytest.raises(InputError, match=message) as caught:
        simulation.prepare(make(), benchmark, 3)
    assert "\n" not in str(caught.value) and "\\n" not in str(caught.value)


def test_it_is_said_before_anything_is_compiled(benchmark, monkeypatch):
    monkeypatch.setattr(blocks, "compiled", lambda *given: pytest.fail("was to be compiled"))
    for controller in (deciding(lambda x: Decision(x[0])), [deciding(lambda x: Decision(x[0]))]):
        with pytest.raises(InputError, match="give a command of shape"):
            simulate(benchmark, controller, nominal_plant(), burst(0.3))


def test_good_controllers_pass_once_for_all(benchmark, monkeypatch):
    from martths_jax.control import check

    monkeypatch.setattr(check, "_GOOD", {})
    ready = ADFC(nb=64, no=63).prepare(benchmark)
    assert not any(check_controller(ready, benchmark, 3))
    monkeypatch.setattr(check, "_trace", lambda *given: pytest.fail("was traced again"))
    assert not any(check_controller(ready, benchmark, 500))
    assert not any(check_controller(replace(ready, pull=jnp.asarray(1e-3)), benchmark, 3))


def test_reserved_names_are_the_loops_own(benchmark):
    result = simulate(benchmark, Passthrough(), nominal_plant(), burst(0.3), keep=True)
    assert {*result.signals, "x"} == set(RESERVED)  # observers see it, and it is not kept


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Gain(Controller):
    """u = gain x_a through taps that all trials share: no field says what its axes are."""

    gain: jax.Array
    taps: jax.Array
    estimator: object = DirectMeasurement()

    def init(self, trials):
        return jnp.zeros((2, trials))

    def step(self, state, seen):
        return state, Decision(self.taps.sum() * self.gain * seen.x_a)


def marked(benchmark, controller, trials) -> list[bool]:
    return list(check_controller(controller, benchmark, trials))


@pytest.fixture
def as_users_write_it():
    """A number a trial (T,) on (2, T) strokes."""
    with jax.numpy_rank_promotion("allow"):
        yield


@pytest.mark.usefixtures("as_users_write_it")
def test_which_arrays_hold_one_value_a_trial(benchmark):
    scalar, taps = np.asarray(2.0), np.ones(5)
    assert marked(benchmark, Gain(scalar, taps), 5) == [False, False]
    assert marked(benchmark, Gain(np.ones(4), taps), 4) == [True, False]
    assert marked(benchmark, Gain(np.ones(PROBE), taps), PROBE) == [True, False]
    with pytest.raises(InputError, match="step ends in ValueError"):
        marked(benchmark, Gain(np.ones(4), taps), 3)
    # What a class says of its fields is taken as it stands: two trials, and (8, 2) is shared.
    ready = ADFC(nb=64, no=63, pull=np.ones(2)).prepare(benchmark)
    names = [jax.tree_util.keystr(p) for p, _ in jax.tree_util.tree_leaves_with_path(ready)]
    found = dict(zip(names, marked(benchmark, ready, 2), strict=True))
    assert [name for name, own in found.items() if own] == [".pull"]


def test_a_number_of_values_that_is_not_that_of_the_trials(benchmark):
    plants, motion = draw_plants(3, 1), burst(0.3)
    for given, message in (
        ({"pull": np.ones(64)}, "`pull` of controller ADFC .* has 64 and there are 3 trials"),
        ({"q": np.full(2, 1e-5)}, "has 2 and there are 3 trials"),
        ({"start": np.zeros((8, 2, 4))}, "`start` .* has 4 and there are 3 trials"),
    ):
        with pytest.raises(InputError, match=message):
            simulate(benchmark, ADFC(nb=64, no=np.array(63), **given), plants, motion)
    lqg = LQG.design(benchmark)
    with pytest.raises(InputError, match=r"`K_e` of controller LQG .* has 5"):
        wide = replace(lqg, K_e=jnp.repeat(lqg.K_e[..., None], 5, axis=-1))
        simulate(benchmark, wide, plants, motion)


@pytest.mark.usefixtures("as_users_write_it")
def test_a_controller_may_say_what_its_axes_are(benchmark):
    said = type("Said", (Gain,), {"shared_axes": MappingProxyType({"gain": 0, "taps": 1})})
    said = jax.tree_util.register_dataclass(dataclass(frozen=True)(said))
    assert marked(benchmark, said(np.ones(5), np.ones(5)), 5) == [True, False]
