"""All checks of a controller, in turn: the same for its author and for a table of many."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from martths_jax.benchmark import Benchmark, build_benchmark
from martths_jax.campaign.config import make_config
from martths_jax.campaign.plan import build_controller
from martths_jax.checks import motion_problems
from martths_jax.conformity import batch, closed, protocol, slopes
from martths_jax.conformity.cost import cost
from martths_jax.conformity.memory import memory
from martths_jax.conformity.report import Finding, Report, in_words
from martths_jax.conformity.stand import Stand
from martths_jax.control.base import Controller
from martths_jax.errors import argument_error, check_seed, raise_all
from martths_jax.motions import BUILTIN_NAMES, Motion, load_motion
from martths_jax.published import COMPARED
from martths_jax.runtime import check_runtime

#: Seed of plants, noise and strokes.
SEED = 1
#: Motion of the whole loop.
MOTION = next(iter(BUILTIN_NAMES))
#: The controller whose cost is the unit.
BESIDE = COMPARED[0]


def _beside(stand: Stand) -> Finding:
    return cost(stand, make_stand(BESIDE, stand.benchmark, stand.motion, stand.seed))


@dataclass(frozen=True)
class Check:
    """One check.

    Attributes:
        names: of its findings; run: it.
        needs: names of findings without which it means nothing.
        loop: whether it runs the whole loop, which ``quick`` leaves out.
    """

    names: tuple[str, ...]
    run: Callable[[Stand], Finding | tuple[Finding, ...]]
    needs: tuple[str, ...] = ("structure", "outside state")
    loop: bool = False


_SOUND = ("structure", "outside state")
_CAUSAL, _APART = (*_SOUND, "causal"), (*_SOUND, "trials")
CHECKS = (
    Check(("structure",), protocol.structure, ()),
    Check(("outside state",), memory, ("structure",)),
    Check(("one trace",), protocol.one_trace),
    Check(("causal",), batch.causal),
    Check(("trials",), batch.independent),
    Check(("nan",), batch.contained, _APART),
    Check(("jit",), protocol.jit_alike, _CAUSAL),
    Check(("gradient",), slopes.gradient),
    Check(("cost",), _beside),
    Check(("causal loop",), closed.causal_loop, _CAUSAL, True),
    Check(("lost",), closed.lost, loop=True),
    Check(("volts",), closed.volts, (*_SOUND, "lost"), True),
    Check(("radius", "margin"), closed.stability, loop=True),
)


def check(
    controller: str | Controller,
    benchmark: Benchmark | None = None,
    *,
    motion: Motion | None = None,
    seed: int = SEED,
    quick: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Report:
    """Check that a controller keeps what the package promises of all.

    Args:
        controller: what names one in a study (``lqg``, ``slow=adfc{nb=2048}``,
            ``path/file.py:Class``), or an object.
        benchmark: that it is prepared for; by default ``build_benchmark()``.
        motion: of the runs with the whole loop, at the benchmark's rate; by default the first of
            the built-in ones.
        seed: of plants, noise and strokes.
        quick: leave out what runs the whole loop.
        progress: called as progress(checks done, checks in all).

    Returns:
        ``Report``, whose ``passed`` says whether no check failed.

    Raises:
        InputError: an argument that cannot be used, or a controller that cannot be made; one that
            can be made and breaks a rule is a finding.
    """
    check_runtime()
    check_seed(seed)
    benchmark = build_benchmark() if benchmark is None else benchmark
    if not isinstance(benchmark, Benchmark):
        raise argument_error(
            "benchmark", "be a Benchmark", type(benchmark).__name__, "Use build_benchmark()."
        )
    motion = load_motion(MOTION, fs=benchmark.fs) if motion is None else motion
    raise_all(motion_problems(motion, benchmark.fs))
    stand = make_stand(controller, benchmark, motion, seed)
    findings: list[Finding] = []
    for done, one in enumerate(CHECKS, 1):
        findings += _findings(one, stand, {f.name: f for f in findings}, quick)
        if progress:
            progress(done, len(CHECKS))
    return Report(stand.name, seed, motion.name, quick, tuple(findings))


def make_stand(
    controller: str | Controller, benchmark: Benchmark, motion: Motion, seed: int
) -> Stand:
    """The test stand of a controller.

    Raises:
        InputError: it cannot be made.
    """
    config = make_config(controllers=[controller])
    given = config.controllers[0]
    chosen = build_controller(given, config, benchmark)
    settings = dict(config.controller.get(given, {})) if isinstance(given, str) else {}
    settings.pop("kind", None)
    return Stand(chosen.name, chosen.controller, chosen.entry, settings, benchmark, motion, seed)


def _findings(one: Check, stand: Stand, before: dict, quick: bool) -> tuple[Finding, ...]:
    """What a check finds, or why it does not look."""
    missed = [name for name in one.needs if name in before and before[name].passed is False]
    if missed:
        told = f"Means nothing until `{missed[0]}` passes."
        return tuple(Finding(name, None, None, told) for name in one.names)
    if quick and one.loop:
        told = "Runs the whole loop, which was left out."
        return tuple(Finding(name, None, None, told) for name in one.names)
    try:
        found = one.run(stand)
    except Exception as error:  # the user's code may raise anything, and the others still count
        told = f"It ends in {in_words(error)}."
        return tuple(Finding(name, False, None, told) for name in one.names)
    return found if isinstance(found, tuple) else (found,)
