"""The front door: check what came in, run it in blocks of trials over the devices, hand it back."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh
from jax.sharding import PartitionSpec as P

from martths_jax import checks, loop
from martths_jax import watch as watching
from martths_jax.benchmark import Benchmark
from martths_jax.control.check import check_controller
from martths_jax.control.controllers import Controller
from martths_jax.indices import IndexSums, peak_at_edge, trials_first
from martths_jax.motions import Motion
from martths_jax.plant import Plants
from martths_jax.result import Result
from martths_jax.runtime import check_runtime, compiler_options
from martths_jax.sensors import SensorNoise, unit_noise
from martths_jax.structure.modal import respond
from martths_jax.watch import Status

#: Trials a device runs side by side: enough for wide vectors, few enough to stay in its cache.
LANES = 64
#: Motions are padded to a power of two between these, longer ones to a multiple of the second, so
#: that records of all usual lengths share a program; the loop stops at a motion's end [samples].
ROOMS = (2**12, 2**16)
#: Trials a device that keep their signals, where no more are asked for than these; otherwise all.
FEW = 8
#: Ranges of the cross-correlations [samples at 1024 Hz], tried in turn until the peak is inside.
LAG_RANGES = ((6, 13), (32, 96), (256, 512))


def reference_response(benchmark: Benchmark, acceleration: jax.Array) -> jax.Array:
    """(N, 6) response of the reference structure to (N,) ground acceleration."""
    load = jnp.zeros((acceleration.shape[0], 4)).at[:, 0].set(acceleration)
    return respond(benchmark.reference, load)


def simulate(
    benchmark: Benchmark,
    controller: Controller | Sequence[Controller],
    plants: Plants,
    motion: Motion,
    noise: SensorNoise | np.ndarray | None = None,
    *,
    keep: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Result:
    """Run trials of the hybrid simulation.

    Args:
        benchmark: from ``build_benchmark``.
        controller: one for all trials, or a sequence with one a trial (same kind and counts).
        plants: a batch, from ``draw_plants`` or ``plant_from_draws``.
        motion: from ``load_motion``, at the benchmark's sampling rate.
        noise: a ``SensorNoise`` model (default: the benchmark's), or an array (N, 2) for all trials
            or (trials, N, 2) [mm].
        keep: store the signals of every sample (about 200 B a sample and trial).
        progress: called as progress(trials done, trials in all) after each block.

    Returns:
        ``Result``; pass it to ``indices``.

    Raises:
        InputError: naming every argument that cannot be used, or the rule of the protocol that the
            controller breaks; in single precision, or in a process that was forked.

    Warns:
        UserWarning: if all plants are clearly others than the one that the controller's filter was
            designed for (``plant_notice``).

    Inside ``jax.grad`` or another transformation the batch runs as one block and stays traced.
    """
    check_runtime()
    checks.check_simulation(benchmark, controller, plants, motion, noise, keep, progress)
    controller, per_trial = prepare(controller, benchmark, len(plants))
    if told := checks.plant_notice(benchmark, controller, plants):
        warnings.warn(told, stacklevel=2)
    noise = SensorNoise() if noise is None else noise
    ground = jnp.asarray(motion.acceleration)
    reference = reference_response(benchmark, ground)
    setup = Setup(benchmark, controller, per_trial, ground, reference)
    if _is_traced((benchmark, controller, plants, ground, noise)):
        sums, watch, signals = run_traced(setup, plants, noise, keep)
    else:
        sums, watch, signals = run_blocks(setup, plants, noise, keep, progress)
        reference = np.asarray(reference)
    sums, watch = trials_first((sums, watch))
    return Result(
        sums, watch, signals, reference, plants.trial, benchmark.fs, motion.name, controller.name
    )


@dataclass(frozen=True)
class Setup:
    """What all blocks of a run share.

    Attributes:
        benchmark: the benchmark.
        controller: prepared controller; leaves marked in `per_trial` end in an axis of trials.
        per_trial: for each leaf of `controller`, whether it is marked.
        ground: (N,) ground acceleration [m/s^2].
        reference: (N, 6) response of the reference structure.
    """

    benchmark: Benchmark
    controller: Controller
    per_trial: tuple[bool, ...]
    ground: jax.Array
    reference: jax.Array


def prepare(controller, benchmark: Benchmark, trials: int) -> tuple[Controller, tuple[bool, ...]]:
    """Controller ready to run, checked, and which of its leaves differ from trial to trial.

    A sequence of controllers, one a trial, becomes one controller whose differing leaves are
    stacked on a last axis.

    Raises:
        InputError: a controller breaks the protocol, or holds values for another number of trials.
    """
    if isinstance(controller, Controller):
        ready = controller.prepare(benchmark)
        return ready, check_controller(ready, benchmark.dt, trials)
    distinct = {id(c): c for c in checks.check_sequence(controller, trials)}
    ready = {key: c.prepare(benchmark) for key, c in distinct.items()}
    for one in ready.values():
        check_controller(one, benchmark.dt, 1)
    leaves, trees = zip(*(jax.tree.flatten(c) for c in ready.values()), strict=True)
    checks.check_alike(trees)
    column = {key: i for i, key in enumerate(ready)}
    order = np.array([column[id(c)] for c in controller])
    merged, marks = [], []
    for values in zip(*leaves, strict=True):
        values = [np.asarray(v) for v in values]
        own = any(not np.array_equal(values[0], v) for v in values[1:])
        merged.append(np.stack(values, axis=-1)[..., order] if own else values[0])
        marks.append(own)
    return jax.tree.unflatten(trees[0], merged), tuple(marks)


def run_traced(setup: Setup, plants, noise, keep: bool):
    """All trials as one block, nothing leaves the trace; signals come trial first."""
    samples, fs = setup.ground.shape[0], setup.benchmark.fs
    sums, watch, signals, _ = loop.run(
        setup.benchmark,
        setup.controller,
        plants.discretise(setup.benchmark.dt),
        setup.ground,
        setup.reference,
        draw_noise(noise, plants.trial, samples, fs),
        trials=len(plants),
        lags=lag_range(setup.controller.first_lag_range, fs),
        keep=len(plants) if keep else 0,
    )
    return sums, watch, jax.tree.map(lambda x: jnp.moveaxis(x, -1, 0), signals)


def run_blocks(setup: Setup, plants, noise, keep: bool, progress=None):
    """All trials in blocks over the devices; results on the host."""
    trials = len(plants)
    devices = jax.local_devices()[: max(1, -(-trials // LANES))]
    size = LANES * len(devices)
    blocks = []
    for first in range(0, trials, size):
        which = np.arange(first, min(first + size, trials))
        lanes = fill(which, size)
        samples, fs = setup.ground.shape[0], setup.benchmark.fs
        if isinstance(noise, SensorNoise):
            block_noise = draw_on(devices, noise, np.asarray(plants.trial)[lanes], samples, fs)
        else:
            block_noise = draw_noise(noise, None, samples, fs, lanes)
        blocks.append(run_block(setup, plants, block_noise, which, devices, keep))
        if progress:
            progress(int(which[-1]) + 1, trials)
    if len(blocks) == 1:
        return blocks[0]
    sums, watches, signals = zip(*blocks, strict=True)
    last = lambda *x: np.concatenate(x, axis=-1)  # noqa: E731
    return (
        jax.tree.map(last, *widen(sums)),
        jax.tree.map(last, *watches),
        jax.tree.map(lambda *x: np.concatenate(x), *signals),
    )


def fill(which: np.ndarray, size: int) -> np.ndarray:
    """Fill a block up with copies of its first trial.

    Every block has the same shape whatever the number of trials, so the same program runs and
    trial 617 has the same bits alone and among 100 000.
    """
    return np.concatenate([which, np.full(size - which.size, which[0])])


def pick(setup: Setup, which: np.ndarray) -> Controller:
    """The controller of a setup with its marked leaves at the positions `which` of their axis."""
    leaves, tree = jax.tree.flatten(setup.controller)
    return jax.tree.unflatten(
        tree,
        [
            np.asarray(x)[..., which] if own else x
            for x, own in zip(leaves, setup.per_trial, strict=True)
        ],
    )


def run_block(
    setup: Setup, plants, noise: jax.Array, which: np.ndarray, devices, keep: bool, retry=True
):
    """Run the trials `which`, with the lag range widened until it holds every delay.

    Args:
        noise: (N or more, 1 or 2, lanes or 1) sensor noise of the filled block [mm].
        which: positions of the trials in `plants`, at most ``LANES`` a device.
        devices: the devices to spread the block over.
        keep: return signals, trial first.
        retry: whether to widen the range of lags where a delay is at its end.
    """
    lanes = fill(which, LANES * len(devices))
    controller = pick(setup, lanes)
    kept = 0 if not keep else FEW if which.size <= FEW else LANES
    own_noise = noise.shape[-1] > 1
    samples = setup.ground.shape[0]
    # Signals of many trials take memory for all the room there is, so they get no more than needed.
    room = samples if kept > FEW else room_for(max(samples, noise.shape[0]))
    ground, reference, noise = (fit(x, room) for x in (setup.ground, setup.reference, noise))
    for attempt in range(controller.first_lag_range, len(LAG_RANGES)):
        lags = lag_range(attempt, setup.benchmark.fs)
        program = compiled(tuple(devices), setup.per_trial, own_noise, lags, kept)
        sums, watch, signals = program(
            setup.benchmark, controller, plants[lanes], ground, reference, noise, samples
        )
        back = lambda x: np.moveaxis(np.asarray(x)[: which.size], 0, -1)  # noqa: E731
        sums, watch = jax.tree.map(back, (sums, watch))
        lost = np.asarray(watching.status_of(watch)) >= Status.DIVERGED
        if not (retry and np.any(peak_at_edge(sums) & ~lost)):
            break
    signals = {name: _trial_first(x, samples)[: which.size] for name, x in signals.items()}
    return sums, watch, signals


def room_for(samples: int) -> int:
    """Length that a motion is padded to [samples], see ``ROOMS``."""
    least, most = ROOMS
    if samples > most:
        return -(-samples // most) * most
    return max(least, 1 << (samples - 1).bit_length())


def _trial_first(signal: jax.Array, samples: int) -> np.ndarray:
    """(devices, room, ..., kept) as (devices x kept, samples, ...)."""
    each = np.moveaxis(np.asarray(signal)[:, :samples], -1, 1)
    return each.reshape(-1, *each.shape[2:])


def fit(x: jax.Array, length: int) -> jax.Array:
    """(N, ...) cut or filled up with zeros to (length, ...)."""
    return x if x.shape[0] == length else _fit(x, length)


@partial(jax.jit, static_argnums=1)
def _fit(x: jax.Array, length: int) -> jax.Array:
    return jnp.pad(x[:length], [(0, max(0, length - x.shape[0]))] + [(0, 0)] * (x.ndim - 1))


@lru_cache(maxsize=64)
def compiled(devices: tuple, per_trial: tuple[bool, ...], own_noise: bool, lags, kept: int):
    """The jitted program of one kind of block.

    Sums and watch come with the trials first, signals (devices, room, ..., kept).
    """
    mesh = Mesh(np.array(devices), ("trials",))

    def local(benchmark, controller, plants, ground, reference, noise, samples):
        sums, watch, signals, _ = loop.run(
            benchmark,
            controller,
            plants.discretise(benchmark.dt),
            ground,
            reference,
            noise,
            trials=LANES,
            lags=lags,
            samples=samples,
            keep=kept,
        )
        first = lambda x: jnp.moveaxis(x, -1, 0)  # noqa: E731
        # Signals are too large to be turned round here.
        return *jax.tree.map(first, (sums, watch)), jax.tree.map(lambda x: x[None], signals)

    def program(benchmark, controller, plants, ground, reference, noise, samples):
        leaves, tree = jax.tree.flatten(controller)
        specs = [
            P(*[None] * (jnp.ndim(x) - 1), "trials") if own else P()
            for x, own in zip(leaves, per_trial, strict=True)
        ]
        plant_specs = jax.tree.map(lambda x: P("trials") if jnp.ndim(x) else P(), plants)
        return jax.shard_map(
            local,
            mesh=mesh,
            in_specs=(
                P(),
                jax.tree.unflatten(tree, specs),
                plant_specs,
                P(),
                P(),
                P(None, None, "trials") if own_noise else P(),
                P(),
            ),
            out_specs=P("trials"),
            check_vma=False,
        )(benchmark, controller, plants, ground, reference, noise, samples)

    return jax.jit(program, compiler_options=compiler_options())


def draw_noise(noise, trial, samples: int, fs: float, lanes=None) -> jax.Array:
    """(N, 1 or 2, T or 1) noise of a block from a model or from the user's array [mm]."""
    if isinstance(noise, SensorNoise):
        return noise.draw(jnp.asarray(trial), samples, fs)
    if noise.ndim == 2:
        return jnp.asarray(noise)[:samples, :, None]
    noise = noise if lanes is None else noise[lanes]
    return jnp.moveaxis(jnp.asarray(noise)[:, :samples], 0, -1)


def draw_on(devices, noise: SensorNoise, trial: np.ndarray, samples: int, fs: float) -> jax.Array:
    """Noise of a filled block, drawn on the devices that run it [mm].

    Args:
        devices: each draws ``LANES`` trials, so that a trial's noise has the same bits on any.
        noise: the model.
        trial: (T,) trial numbers, ``LANES`` a device.
        samples: length N.
        fs: sampling rate [Hz].

    Returns:
        (``room_for(N)``, 1 or 2, T), zeros beyond N: as ``run_block`` needs it, without a copy.
    """
    program = noise_program(tuple(devices), samples, noise.channels)
    return program(jnp.asarray(trial), noise.seed, noise.power * fs)


@lru_cache(maxsize=16)
def noise_program(devices: tuple, samples: int, channels: int):
    """The program behind ``draw_on``."""
    mesh = Mesh(np.array(devices), ("trials",))

    def draw(trial, seed, variance):
        room = room_for(samples)
        local = lambda t: fit(unit_noise(seed, t, samples, channels), room)  # noqa: E731
        return jnp.sqrt(variance) * jax.shard_map(
            local,
            mesh=mesh,
            in_specs=P("trials"),
            out_specs=P(None, None, "trials"),
            check_vma=False,
        )(trial)

    return jax.jit(draw, static_argnums=1, compiler_options=compiler_options())


def lag_range(attempt: int, fs: float) -> tuple[int, int]:
    """(lead, lag) of an attempt at a sampling rate [samples]."""
    lead, lag = LAG_RANGES[attempt]
    return max(2, round(lead * fs / 1024)), max(2, round(lag * fs / 1024))


def widen(sums: Sequence[IndexSums]) -> list[IndexSums]:
    """Bring blocks with different lag ranges to the widest one; what was not needed is -inf."""
    lead, lag = (max(s.lags[i] for s in sums) for i in (0, 1))

    def pad(s: IndexSums) -> IndexSums:
        edges = [(lead - s.lags[0], lag - s.lags[1]), (0, 0), (0, 0)]
        wide = np.pad(np.asarray(s.correlation), edges, constant_values=-np.inf)
        return replace(s, correlation=wide, lags=(lead, lag))

    return [pad(s) for s in sums]


def _is_traced(tree) -> bool:
    return any(isinstance(x, jax.core.Tracer) for x in jax.tree.leaves(tree))
