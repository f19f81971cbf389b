"""The analysis itself: the rows of the design in blocks, stored as they finish."""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from martths_jax.campaign.config import StudyConfig, make_config, read_toml, unknown_names
from martths_jax.campaign.engine import Outcome, choose_devices
from martths_jax.campaign.lanes import LaneEngine
from martths_jax.campaign.memory import GB, choose_chunk, lane_bytes
from martths_jax.campaign.plan import Plan, build_plan
from martths_jax.campaign.progress import Reporter, Tally, compile_seconds
from martths_jax.errors import argument_error, raise_all
from martths_jax.indices import choose
from martths_jax.indices.table import shown_of
from martths_jax.plant import check_plants
from martths_jax.published import PROPOSED
from martths_jax.runtime import check_runtime
from martths_jax.sensitivity.design import Design, is_power_of_two, make_design, most_samples
from martths_jax.sensitivity.results import Sensitivity, write_results
from martths_jax.sensitivity.store import ROWS, SensitivityFolder
from martths_jax.simulation import LANES, Setup
from martths_jax.study.runner import Session, header
from martths_jax.sweep.config import SHOWN
from martths_jax.text import counted
from martths_jax.watch import Status

#: What an analysis has where a study has another default.
DEFAULTS = {"trials": 256, "controllers": PROPOSED, "out": "sensitivity", "signals": False}
#: Base samples that run together; each needs two noise realisations.
CHUNK = 128


def run_sensitivity(
    config: StudyConfig | dict | str | Path | None = None,
    *,
    shown: Iterable[str] = SHOWN,
    reporter: Reporter | None = None,
    fresh: bool = False,
    figures: bool = True,
    allow_mixed: bool = False,
    command_line: str = "run_sensitivity(...)",
    **changes,
) -> Sensitivity:
    """Sobol' indices of the 24 indices against plant, noise and motion.

    Args:
        config: a ``StudyConfig``, settings by name, or a TOML file; its ``trials`` are the base
            samples N, a power of two, and every controller runs N (d + 2) times for d factors: the
            nine plant parameters, the noise and, if there are several motions, the motion.
        shown: indices of the figure.
        reporter: is told about progress; nothing is said by default.
        fresh: start over, deleting the analysis in the folder.
        figures: draw the tornado charts.
        allow_mixed: go on with results of machines that compile in another way.
        command_line: kept with the results.
        changes: settings that replace those of `config`.

    Returns:
        ``Sensitivity``.

    Raises:
        InputError: listing every setting that cannot be used, or saying what is in the way of the
            folder's files; what was finished stays.
    """
    check_runtime()
    reporter = reporter or Reporter()
    plan, design, shown = build(config, shown, changes)
    head = header(plan, command_line) | {"trials": design.rows - 1}
    head["identity"] |= {"factors": list(design.factors)}
    with SensitivityFolder.start(
        Path(plan.config.out), head, fresh, allow_mixed=allow_mixed, notice=reporter.notice
    ) as run:
        engine = make_engine(plan, design, reporter)
        session = Session(run, engine, command_line)
        try:
            run_rows(run, engine, design, reporter, session)
        finally:
            reporter.end()
            session.save()
        done = write_results(run, design, plan)
        for text in done.warnings:
            reporter.notice(text)
        if figures:
            from martths_jax.sensitivity.figures import draw_figures

            draw_figures(done, run.path / "figures", shown)
        session.save()
        return done


def build(config, shown: Iterable[str], changes: dict) -> tuple[Plan, Design, tuple[str, ...]]:
    """Everything the rows run with, built and checked; and what is shown."""
    if isinstance(config, (str, Path)):
        config = read_toml(Path(config))
    if not isinstance(config, StudyConfig):
        config = DEFAULTS | dict(config or {})
    study = make_config(config, **changes)
    names = [index.name for index in choose(study.indices)]
    shown = shown_of(shown, SHOWN, names)
    problems = unknown_names([n for n in shown if n not in names], names, "Index")
    if not is_power_of_two(study.trials):
        near = 2 ** max(1, round(np.log2(max(study.trials, 2))))
        problems.append(
            f"Argument `trials` must be a power of two, which Sobol' points are balanced at, but "
            f"got {study.trials}; {near} is the nearest."
        )
    elif study.trials > (most := most_samples()):
        problems.append(str(argument_error(
            "trials", f"be at most {most}, whose design fits into memory", study.trials
        )))  # fmt: skip
    if study.plants is not None or study.draws != "independent":
        problems.append(
            "Arguments `plants` and `draws` have no place here: the design draws the plants."
        )
    if study.spread == 0:
        problems.append("Argument `spread` must be above zero: no plant parameter would vary.")
    if study.noise_power == 0:
        problems.append("Argument `noise_power` must be above zero: the noise would not vary.")
    raise_all(problems, "The analysis cannot be run")
    plan = build_plan(study)
    design = make_design(study.trials, len(plan.motions), study.seed)
    check_plants(design.plants(np.arange(design.rows), study.spread))
    return plan, design, shown


def make_engine(plan: Plan, design: Design, reporter: Reporter) -> LaneEngine:
    """Engine on as many devices as memory allows; says how much there is to run."""
    samples = max(m.acceleration.size for m in plan.motions)
    devices = choose_devices(plan.config.devices)
    count, lanes = choose_chunk(
        samples, plan.noise.channels, LANES, len(devices), plan.config.memory_gb
    )
    chunk = max(1, min(CHUNK, lanes // 2))
    engine = LaneEngine(plan, devices[:count], chunk, samples)
    d = len(design.factors)
    reporter.notice(
        f"Seed {plan.config.seed}; N = {design.samples} base samples x (d + 2) = {d + 2} rows = "
        f"{design.rows} runs of {counted(len(plan.controllers), 'controller')} each on "
        f"{counted(count, f'{devices[0].platform} device')}, about "
        f"{2 * chunk * lane_bytes(samples, plan.noise.channels) / GB:.2g} GB."
    )
    for text in plan.notices:
        reporter.notice(text)
    return engine


def run_rows(run, engine: LaneEngine, design: Design, reporter: Reporter, session) -> None:
    """Run whatever rows are not stored yet: chunks of base samples, motion by motion."""
    plan = engine.plan
    motions = [m.name for m in plan.motions]
    motion, streams = design.motions(len(motions)), design.streams()
    done = {c: run.done(c, ROWS, reporter.notice) for c in plan.controllers}
    reporter.begin({
        (c, name): Tally(int(np.sum(motion == i)), int(np.sum(done[c] & (motion == i))))
        for i, name in enumerate(motions) for c in plan.controllers
    })  # fmt: skip
    each = design.unit.shape[1] * engine.chunk
    for first in range(0, design.rows, each):
        rows = np.arange(first, min(first + each, design.rows))
        for controller in plan.controllers:
            left = ~done[controller][rows]
            if not left.any():
                continue
            engine.store.load(streams[rows])
            parts, order = [], []
            for i, name in enumerate(motions):
                mine = rows[motion[rows] == i]
                if mine.size:
                    setup = engine.setup(controller, name)
                    parts += _run_motion(
                        engine, setup, design, mine, streams, (controller, name), reporter, session
                    )
                    order.append(mine)
            outcome = Outcome.join(parts)[np.argsort(np.concatenate(order))]
            run.write(controller, ROWS, rows[left], outcome[left])


def _run_motion(
    engine: LaneEngine, setup: Setup, design, rows, streams, key, reporter, session
) -> list[Outcome]:
    """Outcomes of rows under one motion, block after block."""
    config, outcomes = engine.plan.config, []
    for start in range(0, rows.size, engine.block):
        mine = rows[start : start + engine.block]
        began, compiled = time.monotonic(), compile_seconds()
        reporter.working(key, compiling=start == 0)
        outcome = engine.run_lanes(
            setup,
            np.zeros(mine.size, int),
            design.plants(mine, config.spread),
            streams[mine],
            np.full(mine.size, config.noise_power),
        )
        outcomes.append(outcome)
        session.about["trials"] += int(mine.size)
        failed = int(np.sum(outcome.status >= Status.DIVERGED))
        reporter.advance(
            key, mine.size, failed, time.monotonic() - began, compile_seconds() - compiled
        )
    return outcomes
