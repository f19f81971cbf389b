"""Whether a controller keeps the protocol of ``base``, found out before anything is compiled.

One sample is traced with abstract arrays (``jax.eval_shape``: shapes and types, no arithmetic), on
a number of trials that none of the controller's own arrays has.  The same look says which of its
arrays hold one value a trial.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.base import Controller, Decision, DelayLine, Observation
from martths_jax.errors import InputError
from martths_jax.signals import SIGNALS

if TYPE_CHECKING:
    from martths_jax.benchmark import Benchmark

#: Number of trials to trace with: that of a block, so that JAX need not trace the stages of a
#: sample again for it; or the next one that no array of the controller ends in.
PROBE = 64
#: Former names of what a controller sees and gives -> what they are called now.
RENAMED = {"target_mm": "x_a", "measured_mm": "x_m", "estimate_mm": "x_hat", "command_mm": "u"}
#: Signals that the loop itself gives: one of these names would replace what the indices see.
RESERVED = tuple(signal.name for signal in SIGNALS)
#: Controllers that were found good: key of ``_key`` -> which leaves hold one value a trial.
_GOOD: dict[tuple, tuple[bool, ...]] = {}
_MOST_KEPT = 256

Key = jax.tree_util.GetAttrKey


def check_controller(controller: Controller, benchmark: Benchmark, trials: int) -> tuple[bool, ...]:
    """Check a prepared controller, and find which of its leaves hold one value a trial.

    Args:
        controller: as its ``prepare`` gave it.
        benchmark: what it is prepared for.
        trials: how many are going to run.

    Returns:
        for each leaf, whether its last axis counts the trials.

    Raises:
        InputError: saying which part of the protocol is broken.
    """
    _check_pytree(controller)
    about = benchmark.dt, len(benchmark.layout.actuators)
    key = _key(controller, about, trials)
    if key not in _GOOD:
        while len(_GOOD) >= _MOST_KEPT:
            del _GOOD[next(iter(_GOOD))]
        _GOOD[key] = _check(controller, about, trials)
    return _GOOD[key]


def _key(controller, about, trials) -> tuple:
    leaves, tree = jax.tree.flatten(controller)
    shapes = tuple((np.shape(x), str(jnp.result_type(x))) for x in leaves)
    ending = tuple(bool(s) and s[-1] == trials for s, _ in shapes)
    return tree, shapes, ending, about, trials == 1


def _check(controller, about, trials) -> tuple[bool, ...]:
    marks, candidates = _declared(controller, trials)
    try:
        _trace(controller, *about, marks)
    except InputError:
        # An array of a field that says nothing of its axes may hold one value a trial.
        if not any(candidates):
            raise
        marks = tuple(m or c for m, c in zip(marks, candidates, strict=True))
        _trace(controller, *about, marks)
    return marks


def _check_pytree(controller) -> None:
    if not isinstance(controller, Controller):
        kind = type(controller).__name__
        raise InputError(f"Method `prepare` of a controller must return one, but got {kind}.")
    kind = type(controller).__name__
    leaves = jax.tree_util.tree_flatten_with_path(controller)[0]
    for path, leaf in leaves:
        if leaf is controller:
            raise InputError(
                f"Controller {kind} must be a pytree, but is none; put "
                "@jax.tree_util.register_dataclass above its @dataclass(frozen=True)."
            )
        if not _is_numeric(leaf):
            raise InputError(
                f"Field `{_name(path)}` of controller {kind} must hold numbers, but got "
                f"{type(leaf).__name__}; what is no number is declared "
                'field(metadata={"static": True}).'
            )
    if getattr(controller, "estimator", None) is None:
        raise InputError(
            f"Controller {kind} must have an `estimator` once it is prepared, but has none; let "
            "`prepare` return replace(self, estimator=design_kalman(...)), or DirectMeasurement()."
        )
    for method in ("init", "correct", "predict"):
        if not callable(getattr(controller.estimator, method, None)):
            raise InputError(
                f"The estimator of controller {kind} must have a method `{method}`, but "
                f"{type(controller.estimator).__name__} has none; see "
                "martths_jax.control.base.Estimator."
            )


def _declared(controller, trials: int) -> tuple[tuple[bool, ...], tuple[bool, ...]]:
    """Leaves that hold one value a trial by their owners' ``shared_axes``, and those that may."""
    marks, candidates = [], []
    for path, leaf in jax.tree_util.tree_flatten_with_path(controller)[0]:
        shape = np.shape(leaf)
        axes = _shared_axes(controller, path)
        own = axes is not None and len(shape) == axes + 1 and shape[-1] != 1
        if own and shape[-1] != trials:
            one = "is one trial" if trials == 1 else f"are {trials} trials"
            raise InputError(
                f"Field `{_name(path)}` of controller {type(controller).__name__} must be the same "
                f"for all trials or hold one value a trial on its last axis, but that has "
                f"{shape[-1]} and there {one}."
            )
        marks.append(own)
        candidates.append(axes is None and trials > 1 and shape[-1:] == (trials,))
    return tuple(marks), tuple(candidates)


def _shared_axes(controller, path) -> int | None:
    """Axes of a leaf when all trials share it, as its owner says; None if it says nothing."""
    owner, place = controller, controller
    name = None
    for key in path:
        if isinstance(key, Key):
            owner, name = place, key.name
        place = _step_into(place, key)
    return getattr(type(owner), "shared_axes", {}).get(name)


def _step_into(place, key):
    if isinstance(key, Key):
        return getattr(place, key.name)
    inside = getattr(key, "key", getattr(key, "idx", None))
    try:
        return place[inside]
    except (TypeError, KeyError, IndexError):  # a container of the user's own
        return None


def _is_numeric(leaf) -> bool:
    numbers = isinstance(leaf, (bool, int, float, complex))
    return numbers or getattr(leaf, "dtype", np.dtype(object)).kind in "biufc"


def _name(path) -> str:
    return jax.tree_util.keystr(path).lstrip(".") or "itself"


def _trace(controller, dt: float, actuators: int, marks: tuple[bool, ...]) -> None:
    """Trace one sample with abstract arrays; every rule that is broken raises."""
    leaves, tree = jax.tree.flatten(controller)
    ends = {np.shape(x)[-1:] for x in leaves}
    trials = next(n for n in itertools.count(PROBE) if (n,) not in ends)
    abstract = [
        jax.ShapeDtypeStruct(
            (*np.shape(x)[:-1], trials) if own else np.shape(x), jnp.result_type(x)
        )
        for x, own in zip(leaves, marks, strict=True)
    ]
    strokes = jax.ShapeDtypeStruct((actuators, trials), jnp.dtype(float))
    number = jax.ShapeDtypeStruct((), jnp.dtype(int))
    look = _Look(type(controller).__name__, trials, actuators, dt)
    jax.eval_shape(
        lambda leaves, *seen: look.sample(jax.tree.unflatten(tree, leaves), *seen),
        abstract, number, strokes, strokes,
    )  # fmt: skip


class _Look:
    """One look at one sample.

    Args:
        kind: class of the controller.
        trials: how many are traced.
        actuators: number n of strokes.
        dt: sample period [s].
    """

    def __init__(self, kind: str, trials: int, actuators: int, dt: float):
        self.kind, self.trials, self.actuators, self.dt = kind, trials, actuators, dt

    def sample(self, controller: Controller, k, target, measured) -> None:
        """Go through what the loop does in a sample and at a window's end."""
        estimator, T = controller.estimator, self.trials
        predicted = self.call("init of its estimator", estimator.init, T)
        found = self.call("correct of its estimator", estimator.correct, predicted, measured)
        corrected, estimate = self.pair(found, "correct of its estimator", "state and estimate")
        self.shaped(estimate, "estimate")
        state = self.call("init", controller.init, T)
        line = self.call("delay_line", controller.delay_line, T)
        self.check_line(line)
        blank = line.blank if line else None
        for tree, what in ((state, "state"), (blank, "record")):
            self.double(tree, what)
        seen = Observation(k, self.dt, target, measured, estimate, corrected, blank)
        found = self.call("step", controller.step, state, seen)
        after, decision = self.pair(found, "step", "state and Decision")
        if not isinstance(decision, Decision):
            self.refuse("return a Decision from `step`", type(decision).__name__)
        self.same(state, after, "state", "init", "step")
        self.shaped(decision.u, "command")
        self.check_record(line, decision.record)
        self.check_signals(controller, decision.signals)
        if line and line.renew:
            renewed = self.call("renew of its delay line", line.renew, after)
            self.same(state, renewed, "state", "init", "renew of its delay line")
        after = self.call("predict of its estimator", estimator.predict, corrected, decision.u)
        self.same(predicted, after, "estimator's state", "init", "predict")

    def refuse(self, wanted: str, got: str, remedy: str = "") -> None:
        """Raise the sentence about a broken rule."""
        raise InputError(f"Controller {self.kind} must {wanted}, but got {got}.{remedy}")

    def call(self, what: str, function, *args) -> Any:
        """What a method of the user's returns; whatever it raises becomes a sentence."""
        try:
            return function(*args)
        except InputError:
            raise
        except Exception as error:  # the user's code may raise anything
            reason = (str(error).splitlines() or [""])[0]
            former = [name for name in RENAMED if name in reason]
            hint = "".join(f"  `{name}` is called `{RENAMED[name]}` now." for name in former)
            raise InputError(
                f"Controller {self.kind}: {what} ends in {type(error).__name__} ({reason}) when it "
                f"is traced with {self.trials} trials, which stand on the last axis of every array."
                + hint
            ) from error

    def pair(self, found, method: str, what: str) -> tuple:
        """The two results of a method."""
        if not isinstance(found, tuple) or len(found) != 2:
            self.refuse(f"return a tuple of {what} from {method}", type(found).__name__)
        return found

    def shaped(self, value, what: str) -> None:
        """An array (n, T) of double precision."""
        if jnp.shape(value) != (self.actuators, self.trials):
            given = self.shape(value)
            self.refuse(f"give a {what} of shape ({self.actuators}, trials)", given)
        if jnp.result_type(value) != jnp.dtype(float):
            self.refuse(f"give a {what} of type float64", str(jnp.result_type(value)))

    def shape(self, value) -> str:
        """Shape in words."""
        sizes = ["trials" if n == self.trials else str(n) for n in jnp.shape(value)]
        return f"({', '.join(sizes)}{',' if len(sizes) == 1 else ''})"

    def leaves(self, tree, what: str) -> Iterator[tuple[str, Any]]:
        """Leaves of something the controller returned, each with its name."""
        for path, leaf in jax.tree_util.tree_flatten_with_path(tree)[0]:
            name = f"{what} {jax.tree_util.keystr(path)}".strip()
            if not _is_numeric(leaf):
                self.refuse(f"hold arrays in its {name}", type(leaf).__name__)
            yield name, leaf

    def double(self, tree, what: str) -> None:
        """Nothing in single or half precision."""
        for name, leaf in self.leaves(tree, what):
            kind = jnp.result_type(leaf)
            if jnp.issubdtype(kind, jnp.inexact) and kind not in (float, complex):
                self.refuse(f"keep its {name} in double precision", str(kind))

    def same(self, before, after, what: str, first: str, second: str) -> None:
        """The same structure, shapes and types before and after."""
        if jax.tree.structure(before) != jax.tree.structure(after):
            self.refuse(
                f"keep the structure of its {what}",
                f"{jax.tree.structure(before)} from {first} and {jax.tree.structure(after)} from "
                f"{second}",
            )
        pairs = zip(self.leaves(before, what), self.leaves(after, what), strict=True)
        for (name, one), (_, other) in pairs:
            if jnp.shape(one) != jnp.shape(other):
                self.refuse(
                    f"keep the shape of its {name}",
                    f"{self.shape(one)} from {first} and {self.shape(other)} from {second}",
                )
            if jnp.result_type(one) != jnp.result_type(other):
                self.refuse(
                    f"keep the type of its {name}",
                    f"{jnp.result_type(one)} from {first} and {jnp.result_type(other)} from "
                    f"{second}",
                )

    def check_line(self, line) -> None:
        """A delay line is a whole number of samples long."""
        if line is None:
            return
        if not isinstance(line, DelayLine):
            self.refuse("return a DelayLine or None from `delay_line`", type(line).__name__)
        n = line.samples
        if isinstance(n, bool) or not isinstance(n, (int, np.integer)) or n < 1:
            self.refuse("have a delay line of a whole number of samples", repr(n))

    def check_record(self, line: DelayLine | None, record) -> None:
        """A record needs a delay line with a blank one of its shape."""
        if line is None and record is not None:
            self.refuse(
                "have a delay line if `step` returns a record", "a record and no line",
                " Let delay_line(trials) return DelayLine(samples, zeros of the record's shape); "
                "`window`, `blank_record` and `turn` of earlier versions became this method.",
            )  # fmt: skip
        if line is not None:
            self.same(line.blank, record, "record", "its delay line", "step")

    def check_signals(self, controller, signals) -> None:
        """Named arrays that end in the trials and hide none of the loop's own."""
        if not isinstance(signals, dict):
            self.refuse("give its signals as a dict", type(signals).__name__)
        for name, value in signals.items():
            if not isinstance(name, str):
                self.refuse("name its signals by text", repr(name))
            if name in RESERVED:
                self.refuse(
                    f"give its signals names other than {', '.join(RESERVED)}, which the loop has",
                    repr(name),
                )
            for _, leaf in self.leaves(value, f"signal `{name}`"):
                if leaf is not value:
                    self.refuse(f"give one array as signal `{name}`", type(value).__name__)
            if jnp.shape(value)[-1:] != (self.trials,):
                self.refuse(f"let signal `{name}` end in the axis of trials", self.shape(value))
            told = next((x for x in controller.signals if x.name == name), None)
            if told is not None and jnp.ndim(value) != len(told.dims) + 1:
                self.refuse(
                    f"give signal `{name}` the axes that it declares, "
                    f"({', '.join([*told.dims, 'trials'])})", self.shape(value),
                )  # fmt: skip
            if told is not None and told.count and jnp.shape(value) != (self.trials,):
                self.refuse(f"count one number a trial in `{name}`", self.shape(value))
