"""From axes to runs: every cell of the grid, what it sets, and which cells can share a batch.

A cell is one point of the grid.  A *job* is what a cell runs of one controller: cells that differ
only in settings a controller does not have (LQG has no buffer) are the same job, run once.  Jobs
that differ only in traced scalars (No, lambda, q, noise power) stand side by side in one batch.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np

from martths_jax.campaign.config import StudyConfig
from martths_jax.campaign.plan import KINDS, defaults
from martths_jax.sweep.axes import OVERLAPS, Axis

#: Settings of a job that shape a batch: what must be the same for all its lanes.
SHARED = ("fs", "alpha", "p", "scale", "spread", "nb")
#: Settings that may differ from lane to lane.
LANE = ("no", "pull", "q", "noise_power")


@dataclass(frozen=True)
class Job:
    """What runs once: a controller with its settings in its surroundings.

    Attributes:
        controller: its name.
        settings: (name, value) of everything an axis sets and this controller feels, sorted.
    """

    controller: str
    settings: tuple[tuple[str, float], ...]

    def get(self, name: str, default=None):
        """A setting, or `default` where no axis sets it."""
        return dict(self.settings).get(name, default)

    @property
    def shared(self) -> tuple:
        """What all jobs of a batch have in common."""
        return self.controller, tuple((k, v) for k, v in self.settings if k in SHARED)

    @property
    def label(self) -> str:
        """Name of its folder."""
        return " ".join([self.controller, *(f"{k}={v!r}" for k, v in self.settings)])


@dataclass(frozen=True)
class Grid:
    """All cells of a sweep.

    Attributes:
        axes: in the order of the results.
        jobs: of each controller, (cells,) jobs in the order of the cells, last axis fastest.
    """

    axes: tuple[Axis, ...]
    jobs: dict[str, tuple[Job, ...]]

    @property
    def shape(self) -> tuple[int, ...]:
        """Values of each axis."""
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def places(self) -> list[tuple[float, ...]]:
        """(cells,) values of the axes in every cell."""
        return list(itertools.product(*(axis.values for axis in self.axes)))

    def batches(self) -> list[list[Job]]:
        """Distinct jobs, those that share a batch together."""
        found: dict[tuple, dict[Job, None]] = {}
        for jobs in self.jobs.values():
            for job in jobs:
                found.setdefault(job.shared, {})[job] = None
        return [list(batch) for batch in found.values()]


def kind_of(name: str, config: StudyConfig) -> str:
    """Kind of a controller named in a configuration."""
    return config.controller.get(name, {}).get("kind", name)


def settings_of(name: str, config: StudyConfig) -> dict:
    """Settings of a controller: those of its table, else the defaults of its kind."""
    table = config.controller.get(name, {})
    return defaults(kind_of(name, config)) | {k: v for k, v in table.items() if k != "kind"}


def overlap(way: str, value: float, nb: int, fs: float) -> int:
    """Overlap No [samples] from the value of one of ``OVERLAPS``; may be impossible.

    A fraction of 1 is every sample, No = Nb - 1.
    """
    if way == "no":
        return int(value)
    if way == "hop":
        return nb - int(value)
    if way == "fb":
        return nb - math.floor(fs / value + 0.5)
    return min(math.floor(value * nb + 0.5), nb - 1)


def build_grid(axes: tuple[Axis, ...], config: StudyConfig) -> tuple[Grid, list[str]]:
    """The grid, and sentences about every combination that makes no sense."""
    problems: list[str] = []
    jobs: dict[str, tuple[Job, ...]] = {}
    names = [axis.name for axis in axes]
    felt: set[str] = set()
    for controller in config.controllers:
        if kind_of(controller, config) not in KINDS:
            continue  # build_plan says so
        own = settings_of(controller, config)
        cells = []
        for place in itertools.product(*(axis.values for axis in axes)):
            values = dict(zip(names, place, strict=True))
            cells.append(_job(controller, own, values, config, problems))
        jobs[controller] = tuple(cells)
        felt |= {
            a.name for a in axes if a.scalar.setting in own or a.scalar.setting not in _CONTROLLERS
        }
        problems += _rounded_alike(axes, own, config)
    for name in names:
        if jobs and name not in felt:
            problems.append(
                f"Axis `{name}` moves nothing: no controller of {', '.join(jobs)} has it."
            )
    return Grid(axes, jobs), list(dict.fromkeys(problems))


_CONTROLLERS = {"nb", "no", "pull", "q"}


def _job(controller: str, own: dict, values: dict, config: StudyConfig, problems: list) -> Job:
    """What a controller runs in a cell; adds a sentence if it cannot be."""
    found: dict[str, float] = {}
    for name, value in values.items():
        if name in OVERLAPS or name == "nb":
            continue
        setting = {"lambda": "pull"}.get(name, name)
        if setting not in _CONTROLLERS or setting in own:
            found[setting] = value
    way = next((w for w in OVERLAPS if w in values), None)
    if "nb" in own and ("nb" in values or way):
        nb, fs = int(values.get("nb", own["nb"])), values.get("fs", config.fs)
        if way:
            no = overlap(way, values[way], nb, fs)
        else:  # the controller's own; every sample stays every sample
            no = nb - 1 if own["no"] == own["nb"] - 1 else own["no"]
        if not 0 <= no <= nb - 1:
            given = f"{way} = {values[way]:g}" if way else f"no = {no} of {controller}"
            rate = f" at fs = {fs:g} Hz" if way == "fb" else ""
            problems.append(
                f"Nb = {nb} with {given}{rate} gives No = {no} (hop {nb - no}); "
                f"No must lie in 0 ... {nb - 1}."
            )
        found |= {"nb": nb, "no": no}
    return Job(controller, tuple(sorted(found.items())))


def _rounded_alike(axes, own: dict, config: StudyConfig) -> list[str]:
    """Sentences about overlaps that are the same number of samples."""
    by_name = {axis.name: axis.values for axis in axes}
    way = next((w for w in OVERLAPS if w in by_name), None)
    if way is None or "nb" not in own:
        return []
    problems = []
    for nb, fs in itertools.product(
        by_name.get("nb", (own["nb"],)), by_name.get("fs", [config.fs])
    ):
        where: dict[int, list[float]] = {}
        for value in by_name[way]:
            where.setdefault(overlap(way, value, int(nb), fs), []).append(value)
        problems += [
            f"Nb = {nb}: {way} = {' and '.join(f'{v:g}' for v in values)} are all No = {no}, "
            "a duplicate cell."
            for no, values in where.items()
            if len(values) > 1
        ]
    return problems


def job_config(job: Job, config: StudyConfig) -> StudyConfig:
    """The study configuration whose controller, motions, plants and noise a job has.

    An axis changes its own scalar and nothing else: where lambda moves, the fit is still pulled
    towards what the controller of the table would be pulled to.
    """
    settings = dict(job.settings)
    table = dict(config.controller.get(job.controller, {}))
    own = settings_of(job.controller, config)
    if "pull" in settings and not own.get("towards"):
        table["towards"] = "inverse" if own["pull"] is None else "start"
    table |= {k: settings[k] for k in _CONTROLLERS if k in settings}
    changes = {k: settings[k] for k in ("scale", "fs", "spread", "noise_power") if k in settings}
    tables = dict(config.controller) | {job.controller: table}
    return replace(config, controllers=(job.controller,), controller=tables, **changes)


def cell_numbers(grid: Grid, config: StudyConfig) -> dict[str, np.ndarray]:
    """Nb, No, hop and update rate of every cell and controller; NaN for one without a buffer.

    Returns:
        ``cell_nb``, ``cell_no``, ``cell_hop`` [samples], ``cell_fb`` [Hz], (*axes, controller).
    """
    numbers = np.full((4, *grid.shape, len(grid.jobs)), np.nan)
    flat = numbers.reshape(4, -1, len(grid.jobs))
    for j, (controller, jobs) in enumerate(grid.jobs.items()):
        own = settings_of(controller, config)
        for i, job in enumerate(jobs):
            if "nb" in own:
                nb, no = job.get("nb", own["nb"]), job.get("no", own["no"])
                flat[:, i, j] = nb, no, nb - no, job.get("fs", config.fs) / (nb - no)
    return dict(zip(("cell_nb", "cell_no", "cell_hop", "cell_fb"), numbers, strict=True))
