"""A sweep: batches of cells that share a program, each stored by itself."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from martths_jax.campaign.cells import Batch, Block, Campaign
from martths_jax.campaign.config import StudyConfig
from martths_jax.campaign.draws import Draws
from martths_jax.campaign.lanes import LaneEngine, Worlds
from martths_jax.campaign.plan import Plan, build_controller, build_plan, motion_identity
from martths_jax.campaign.progress import Reporter
from martths_jax.campaign.run import run_campaign
from martths_jax.errors import InputError, raise_all
from martths_jax.runtime import check_runtime
from martths_jax.simulation import Setup, prepare
from martths_jax.sweep.config import SHOWN, SweepConfig, make_sweep
from martths_jax.sweep.grid import Job, job_config
from martths_jax.sweep.results import Sweep, write_results
from martths_jax.sweep.store import SweepFolder, sweep_identity
from martths_jax.text import counted

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
        axes: names to values, as in ``{"nb": [128, 256], "pull": "1e-8:1e-4:log9"}``, or texts
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
    return run_campaign(
        GridOfStudies(axes, figures), reporter=reporter or Reporter(), fresh=fresh,
        allow_mixed=allow_mixed, command_line=command_line,
    )  # fmt: skip


class GridOfStudies(Campaign):
    """The cells of a sweep: each controller's jobs under every motion.

    Args:
        sweep: what is swept.
        figures: draw them.
    """

    folder = SweepFolder

    def __init__(self, sweep: SweepConfig, figures: bool = True):
        base, self.worlds, self.ready = build(sweep)
        super().__init__(base)
        self.sweep, self.figures = sweep, figures
        self.jobs = {job.label: job for batch in sweep.grid.batches() for job in batch}

    @property
    def keys(self):
        return [(c, m.name) for m in self.plan.motions for c in self.sweep.grid.jobs]

    def key_of(self, cell):
        return self.jobs[cell[0]].controller, cell[1]

    @property
    def samples(self):
        rates = self.sweep.axis("fs") or (self.plan.config.fs,)
        return max(m.acceleration.size for fs in rates for m in self.worlds.motions(fs, None))

    @property
    def notices(self):
        return [
            f"{controller} has not all of the axes: its {len(jobs)} cells make "
            f"{counted(len(set(jobs)), 'distinct one')}, and each is run once."
            for controller, jobs in self.sweep.grid.jobs.items()
            if len(set(jobs)) < len(jobs)
        ] + super().notices

    def header(self, command_line):
        head = super().header(command_line)
        axes = sweep_identity(self.sweep)
        head["identity"] |= axes | {"rates": _rates(self.sweep, self.worlds)}
        head["config"] |= axes
        return head

    @property
    def extent(self):
        runs = len(self.jobs) * len(self.plan.motions) * (self.plan.trials + 1)
        return f"{counted(len(self.sweep.grid.places), 'cell')}, {runs} runs"

    def pace(self, engine):
        batches = self.sweep.grid.batches()
        return f"{counted(len(batches), 'batch', 'batches')} of cells a motion"

    def engine_on(self, devices, lanes):
        return LaneEngine(self.plan, devices, min(lanes, CHUNK), self.samples)

    def batches(self):
        return [
            CellsBeside(self, jobs, motion.name)
            for jobs in self.sweep.grid.batches()
            for motion in self.plan.motions
        ]

    def finish(self, run, engine, reporter):
        done = write_results(run, self.sweep)
        if self.figures:
            from martths_jax.sweep.figures import draw_figures

            reporter.notice("Drawing the figures.")
            draw_figures(done, run.path / "figures", self.sweep.shown)
        return done


class CellsBeside(Batch):
    """Jobs that share a program, under one motion: lanes cell after cell."""

    def __init__(self, campaign: GridOfStudies, jobs: list[Job], motion: str):
        self.campaign, self.jobs, self.motion = campaign, jobs, motion
        self.cells = tuple((job.label, motion) for job in jobs)

    def setup(self) -> Setup:
        """Common surroundings of the cells, with their controllers one a cell."""
        worlds, job = self.campaign.worlds, self.jobs[0]
        fs, scale = job.get("fs", worlds.config.fs), job.get("scale")
        benchmark = worlds.benchmark(fs, job.get("alpha"), job.get("arm"))
        controllers = [self.campaign.ready[job] for job in self.jobs]
        prepared, own = prepare(controllers, benchmark, len(self.jobs))
        ground = worlds.ground(benchmark, fs, scale, self.motion)
        return Setup(benchmark, prepared, own, *ground)

    def blocks(self, engine, chunk):
        study, job = self.campaign.sweep.study, self.jobs[0]
        plants = _draws(self.campaign.plan.draws, job.get("spread")).plants(chunk)
        power = np.array([j.get("noise_power", study.noise_power) for j in self.jobs])
        setup = self.setup()
        engine.store.load(chunk)
        for start in range(0, len(self.jobs) * chunk.size, engine.block):
            lanes = np.arange(start, min(start + engine.block, len(self.jobs) * chunk.size))
            cell, row = np.divmod(lanes, chunk.size)
            run = partial(engine.run_lanes, setup, cell, plants[row], chunk[row], power[cell])
            yield Block((job.controller, self.motion), lanes, run)


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
            draws.problem.check(draws.plants(np.arange(draws.trials + 1)))
        except InputError as error:
            problems.append(f"Axis `spread` at {spread:g}: {error}")
    raise_all(dict.fromkeys(problems), "The sweep cannot be run")
    return base, worlds, controllers


def _place(job: Job, config: StudyConfig) -> tuple:
    return config.fs, job.get("alpha"), job.get("arm")


def _draws(draws: Draws, spread: float | None) -> Draws:
    return draws if spread is None else replace(draws, spread=spread)


def _rates(sweep: SweepConfig, worlds: Worlds) -> dict:
    """What identifies the motions at other sampling rates."""
    return {
        f"{fs:g} Hz": {m.name: motion_identity(m) for m in worlds.motions(fs, None)}
        for fs in sweep.axis("fs") or ()
    }
