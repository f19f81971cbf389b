"""The sweep itself: batches of cells that share a program, stored cell by cell."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from martths_jax.campaign.config import StudyConfig
from martths_jax.campaign.draws import Draws
from martths_jax.campaign.engine import Outcome, choose_devices
from martths_jax.campaign.lanes import LaneEngine, Worlds
from martths_jax.campaign.memory import GB, choose_chunk, lane_bytes
from martths_jax.campaign.plan import Plan, build_controller, build_plan, motion_identity
from martths_jax.campaign.progress import Reporter, Tally, compile_seconds
from martths_jax.errors import InputError, raise_all
from martths_jax.plant import check_plants
from martths_jax.runtime import check_runtime
from martths_jax.simulation import LANES, Setup, prepare
from martths_jax.study.runner import Session, header
from martths_jax.sweep.config import SHOWN, SweepConfig, make_sweep
from martths_jax.sweep.grid import Job, job_config
from martths_jax.sweep.results import Sweep, write_results
from martths_jax.sweep.store import SweepFolder, sweep_identity
from martths_jax.text import counted
from martths_jax.watch import Status

#: Trials that are run together in every cell of a batch, so that their noise is drawn once.  The
#: same whatever is done already: which lanes share a block does not depend on interruptions.
CHUNK = 256


def run_sweep(
    axes: Mapping | Iterable | SweepConfig,
    config: StudyConfig | dict | str | Path | None = None,
    *,
    shown: Iterable[str] = SHOWN,
    reporter: Reporter | None = None,
    fresh: bool = False,
    figures: bool = True,
    allow_mixed: bool = False,
    command_line: str = "run_sweep(...)",
    **changes,
) -> Sweep:
    """Run a grid of studies, or what is missing of it, and write its results.

    Args:
        axes: names to values, as in ``{"nb": [128, 256], "lambda": "1e-8:1e-4:log9"}``, or texts
            ``NAME=VALUES``; see ``axes.SCALARS`` for the names.
        config: the study that is repeated: a ``StudyConfig``, settings by name, or a TOML file.
        shown: indices of the figures and the summary.
        reporter: is told about progress; nothing is said by default.
        fresh: start over, deleting the sweep in the folder.
        figures: draw them.
        allow_mixed: go on with results of machines that compile in another way.
        command_line: kept with the results.
        changes: settings that replace those of `config`.

    Returns:
        ``Sweep``.

    Raises:
        InputError: listing everything that cannot be used, before anything runs; or saying what is
            in the way of the folder's files; what was finished stays.
    """
    check_runtime()
    if not isinstance(axes, SweepConfig):
        axes = make_sweep(axes, config, shown=shown, **changes)
    sweep, reporter = axes, reporter or Reporter()
    base, worlds, ready = build(sweep)
    folder = Path(sweep.study.out)
    head = header(base, command_line)
    head["identity"] |= sweep_identity(sweep) | {"rates": _rates(sweep, worlds)}
    head["config"] |= sweep_identity(sweep)
    with SweepFolder.start(
        folder, head, fresh, allow_mixed=allow_mixed, notice=reporter.notice
    ) as run:
        run.keep_draws(base.draws)
        engine = make_engine(base, worlds, sweep, reporter)
        session = Session(run, engine, command_line)
        try:
            run_jobs(run, engine, sweep, worlds, ready, reporter, session)
        finally:
            reporter.end()
            session.save()
        done = write_results(run, sweep)
        if figures:
            from martths_jax.sweep.figures import draw_figures

            reporter.notice("Drawing the figures.")
            draw_figures(done, folder / "figures", sweep.shown)
        session.save()
        return done


def build(sweep: SweepConfig) -> tuple[Plan, Worlds, dict[Job, object]]:
    """Everything the cells run with.

    Returns:
        plan of the study behind the sweep; benchmarks and motions; the controller of every job.

    Raises:
        InputError: listing every controller, motion and file that cannot be used.
    """
    base = build_plan(sweep.study)
    worlds = Worlds(sweep.study, base.motions)
    problems: list[str] = []
    controllers = {}
    for batch in sweep.grid.batches():
        for job in batch:
            config = job_config(job, sweep.study)
            try:
                benchmark = worlds.benchmark(*_place(job, config))
                worlds.motions(config.fs, job.get("scale"))
                controllers[job] = build_controller(job.controller, config, benchmark).controller
            except InputError as error:
                problems.append(str(error))
    for spread in sweep.axis("spread") or ():
        try:
            draws = _draws(base.draws, spread)
            check_plants(draws.plants(np.arange(draws.trials + 1)))
        except InputError as error:
            problems.append(f"Axis `spread` at {spread:g}: {error}")
    raise_all(dict.fromkeys(problems), "The sweep cannot be run")
    return base, worlds, controllers


def _place(job: Job, config: StudyConfig) -> tuple:
    return config.fs, job.get("alpha"), job.get("p")


def _draws(draws: Draws, spread: float | None) -> Draws:
    return draws if spread is None else replace(draws, spread=spread)


def _rates(sweep: SweepConfig, worlds: Worlds) -> dict:
    """What identifies the motions at other sampling rates."""
    return {
        f"{fs:g} Hz": {m.name: motion_identity(m) for m in worlds.motions(fs, None)}
        for fs in sweep.axis("fs") or ()
    }


def make_engine(base: Plan, worlds: Worlds, sweep: SweepConfig, reporter: Reporter) -> LaneEngine:
    """Engine on as many devices as memory allows."""
    rates = sweep.axis("fs") or (base.config.fs,)
    samples = max(m.acceleration.size for fs in rates for m in worlds.motions(fs, None))
    devices = choose_devices(base.config.devices)
    channels = base.noise.channels
    count, chunk = choose_chunk(samples, channels, LANES, len(devices), base.config.memory_gb)
    engine = LaneEngine(base, devices[:count], min(chunk, CHUNK), samples)
    batches = sweep.grid.batches()
    runs = sum(map(len, batches)) * len(base.motions) * (base.trials + 1)
    reporter.notice(
        f"Seed {base.config.seed}; {counted(len(sweep.grid.places), 'cell')}, "
        f"{runs} runs on {counted(count, f'{devices[0].platform} device')}, "
        f"{counted(len(batches), 'batch', 'batches')} of cells a motion, about "
        f"{engine.chunk * lane_bytes(samples, channels) / GB:.2g} GB."
    )
    for controller, jobs in sweep.grid.jobs.items():
        if len(set(jobs)) < len(jobs):
            reporter.notice(
                f"{controller} has not all of the axes: its {len(jobs)} cells make "
                f"{counted(len(set(jobs)), 'distinct one')}, and each is run once."
            )
    for text in base.notices:
        reporter.notice(text)
    return engine


def run_jobs(run, engine: LaneEngine, sweep: SweepConfig, worlds, ready, reporter, session) -> None:
    """Run whatever is not stored yet, batch by batch of cells, chunk by chunk of trials."""
    trials, batches = run.trials + 1, sweep.grid.batches()
    motions = [m.name for m in engine.plan.motions]
    done = {
        (job, m): run.done(job.label, m, reporter.notice)
        for batch in batches for job in batch for m in motions
    }  # fmt: skip
    cells = {(c, m): Tally(0, 0) for m in motions for c in sweep.grid.jobs}
    for (job, motion), finished in done.items():
        tally = cells[job.controller, motion]
        tally.total += trials
        tally.done += int(finished.sum())
    reporter.begin(cells)
    for first in range(0, trials, engine.chunk):
        chunk = np.arange(first, min(first + engine.chunk, trials))
        for batch in batches:
            controllers = [ready[job] for job in batch]
            for motion in motions:
                left = [~done[job, motion][chunk] for job in batch]
                if any(map(np.any, left)):
                    setup = _setup(batch, controllers, worlds, motion)
                    part = Part(run, engine, setup, batch, motion, chunk, left)
                    part.run(sweep.study, reporter, session)


def _setup(batch: list[Job], controllers: list, worlds: Worlds, motion: str) -> Setup:
    """Common surroundings of a batch, with its controllers one a cell."""
    fs, scale = batch[0].get("fs", worlds.config.fs), batch[0].get("scale")
    benchmark = worlds.benchmark(fs, batch[0].get("alpha"), batch[0].get("p"))
    prepared, own = prepare(controllers, benchmark, len(batch))
    return Setup(benchmark, prepared, own, *worlds.ground(benchmark, fs, scale, motion))


class Part:
    """A batch of cells under one motion and a chunk of trials: lanes cell after cell.

    Args:
        run, engine: where results go and what runs.
        setup: the cells.
        jobs: one a cell.
        motion: its name.
        chunk: (T,) trials.
        left: for each cell, (T,) trials that are not stored yet.
    """

    def __init__(self, run, engine: LaneEngine, setup: Setup, jobs, motion, chunk, left):
        self.store, self.engine, self.setup = run, engine, setup
        self.jobs, self.motion, self.chunk, self.left = jobs, motion, chunk, left

    def run(self, study: StudyConfig, reporter: Reporter, session) -> None:
        """Run the blocks that hold something missing; store a cell when its last block is done."""
        T, size = self.chunk.size, self.engine.block
        cell = np.repeat(np.arange(len(self.jobs)), T)
        trial = np.tile(self.chunk, len(self.jobs))
        wanted = np.concatenate(self.left)
        power = np.array([job.get("noise_power", study.noise_power) for job in self.jobs])
        draws = _draws(self.engine.plan.draws, self.jobs[0].get("spread"))
        plants = draws.plants(self.chunk)
        self.engine.store.load(self.chunk)
        outcomes: dict[int, Outcome] = {}
        stored = 0
        for start in range(0, cell.size, size):
            lanes = np.arange(start, min(start + size, cell.size))
            if np.any(wanted[lanes]):
                began, compiled = time.monotonic(), compile_seconds()
                key = self.jobs[0].controller, self.motion
                reporter.working(key, compiling=start == 0)
                outcomes[start] = self.engine.run_lanes(
                    self.setup, cell[lanes], plants[lanes % T], trial[lanes], power[cell[lanes]]
                )
                news = wanted[lanes]
                failed = int(np.sum(outcomes[start].status[news] >= Status.DIVERGED))
                spent = time.monotonic() - began
                compiled = compile_seconds() - compiled
                session.about["trials"] += int(news.sum())
                reporter.advance(key, int(news.sum()), failed, spent, compiled)
            while stored < len(self.jobs) and (stored + 1) * T <= lanes[-1] + 1:
                self._write(stored, outcomes, size)
                stored += 1

    def _write(self, i: int, outcomes: dict[int, Outcome], size: int) -> None:
        left = self.left[i]
        if not left.any():
            return
        T = self.chunk.size
        lanes = i * T + np.flatnonzero(left)
        pieces = [
            outcomes[start][lanes[lanes // size == start // size] - start]
            for start in range(i * T // size * size, (i + 1) * T, size)
            if np.any(lanes // size == start // size)
        ]
        job = self.jobs[i]
        self.store.write(job.label, self.motion, self.chunk[left], Outcome.join(pieces))
