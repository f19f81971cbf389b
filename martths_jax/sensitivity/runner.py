"""A sensitivity analysis: the rows of a design, chunk by chunk of base samples."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from pathlib import Path

import numpy as np

from martths_jax.campaign.cells import Batch, Block, Campaign
from martths_jax.campaign.config import (
    StudyConfig,
    make_config,
    read_toml,
    unknown_names,
    with_usual,
)
from martths_jax.campaign.lanes import LaneEngine
from martths_jax.campaign.plan import Plan, build_plan, study_problem
from martths_jax.campaign.progress import Reporter, Tally
from martths_jax.campaign.run import run_campaign
from martths_jax.errors import argument_error, raise_all
from martths_jax.indices import choose
from martths_jax.indices.table import shown_of
from martths_jax.published import PROPOSED
from martths_jax.runtime import check_runtime
from martths_jax.sensitivity.design import Design, is_power_of_two, make_design, most_samples
from martths_jax.sensitivity.results import Sensitivity, write_results
from martths_jax.sensitivity.store import ROWS, SensitivityFolder
from martths_jax.sweep.config import SHOWN
from martths_jax.text import counted

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
    return run_campaign(
        Rows(plan, design, shown if figures else ()), reporter=reporter, fresh=fresh,
        allow_mixed=allow_mixed, command_line=command_line,
    )  # fmt: skip


class Rows(Campaign):
    """The rows of a design for each controller; those of all motions are stored together.

    Args:
        plan: of the study behind it.
        design: the rows.
        shown: indices of the figures; none: no figures.
    """

    folder = SensitivityFolder

    def __init__(self, plan: Plan, design: Design, shown: tuple[str, ...] = ()):
        super().__init__(plan)
        self.design, self.shown = design, shown
        self.motion = design.motions(len(plan.motions))

    def header(self, command_line):
        head = super().header(command_line) | {"trials": self.design.rows - 1}
        head["identity"] |= {"factors": list(self.design.factors)}
        return head

    @property
    def extent(self):
        d, rows = len(self.design.factors), self.design.rows
        return (
            f"N = {self.design.samples} base samples x (d + 2) = {d + 2} rows = {rows} runs of "
            f"{counted(len(self.plan.controllers), 'controller')} each"
        )

    def pace(self, engine):
        return f"in chunks of {counted(engine.chunk, 'base sample')}"

    def engine_on(self, devices, lanes):
        return LaneEngine(self.plan, devices, max(1, min(CHUNK, lanes // 2)), self.samples)

    def noise_lanes(self, engine):
        return 2 * engine.chunk  # each base sample sees two realisations

    def rows_of(self, engine):
        return self.design.unit.shape[1] * engine.chunk

    def batches(self):
        return [OneController(self, controller) for controller in self.plan.controllers]

    def tallies(self, asked, left):
        found = {}
        for i, motion in enumerate(self.plan.motions):
            mine = asked & (self.motion == i)
            for controller in self.plan.controllers:
                waiting = left[controller, ROWS] & mine
                done = int(mine.sum() - waiting.sum())
                found[controller, motion.name] = Tally(int(mine.sum()), done)
        return found

    def finish(self, run, engine, reporter):
        done = write_results(run, self.design, self.plan)
        for text in done.warnings:
            reporter.notice(text)
        if self.shown:
            from martths_jax.sensitivity.figures import draw_figures

            draw_figures(done, run.path / "figures", self.shown)
        return done


class OneController(Batch):
    """A controller under all rows: lanes in the order of the design, blocks motion by motion."""

    def __init__(self, campaign: Rows, controller: str):
        self.campaign, self.controller = campaign, controller
        self.cells = ((controller, ROWS),)

    def blocks(self, engine, chunk):
        campaign, config = self.campaign, self.campaign.plan.config
        streams = campaign.design.streams()
        engine.store.load(streams[chunk])
        for i, motion in enumerate(campaign.plan.motions):
            mine = np.flatnonzero(campaign.motion[chunk] == i)
            for start in range(0, mine.size, engine.block):
                lanes = mine[start : start + engine.block]
                rows = chunk[lanes]
                run = partial(
                    engine.run_lanes,
                    engine.setup(self.controller, motion.name),
                    np.zeros(rows.size, int),
                    campaign.design.plants(rows, config.spread),
                    streams[rows],
                    np.full(rows.size, config.noise_power),
                )
                yield Block((self.controller, motion.name), lanes, run)


def build(config, shown: Iterable[str], changes: dict) -> tuple[Plan, Design, tuple[str, ...]]:
    """Everything the rows run with, built and checked; and what is shown."""
    if isinstance(config, (str, Path)):
        config = read_toml(Path(config))
    if not isinstance(config, StudyConfig):
        config = with_usual(dict(config or {}) | changes, DEFAULTS)
    study = make_config(config, **changes)
    names = [index.name for index in choose(study.indices, study_problem(study).layout)]
    shown = shown_of(shown, SHOWN, names)
    problems = unknown_names([n for n in shown if n not in names], names, "Index")
    if not is_power_of_two(study.trials):
        near = 2 ** max(1, round(np.log2(max(study.trials, 2))))
        problems.append(
            f"Argument `trials` must be a power of two, which Sobol' points are balanced at, but "
            f"got {study.trials}; {near} is the nearest."
        )
    elif study.trials > (most := most_samples(study_problem(study))):
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
    design = make_design(study.trials, len(plan.motions), study.seed, plan.problem)
    plan.problem.check(design.plants(np.arange(design.rows), study.spread))
    return plan, design, shown
