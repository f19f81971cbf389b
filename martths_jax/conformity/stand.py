"""The test stand: a compensator without the loop, driven with given strokes.

One program is compiled for a controller and goes through all checks of the box.  It serves the
delay line as the loop does, window by window, so that the time it takes is the loop's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.benchmark import Benchmark
from martths_jax.conformity.strokes import measured, targets
from martths_jax.control.base import Controller
from martths_jax.control.compensator import Compensator, CompensatorState
from martths_jax.control.entry import Entry
from martths_jax.loop import window_of
from martths_jax.motions import Motion
from martths_jax.plant import Plants, draw_plants, plant_from_draws
from martths_jax.result import Result
from martths_jax.runtime import compiler_options
from martths_jax.sensors import SensorNoise
from martths_jax.simulation import LANES, prepare, simulate

#: Least length of a drive [samples], and least number of windows in it, so that what a delay line
#: holds comes out again and is renewed.
SAMPLES, WINDOWS = 1024, 2
#: Samples that are gone through without a compiler.
EAGER = 4
#: The strong part of a motion: from so long before it first reaches so much of its peak, so long.
BEFORE, SHARE, LENGTH = 0.5, 0.3, 5.0

#: Strokes x_a and x_m (N, 2, T) [mm].
Strokes = tuple[np.ndarray, np.ndarray]
#: A compensator's state without its delay line, and the records in that (n, ..., T).
Carry = tuple[CompensatorState, Any]


class Drive:
    """The program: a compensator through N samples, from a state to a state.

    Attributes:
        traces: how often it was traced, and so compiled.
    """

    def __init__(self, dt: float):
        self.dt, self.traces = dt, 0
        self._program = jax.jit(self._run, compiler_options=compiler_options())

    def start(self, controller: Controller, trials: int) -> Carry:
        """Everything at rest."""
        box = Compensator(controller, controller.estimator, self.dt)
        line = controller.delay_line(trials)
        empty = lambda x: jnp.zeros((line.samples, *x.shape), x.dtype)  # noqa: E731
        return box.init_served(trials), jax.tree.map(empty, line.blank if line else None)

    def __call__(
        self, controller: Controller, strokes: Strokes, carry: Carry | None = None
    ) -> tuple[np.ndarray, Carry]:
        """Drive a prepared controller.

        Args:
            controller: the same pytree at every call, or the program is compiled anew.
            strokes: (N, 2, T), N a multiple of its window.
            carry: where it starts; at rest by default.

        Returns:
            (N, 2, T) commands u [mm], and where it ended.
        """
        x_a, x_m = strokes
        carry = self.start(controller, x_a.shape[-1]) if carry is None else carry
        u, carry = self._program(controller, carry, jnp.asarray(x_a), jnp.asarray(x_m))
        return np.asarray(u), carry

    def _run(self, controller, carry, x_a, x_m):
        self.traces += 1
        return drive(controller, carry, x_a, x_m, self.dt)


def sample(
    controller: Controller, state: CompensatorState, x_a, x_m, delayed, dt: float
) -> tuple[CompensatorState, jax.Array, Any]:
    """One sample: the next state, the commands u (2, T) [mm], the record for the delay line."""
    box = Compensator(controller, controller.estimator, dt)
    observed, _ = box.observe(state, x_m)
    state, decision = box.decide_served(observed, x_a, delayed)
    return state, decision.u, decision.record


def drive(controller: Controller, carry: Carry, x_a, x_m, dt: float) -> tuple[jax.Array, Carry]:
    """All samples of (N, 2, T) strokes: the commands (N, 2, T) and the state after them."""
    length = window_of(controller)
    line = controller.delay_line(x_a.shape[-1])

    def one(state, seen):
        state, u, record = sample(controller, state, *seen, dt)
        return state, (u, record)

    def window(carry, strokes):
        state, records = carry
        state, (u, records) = jax.lax.scan(one, state, (*strokes, records))
        if line is not None and line.renew is not None:
            state = replace(state, controller=line.renew(state.controller))
        return (state, records), u

    cut = lambda x: x.reshape(-1, length, *x.shape[1:])  # noqa: E731
    carry, u = jax.lax.scan(window, carry, (cut(x_a), cut(x_m)))
    return u.reshape(-1, *u.shape[2:]), carry


@dataclass
class Stand:
    """A controller, and all that it is checked with.

    Attributes:
        name: of the controller; made: as it was built, not prepared.
        entry: what speaks for it; settings: of it, where they were given.
        benchmark: what it is prepared for.
        motion: of the runs with the whole loop; seed: of plants, noise and strokes.
    """

    name: str
    made: Controller
    entry: Entry
    settings: Mapping[str, Any]
    benchmark: Benchmark
    motion: Motion
    seed: int
    drive: Drive = field(init=False)

    def __post_init__(self):
        self.drive = Drive(self.benchmark.dt)

    @cached_property
    def controller(self) -> Controller:
        """Ready to run.

        Raises:
            InputError: it breaks the protocol.
        """
        return prepare(self.made, self.benchmark, LANES)[0]

    @cached_property
    def plants(self) -> Plants:
        """As many uncertain ones as a block holds."""
        return draw_plants(LANES, self.seed)

    @property
    def noise(self) -> SensorNoise:
        """The benchmark's."""
        return SensorNoise(seed=self.seed)

    @cached_property
    def samples(self) -> int:
        """Length N of a drive."""
        length = window_of(self.controller)
        return length * max(WINDOWS, -(-SAMPLES // length))

    @cached_property
    def _strokes(self) -> Strokes:
        x_a = targets(2 * self.samples, LANES, self.benchmark.dt, self.seed)
        return x_a, measured(self.benchmark, self.plants, x_a, self.noise)

    @property
    def strokes(self) -> Strokes:
        """What it is driven with first."""
        return tuple(x[: self.samples] for x in self._strokes)

    @property
    def further(self) -> Strokes:
        """What comes next: N more samples."""
        return tuple(x[self.samples :] for x in self._strokes)

    @cached_property
    def first(self) -> tuple[np.ndarray, Carry]:
        """Commands and end of the first drive, from rest; all other drives are held against it."""
        return self.drive(self.controller, self.strokes)

    @property
    def u(self) -> np.ndarray:
        """(N, 2, T) commands of the first drive [mm]."""
        return self.first[0]

    @cached_property
    def second(self) -> np.ndarray:
        """(N, 2, T) commands of the next N samples [mm]."""
        return self.drive(self.controller, self.further, self.first[1])[0]

    @cached_property
    def whole(self) -> Result:
        """The loop of the uncertain plants through the whole motion."""
        return simulate(self.benchmark, self.made, self.plants, self.motion, self.noise)

    @cached_property
    def with_nominal(self) -> Plants:
        """The nominal plant, and the uncertain ones."""
        draws = np.vstack([np.zeros((1, 9)), self.plants.draws])
        return plant_from_draws(draws, trial=np.append(0, self.plants.trial))

    @cached_property
    def strong(self) -> Motion:
        """The strong part of the motion."""
        size, fs = np.abs(self.motion.acceleration), self.motion.fs
        first = max(0, int(np.argmax(size > SHARE * size.max())) - round(BEFORE * fs))
        part = self.motion.acceleration[first : first + round(LENGTH * fs)]
        return replace(self.motion, acceleration=part)

    @cached_property
    def kept(self) -> Result:
        """The loop of all plants through the strong part, with its signals."""
        return self.through(self.strong)

    def through(self, motion: Motion) -> Result:
        """The loop of all plants through a motion, with its signals."""
        return simulate(self.benchmark, self.made, self.with_nominal, motion, self.noise, keep=True)

    def again(self, strokes: Strokes) -> np.ndarray:
        """Commands (N, 2, T) on other strokes, from rest [mm]."""
        return self.drive(self.controller, strokes)[0]

    def eager(self) -> np.ndarray:
        """The first ``EAGER`` commands of ``second``, gone through in plain Python [mm]."""
        state, records = self.first[1]
        u = []
        for k in range(min(EAGER, window_of(self.controller))):
            delayed = jax.tree.map(lambda x, k=k: x[k], records)
            seen = (jnp.asarray(x[k]) for x in self.further)
            state, command, _ = sample(self.controller, state, *seen, delayed, self.benchmark.dt)
            u.append(np.asarray(command))
        return np.stack(u)


def same(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Whether two arrays of doubles have the same bits, element by element."""
    bits = lambda x: np.ascontiguousarray(x).view(np.int64)  # noqa: E731
    return bits(one) == bits(other)


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """Largest difference of two arrays, in parts of the largest value [-]; infinite for NaN."""
    if same(one, other).all():
        return 0.0
    largest = np.max(np.abs(one))
    difference = np.max(np.abs(one - other)) / largest if largest > 0 else np.inf
    return float(difference) if np.isfinite(difference) else float("inf")
