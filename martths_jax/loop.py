"""One sample period, and the one scan over time that repeats it.

Everything here is pure: what stays (benchmark, controller, plants) and what moves (``LoopState``)
are pytrees, trials stand on the last axis.  ``sample_period`` read from top to bottom is the
physics.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp

from martths_jax.benchmark import Benchmark
from martths_jax.control.base import Controller, DelayLine
from martths_jax.control.compensator import Compensator, CompensatorState
from martths_jax.layout import Layout
from martths_jax.observers import Observer
from martths_jax.rig.specimen import History
from martths_jax.structure.modal import ModalSystem, advance, output

#: Length of the time loop's windows for controllers that keep none [samples].
WINDOW = 1024
#: A window is gone through in pieces of at most so many samples, whose strokes stay in the cache.
PIECE = 256


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class LoopState:
    """What moves, at the start of sample k.

    Attributes:
        structure: (2, n, T) state of the numerical substructure.
        plant: (2, m, T) state of the plants.
        compensator: state of estimator and controller.
        force_path: prediction of the force path's own filter for k; None without one.
        specimen: state of the specimen.
        interface: (2, d, T) interface motion that the force was made from at k-1 and k-2.
    """

    structure: jax.Array
    plant: jax.Array
    compensator: CompensatorState
    force_path: Any
    specimen: Any
    interface: jax.Array


def initial_state(
    benchmark: Benchmark, compensator: Compensator, plant: ModalSystem, trials: int
) -> LoopState:
    """Everything at rest."""
    at_rest = lambda system: jnp.zeros(system.a.shape[:2] + (trials,))  # noqa: E731
    own = benchmark.force_filter
    return LoopState(
        structure=at_rest(benchmark.numerical),
        plant=at_rest(plant),
        compensator=compensator.init_served(trials),
        force_path=None if own is None else own.init(trials),
        specimen=benchmark.specimen.init(trials),
        interface=jnp.zeros((2, len(benchmark.layout.interface), trials)),
    )


def sample_period(
    benchmark: Benchmark,
    compensator: Compensator,
    plant: ModalSystem,
    state: LoopState,
    ground: jax.Array,
    noise: jax.Array,
    delayed: Any,
) -> tuple[LoopState, dict[str, jax.Array], Any]:
    """Advance a batch of trials by one sample k.

    Args:
        ground: ground acceleration at k [m/s^2], a scalar.
        noise: (rows, T or 1) sensor noise at k [mm], one row for all sensors or one each; then that
            of the load cells [N], where there are some.
        delayed: what comes out of the controller's delay line.

    Returns:
        state at k + 1, signals at k, the record that goes into the delay line.
    """
    # What the sensors and the filter know of the strokes at k.
    layout = benchmark.layout
    true, loads = parted(layout, output(plant, state.plant))
    stroke_noise, load_noise = parted_noise(layout, noise)
    measured = true + stroke_noise
    observed, estimate = compensator.observe(state.compensator, measured)
    known, felt = felt_strokes(benchmark, state.force_path, true, measured, estimate)

    # Interface motion of those strokes and the force of the specimen; what it sees before the first
    # sample is the first, so that it starts without velocity and acceleration.
    interface = benchmark.coupler.to_frame(felt)
    before = jnp.where(state.compensator.k == 0, interface, state.interface)
    history = History(interface, before)
    if layout.load_cells:
        specimen, force = state.specimen, loads + load_noise
    else:
        specimen, force = benchmark.specimen.step(state.specimen, history, benchmark.dt)

    # Numerical substructure under its own inertia and that force.
    load = [ground, *-force]
    numerical = output(benchmark.numerical, state.structure, load)
    target = benchmark.coupler.to_actuators(numerical[: len(layout.interface)])

    box, decision = compensator.decide_served(observed, target, delayed)
    command = decision.u

    own = benchmark.force_filter
    after = LoopState(
        structure=advance(benchmark.numerical, state.structure, load),
        plant=advance(plant, state.plant, command),
        compensator=box,
        force_path=None if own is None else own.predict(known, command),
        specimen=specimen,
        interface=history.moved(),
    )
    signals = {
        "x_a": target,
        "x_m": measured,
        "x_hat": felt,
        "u": command,
        "num": numerical,
        "est": interface,
        "force": force,
        "x": true,
    }
    return after, signals | decision.signals, decision.record


def parted(layout: Layout, rows: jax.Array) -> tuple[jax.Array, jax.Array | None]:
    """Strokes, and the load cells' forces or None, of the rows that a plant gives."""
    if not layout.load_cells:
        return rows, None
    n = len(layout.actuators)
    return rows[:n], rows[n:]


def parted_noise(layout: Layout, rows: jax.Array) -> tuple[jax.Array, jax.Array | None]:
    """Noise of the strokes, and of the load cells or None."""
    if not layout.load_cells:
        return rows, None
    n = rows.shape[0] - len(layout.forces)
    return rows[:n], rows[n:]


def felt_strokes(benchmark: Benchmark, predicted, true, measured, estimate) -> tuple[Any, Any]:
    """Strokes that the specimen's force is made from, by the benchmark's ``force_from``.

    Args:
        predicted: the force path's own filter's prediction for k, if it has one.
        true, measured, estimate: (n, T) x(k), x_m(k) and the controller's x_hat(k) [mm].

    Returns:
        what that filter knows at k, or None; (n, T) strokes [mm].
    """
    if benchmark.force_filter is not None:
        return benchmark.force_filter.correct(predicted, measured)
    sources = {"measurement": measured, "estimate": estimate, "stroke": true}
    return None, sources[benchmark.force_from]


def run(
    benchmark: Benchmark,
    controller: Controller,
    plant: ModalSystem,
    ground: jax.Array,
    reference: jax.Array,
    noise: jax.Array,
    *,
    trials: int,
    observers: Sequence[Observer],
    samples: jax.Array | None = None,
    segment: int = 0,
) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """Run a batch of trials over a whole motion.

    The scan over time is nested: windows of the controller's delay line outside, in them pieces
    whose strokes stay in the cache until the observers have seen them, in these samples.  The
    records that a window writes are what the next one hands back, so the line costs neither a ring
    buffer nor its indices.

    Args:
        benchmark, controller: what stays; the controller is prepared.
        plant: discretised plants.
        ground: (N,) ground acceleration [m/s^2].
        reference: (N, o) response of the reference structure.
        noise: (N, rows, T or 1) sensor noise, see ``sample_period``.
        trials: number T of trials in the batch.
        observers: what looks at the run, see ``Observer``.
        samples: length of the motion where `ground`, `reference` and `noise` are padded beyond it;
            a traced number, so that motions of any length share a program.  Not for reverse mode.
        segment: for reverse mode: keep the state only once in so many samples (a divisor of the
            window) and go through the segment again for its derivative; 0 keeps every sample's.

    Returns:
        the observers' states, finished; what they emitted, (N, ...), zeros beyond the motion.
    """
    rows = ground.shape[0]
    N = rows if samples is None else samples
    compensator = Compensator(controller, controller.estimator, benchmark.dt)
    line = controller.delay_line(trials)
    length = window_of(controller)
    part = segment or piece_length(length)
    windows = -(-rows // length)
    pieces = tuple(dict.fromkeys(name for o in observers for name in o.pieces))

    def sample(moving, inputs):
        state, seen = moving
        ground_k, reference_k, noise_k, delayed = inputs
        k = state.compensator.k
        state, signals, record = sample_period(
            benchmark, compensator, plant, state, ground_k, noise_k, delayed
        )
        valid = k < N
        seen = tuple(
            observer.add(one, signals, reference_k[:, None], k, valid)
            for observer, one in zip(observers, seen, strict=True)
        )
        strokes = {name: jnp.where(valid, signals[name], 0.0) for name in pieces}
        emitted = tuple(observer.emit(signals) for observer in observers)
        return (state, seen), (strokes, record, emitted)

    def piece(carry, inputs):
        (state, seen), (strokes, records, emitted) = jax.lax.scan(sample, carry, inputs)
        seen = tuple(
            observer.add_piece(one, {name: strokes[name] for name in observer.pieces})
            for observer, one in zip(observers, seen, strict=True)
        )
        return (state, seen), (records, emitted)

    def window(carry, inputs):
        records, carry = carry
        inputs = (*inputs, records)
        cut = lambda x: x.reshape(length // part, part, *x.shape[1:])  # noqa: E731
        join = lambda x: x.reshape(length, *x.shape[2:])  # noqa: E731
        body = jax.checkpoint(piece, prevent_cse=False) if segment else piece
        (state, seen), outputs = jax.lax.scan(body, carry, jax.tree.map(cut, inputs))
        records, emitted = jax.tree.map(join, outputs)
        return (records, (_renewed(state, line), seen)), emitted

    empty = lambda x: jnp.zeros((length, *x.shape), x.dtype)  # noqa: E731
    records = jax.tree.map(empty, line.blank if line else None)
    state = initial_state(benchmark, compensator, plant, trials)
    carry = (records, (state, tuple(observer.init(trials) for observer in observers)))
    inputs = tuple(_in_windows(x, windows, length) for x in (ground, reference, noise))
    if samples is None:
        carry, emitted = jax.lax.scan(window, carry, inputs)
    else:
        carry, emitted = _scan_first(window, carry, inputs, -(-N // length))

    _, (_, seen) = carry
    whole = lambda x: x.reshape(windows * length, *x.shape[2:])[:rows]  # noqa: E731
    finished = (observer.finish(one) for observer, one in zip(observers, seen, strict=True))
    return tuple(finished), jax.tree.map(whole, emitted)


def _renewed(state: LoopState, line: DelayLine | None) -> LoopState:
    """The state after the delay line has gone through once."""
    if line is None or line.renew is None:
        return state
    box = state.compensator
    return replace(state, compensator=replace(box, controller=line.renew(box.controller)))


def _in_windows(x: jax.Array, windows: int, length: int) -> jax.Array:
    """(N, ...) filled up with zeros and cut to (windows, length, ...)."""
    padded = jnp.pad(x, [(0, windows * length - x.shape[0])] + [(0, 0)] * (x.ndim - 1))
    return padded.reshape(windows, length, *x.shape[1:])


def _scan_first(body, carry, inputs, count: jax.Array):
    """``jax.lax.scan`` over the first `count` of the inputs, a traced number; the outputs of the
    rest are zeros."""
    inputs_at = lambda i: jax.tree.map(lambda x: x[i], inputs)  # noqa: E731
    rows = jax.tree.leaves(inputs)[0].shape[0]
    shapes = jax.eval_shape(body, carry, inputs_at(0))[1]
    blank = jax.tree.map(lambda x: jnp.zeros((rows, *x.shape)), shapes)

    def one(i, so_far):
        carry, outputs = so_far
        carry, new = body(carry, inputs_at(i))
        put = jax.lax.dynamic_update_index_in_dim
        return carry, jax.tree.map(lambda x, row: put(x, row, i, 0), outputs, new)

    return jax.lax.fori_loop(0, count, one, (carry, blank))


def window_of(controller: Controller) -> int:
    """Length of the time loop's windows with a controller [samples]."""
    line = controller.delay_line(1)
    return line.samples if line else WINDOW


def piece_length(window: int) -> int:
    """Largest divisor of a window up to ``PIECE``; the whole window where all are small."""
    longest = next(n for n in range(min(PIECE, window), 0, -1) if window % n == 0)
    return longest if longest >= PIECE // 8 else window
