"""The works behind ``simulate``: trials in blocks over the devices, and the noise they see."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh
from jax.sharding import PartitionSpec as P

from martths_jax import loop
from martths_jax import watch as watching
from martths_jax.benchmark import Benchmark
from martths_jax.control.controllers import Controller
from martths_jax.indices import BENCHMARK, Index, IndexSums, join_sums, observers_of
from martths_jax.indices.delay import ATTEMPTS
from martths_jax.layout import Layout
from martths_jax.observers import Counts, Keep, Observer
from martths_jax.runtime import compiler_options
from martths_jax.sensors import SensorNoise, unit_noise
from martths_jax.signals import SIGNALS
from martths_jax.watch import Status

#: Trials a device runs side by side: enough for wide vectors, few enough to stay in its cache.
LANES = 64
#: Motions are padded to a power of two between these, longer ones to a multiple of the second, so
#: that records of all usual lengths share a program; the loop stops at a motion's end [samples].
ROOMS = (2**12, 2**16)
#: Trials a device that keep their signals, where no more are asked for than these; otherwise all.
FEW = 8
#: Signals that are not kept.
LEFT_OUT = tuple(signal.name for signal in SIGNALS if not signal.stored)


@dataclass(frozen=True)
class Setup:
    """What all blocks of a run share.

    Attributes:
        benchmark: the benchmark.
        controller: prepared controller; leaves marked in `per_trial` end in an axis of trials.
        per_trial: for each leaf of `controller`, whether it is marked.
        ground: (N,) ground acceleration [m/s^2].
        reference: (N, o) response of the reference structure.
    """

    benchmark: Benchmark
    controller: Controller
    per_trial: tuple[bool, ...]
    ground: jax.Array
    reference: jax.Array


class Ran(NamedTuple):
    """What a run of some trials gave, trials on the last axis, but first in the signals."""

    sums: IndexSums
    watch: watching.Watch
    counts: dict[str, Any]
    signals: dict[str, Any]


def observers(
    layout: Layout, controller: Controller, kinds: tuple[Observer, ...], keep: int
) -> tuple[Observer, ...]:
    """What looks at a run: the indices' observers, watch, the controller's counts, kept signals."""
    return (*kinds, watching.Watcher(layout), Counts.of(controller), Keep(keep, LEFT_OUT))


def ran(indices, kinds, states, emitted) -> Ran:
    """What the states and the emissions of ``observers`` are; signals are (N, ..., kept)."""
    *sums, watch, counts, _ = states
    return Ran(IndexSums(tuple(sums), kinds, indices), watch, counts, emitted[-1])


def run_traced(setup: Setup, plants, noise, keep: bool, indices: tuple[Index, ...]) -> Ran:
    """All trials as one block, nothing leaves the trace."""
    samples, fs = setup.ground.shape[0], setup.benchmark.fs
    kinds = observers_of(indices, fs, setup.controller.first_lag_range)
    states, emitted = loop.run(
        setup.benchmark,
        setup.controller,
        plants.discretise(setup.benchmark.dt),
        setup.ground,
        setup.reference,
        draw_noise(noise, plants.trial, samples, fs),
        trials=len(plants),
        observers=observers(
            setup.benchmark.layout, setup.controller, kinds, len(plants) if keep else 0
        ),
    )
    found = ran(indices, kinds, states, emitted)
    return found._replace(signals=jax.tree.map(lambda x: jnp.moveaxis(x, -1, 0), found.signals))


def run_blocks(
    setup: Setup, plants, noise, keep: bool, progress, indices: tuple[Index, ...]
) -> Ran:
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
        blocks.append(run_block(setup, plants, block_noise, which, devices, keep, indices=indices))
        if progress:
            progress(int(which[-1]) + 1, trials)
    if len(blocks) == 1:
        return blocks[0]
    sums, watches, counts, signals = zip(*blocks, strict=True)
    last = lambda *x: np.concatenate(x, axis=-1)  # noqa: E731
    return Ran(
        join_sums(sums),
        jax.tree.map(last, *watches),
        jax.tree.map(last, *counts),
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
    setup: Setup,
    plants,
    noise: jax.Array,
    which: np.ndarray,
    devices,
    keep: bool,
    retry: bool = True,
    indices: tuple[Index, ...] = BENCHMARK,
) -> Ran:
    """Run the trials `which`, with the lag range widened until it holds every delay.

    Args:
        noise: (N or more, 1 or 2, lanes or 1) sensor noise of the filled block [mm].
        which: positions of the trials in `plants`, at most ``LANES`` a device.
        devices: the devices to spread the block over.
        keep: return signals, trial first.
        retry: whether to widen the range of lags where a delay is at its end.
        indices: what the run is for.
    """
    lanes = fill(which, LANES * len(devices))
    controller = pick(setup, lanes)
    kept = 0 if not keep else FEW if which.size <= FEW else LANES
    own_noise = noise.shape[-1] > 1
    samples = setup.ground.shape[0]
    # Signals of many trials take memory for all the room there is, so they get no more than needed.
    room = samples if kept > FEW else room_for(max(samples, noise.shape[0]))
    ground, reference, noise = (fit(x, room) for x in (setup.ground, setup.reference, noise))
    for attempt in range(controller.first_lag_range, ATTEMPTS):
        kinds = observers_of(indices, setup.benchmark.fs, attempt)
        program = compiled(tuple(devices), setup.per_trial, own_noise, indices, kinds, kept)
        found = program(
            setup.benchmark, controller, plants[lanes], ground, reference, noise, samples
        )
        back = lambda x: np.moveaxis(np.asarray(x)[: which.size], 0, -1)  # noqa: E731
        sums, watch, counts = jax.tree.map(back, found[:3])
        lost = np.asarray(watching.status_of(watch)) >= Status.DIVERGED
        if not (retry and np.any(sums.short & ~lost)):
            break
    signals = {name: _trial_first(x, samples)[: which.size] for name, x in found.signals.items()}
    return Ran(sums, watch, counts, signals)


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
def compiled(
    devices: tuple,
    per_trial: tuple[bool, ...],
    own_noise: bool,
    indices: tuple[Index, ...],
    kinds: tuple[Observer, ...],
    kept: int,
):
    """The jitted program of one kind of block.

    Sums, watch and counts come with the trials first, signals (devices, room, ..., kept).
    """
    mesh = Mesh(np.array(devices), ("trials",))

    def local(benchmark, controller, plants, ground, reference, noise, samples):
        states, emitted = loop.run(
            benchmark,
            controller,
            plants.discretise(benchmark.dt),
            ground,
            reference,
            noise,
            trials=LANES,
            observers=observers(benchmark.layout, controller, kinds, kept),
            samples=samples,
        )
        found = ran(indices, kinds, states, emitted)
        first = lambda x: jnp.moveaxis(x, -1, 0)  # noqa: E731
        # Signals are too large to be turned round here.
        return Ran(*jax.tree.map(first, found[:3]), jax.tree.map(lambda x: x[None], found.signals))

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
    return program(jnp.asarray(trial), noise.seed, noise.variances(fs))


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
