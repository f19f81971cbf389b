"""The front door: check what came in, have it run, hand it back."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Sequence

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax import checks
from martths_jax.benchmark import Benchmark
from martths_jax.blocks import (
    FEW,
    LANES,
    Ran,
    Setup,
    draw_noise,
    draw_on,
    fill,
    pick,
    room_for,
    run_block,
    run_blocks,
    run_traced,
)
from martths_jax.control.check import check_controller
from martths_jax.control.controllers import Controller
from martths_jax.indices import DEFAULT, Index, choose, trials_first
from martths_jax.motions import Motion
from martths_jax.plant import Plants
from martths_jax.reference import reference_response
from martths_jax.result import Result
from martths_jax.runtime import check_runtime
from martths_jax.sensors import SensorNoise

__all__ = [
    "FEW",
    "LANES",
    "Ran",
    "Setup",
    "draw_noise",
    "draw_on",
    "fill",
    "pick",
    "prepare",
    "reference_response",
    "room_for",
    "run_block",
    "simulate",
]


def simulate(
    benchmark: Benchmark,
    controller: Controller | Sequence[Controller],
    plants: Plants,
    motion: Motion,
    noise: SensorNoise | np.ndarray | None = None,
    *,
    keep: bool = False,
    progress: Callable[[int, int], None] | None = None,
    indices: Iterable[str | Index] | str | Index = DEFAULT,
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
        indices: which indices it is for: names, groups and ``Index`` objects, see
            ``martths_jax.indices.choose``; the benchmark's 24 if left out.

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
    chosen = choose(indices, benchmark.layout)
    controller, per_trial = prepare(controller, benchmark, len(plants))
    if told := checks.plant_notice(benchmark, controller, plants):
        warnings.warn(told, stacklevel=2)
    noise = SensorNoise() if noise is None else noise
    ground = jnp.asarray(motion.acceleration)
    reference = reference_response(benchmark, ground)
    setup = Setup(benchmark, controller, per_trial, ground, reference)
    if _is_traced((benchmark, controller, plants, ground, noise)):
        ran = run_traced(setup, plants, noise, keep, chosen)
    else:
        ran = run_blocks(setup, plants, noise, keep, progress, chosen)
        reference = np.asarray(reference)
    sums, watch, counts = trials_first((ran.sums, ran.watch, ran.counts))
    labels = {signal.name: signal.label or signal.name for signal in controller.signals}
    return Result(
        sums, watch, counts, ran.signals, reference, plants.trial, benchmark.fs, motion.name,
        controller.name, benchmark.layout, tuple(labels[name] for name in counts),
    )  # fmt: skip


def prepare(controller, benchmark: Benchmark, trials: int) -> tuple[Controller, tuple[bool, ...]]:
    """Controller ready to run, checked, and which of its leaves differ from trial to trial.

    A sequence of controllers, one a trial, becomes one controller whose differing leaves are
    stacked on a last axis.

    Raises:
        InputError: a controller breaks the protocol, or holds values for another number of trials.
    """
    if isinstance(controller, Controller):
        ready = controller.prepare(benchmark)
        return ready, check_controller(ready, benchmark, trials)
    distinct = {id(c): c for c in checks.check_sequence(controller, trials)}
    ready = {key: c.prepare(benchmark) for key, c in distinct.items()}
    for one in ready.values():
        check_controller(one, benchmark, 1)
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


def _is_traced(tree) -> bool:
    return any(isinstance(x, jax.core.Tracer) for x in jax.tree.leaves(tree))
