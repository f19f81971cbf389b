"""Controllers with one fault each, and one without: u = x_a + gain (x_a - x_m), more or less."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax import Controller, Decision, DirectMeasurement


def controller(kind):
    """A class as a controller has to be."""
    return jax.tree_util.register_dataclass(dataclass(frozen=True)(kind))


@controller
class Sound(Controller):
    """Without a fault: a gain on the error and half of the error before."""

    gain: float = 0.1
    estimator: Any = None

    name = "sound"

    def prepare(self, benchmark):
        return replace(self, estimator=DirectMeasurement())

    def init(self, trials):
        return jnp.zeros((2, trials))

    def step(self, state, seen):
        error = seen.x_a - seen.x_m
        return error, Decision(self.command(seen, error + 0.5 * state))

    def command(self, seen, error):
        return seen.x_a + self.gain * error


@controller
class Growing(Sound):
    """Its state is (2,) at first and (2, T) after a sample."""

    def init(self, trials):
        return jnp.zeros(2)


@controller
class Counting(Sound):
    """Its state is whole at first and real after a sample."""

    def init(self, trials):
        return jnp.zeros((2, trials), int)


@controller
class Listed(Sound):
    """A list as a static field."""

    taps: list = field(default_factory=lambda: [1, 2], metadata={"static": True})


@controller
class Listing(Sound):
    """A Python list holds the strokes before."""

    past = []  # noqa: RUF012

    def command(self, seen, error):
        self.past.append(seen.x_a)
        return seen.x_a + 0.1 * (seen.x_a - self.past[max(0, len(self.past) - 2)])


@controller
class Clocked(Sound):
    """A counter of its class goes on with every call of Python's."""

    calls = [0]  # noqa: RUF012

    def command(self, seen, error):
        self.calls[0] += 1
        return seen.x_a * (1 + 1e-3 * self.calls[0])


@controller
class CallingBack(Sound):
    """A callback counts the samples on the host."""

    calls = np.zeros(1)

    def count(self, x):
        CallingBack.calls += 1
        return np.asarray(x) * (1 + 1e-4 * self.calls[0])

    def command(self, seen, error):
        shape = jax.ShapeDtypeStruct(seen.x_a.shape, seen.x_a.dtype)
        return jax.experimental.io_callback(self.count, shape, seen.x_a, ordered=True)


@controller
class Marking(Sound):
    """It notes on itself that it has run, which changes no command."""

    def command(self, seen, error):
        object.__setattr__(self, "has_run", True)
        return seen.x_a


@controller
class Fresh(Sound):
    """`prepare` makes a new function every time."""

    shape: Any = field(default=None, metadata={"static": True})

    def prepare(self, benchmark):
        return replace(self, estimator=DirectMeasurement(), shape=lambda x: 0.5 * x)

    def command(self, seen, error):
        return seen.x_a + self.shape(error)


@controller
class Weak(Sound):
    """Its state begins as a number of Python's."""

    def init(self, trials):
        return 0.0, jnp.zeros((2, trials))

    def step(self, state, seen):
        k, before = state
        after, decision = super().step(before, seen)
        return (k + jnp.ones(()), after), decision


def locals_of_callers():
    """Names and values in all frames that lead here."""
    frame = sys._getframe()
    while frame is not None:
        yield from frame.f_locals.items()
        frame = frame.f_back


@controller
class Peeking(Sound):
    """It finds the whole strokes in its callers and leads by a sample of the future."""

    def command(self, seen, error):
        for name, value in locals_of_callers():
            if name == "x_a" and isinstance(value, jax.core.Tracer) and value.ndim == 3:
                return value[jnp.minimum(seen.k + 1, value.shape[0] - 1)]
        return seen.x_a


@controller
class Foreseeing(Sound):
    """It finds the ground motion in the loop and acts on the next sample of it."""

    def command(self, seen, error):
        for name, value in locals_of_callers():
            if name == "ground" and isinstance(value, jax.core.Tracer) and value.ndim == 1:
                return seen.x_a + 1e-3 * value[jnp.minimum(seen.k + 1, value.size - 1)]
        return seen.x_a


@controller
class Mixing(Sound):
    """All trials share the mean of their errors."""

    def command(self, seen, error):
        return seen.x_a + self.gain * jnp.mean(error, axis=-1, keepdims=True)


@controller
class Spreading(Sound):
    """It rests when any stroke of any trial is NaN."""

    def command(self, seen, error):
        ill = jnp.any(jnp.isnan(seen.x_m))
        return jnp.where(ill, 0.0, super().command(seen, error))


@controller
class Asking(Sound):
    """It asks whether it is traced."""

    def command(self, seen, error):
        return seen.x_a + (0.1 if isinstance(error, jax.core.Tracer) else 0.2) * error


@controller
class Traced(Sound):
    """Without a trace it fails."""

    def command(self, seen, error):
        if not isinstance(error, jax.core.Tracer):
            raise ValueError("no trace, no command")
        return seen.x_a + self.gain * error


@controller
class Rooted(Sound):
    """A root whose slope at rest is infinite, where a value is not taken."""

    def command(self, seen, error):
        size = jnp.sqrt(jnp.maximum(self.gain * error, 0.0))
        return seen.x_a + jnp.where(error > 0, 1e-3 * size, 0.0)


@controller
class Untraceable(Sound):
    """Its number must be Python's."""

    def prepare(self, benchmark):
        return replace(self, estimator=DirectMeasurement(), gain=float(self.gain))


@controller
class Loud(Sound):
    """A dither whose volts a valve does not bear, and that the loop survives."""

    def command(self, seen, error):
        return seen.x_a + 40.0 * jnp.where(seen.k % 2 == 0, 1.0, -1.0)


@controller
class Runaway(Sound):
    """Far too much gain."""

    gain: float = 30.0
