"""From axes to runs: every cell of the grid, what it sets, and which cells can share a batch.

A cell is one point of the grid.  A *job* is what a cell runs of one controller: cells that differ
only in settings a controller does not have (a buffer) are the same job, run once.  Jobs
that differ only in traced scalars (gains, weights, noise power) stand side by side in one batch.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from martths_jax.campaign.config import StudyConfig
from martths_jax.control.entry import Entry
from martths_jax.control.registry import find
from martths_jax.errors import InputError
from martths_jax.sweep.axes import STUDY, Axis, apart, own_axes

#: Settings of a study that may differ from lane to lane; all others shape a batch.
LANE = ("noise_power",)


@dataclass(frozen=True)
class Job:
    """What runs once: a controller with its settings in its surroundings.

    Attributes:
        controller: its name.
        settings: (name, value) of everything an axis sets and this controller feels, sorted.
        shaping: names of those that must be the same for all lanes of a batch.
    """

    controller: str
    settings: tuple[tuple[str, float], ...]
    shaping: frozenset[str] = frozenset()

    def get(self, name: str, default=None):
        """A setting, or `default` where no axis sets it."""
        return dict(self.settings).get(name, default)

    @property
    def shared(self) -> tuple:
        """What all jobs of a batch have in common."""
        return self.controller, tuple((k, v) for k, v in self.settings if k in self.shaping)

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


def entry_for(name: str, config: StudyConfig) -> Entry:
    """The entry of a controller named in a configuration.

    Raises:
        InputError: if there is none.
    """
    return find(kind_of(name, config)).entry


def settings_of(name: str, entry: Entry, config: StudyConfig) -> dict:
    """Settings of a controller: those of its table, else the defaults of its entry."""
    table = config.controller.get(name, {})
    return entry.defaults | {k: v for k, v in table.items() if k != "kind"}


def build_grid(axes: tuple[Axis, ...], config: StudyConfig) -> tuple[Grid, list[str]]:
    """The grid, and sentences about every combination that makes no sense."""
    problems: list[str] = []
    jobs: dict[str, tuple[Job, ...]] = {}
    felt = {axis.name for axis in axes if not axis.scalar.own}
    for controller in config.controllers:
        try:
            entry = entry_for(controller, config)
        except InputError:
            continue  # build_plan says so
        found, own = [], settings_of(controller, entry, config)
        for place in itertools.product(*(axis.values for axis in axes)):
            job, sentences = _job(controller, entry, own, axes, place, config.fs)
            found.append(job)
            problems += sentences
        jobs[controller] = tuple(found)
        felt |= {axis.name for axis in axes} & set(own_axes(entry))
        problems += _alike(axes, entry, jobs[controller])
    for axis in axes:
        if jobs and axis.name not in felt:
            problems.append(
                f"Axis `{axis.name}` moves nothing: no controller of {', '.join(jobs)} has it."
            )
    return Grid(axes, jobs), list(dict.fromkeys(problems))


def _job(controller: str, entry: Entry, own: dict, axes, place, fs) -> tuple[Job, list[str]]:
    """What a controller with its own settings runs in a cell, and sentences if it cannot be."""
    values = {axis.name: value for axis, value in zip(axes, place, strict=True)}
    surroundings = {a.scalar.setting: values[a.name] for a in axes if not a.scalar.own}
    fs = surroundings.get("fs", fs)
    plain = {name: of for name, (of, _) in own_axes(entry).items()}
    derived = {d.name: d for d in entry.derived}
    changed = {plain[n]: v for n, v in values.items() if n in plain and n not in derived}
    for name in values:
        if name in derived:
            changed[derived[name].of] = derived[name].value(values[name], own | changed, fs)
    moved = bool(changed)
    changed |= entry.followed(own, changed)
    problems = []
    if moved:
        mine = [f"{n} = {v:g}" for n, v in values.items() if n in plain]
        rate = f" at fs = {fs:g} Hz" if any(n in derived for n in values) else ""
        problems = [
            f"Cell {', '.join(mine)}{rate} of {controller} cannot run: {text}"
            for text in entry.clashes(own | changed)
        ]
    numbers = {k: v for k, v in changed.items() if entry.parameter(k).is_number}
    static = {p.name for p in entry.parameters if p.kind == "static"}
    settings = surroundings | {apart(entry, k): v for k, v in numbers.items()}
    shaping = set(surroundings) - set(LANE) | {apart(entry, k) for k in static & set(numbers)}
    return Job(controller, tuple(sorted(settings.items())), frozenset(shaping)), problems


def _alike(axes: tuple[Axis, ...], entry: Entry, jobs: tuple[Job, ...]) -> list[str]:
    """Sentences about values of a derived axis that come to the same parameter."""
    problems = []
    places = list(itertools.product(*(axis.values for axis in axes)))
    for at, axis in enumerate(axes):
        derived = next((d for d in entry.derived if d.name == axis.name), None)
        if derived is None:
            continue
        same: dict[tuple, list[float]] = {}
        for place, job in zip(places, jobs, strict=True):
            same.setdefault((place[:at], place[at + 1 :], job), []).append(place[at])
        for (*_, job), values in same.items():
            if len(values) > 1:
                of = apart(entry, derived.of)
                rest = ", ".join(f"{k} = {v:g}" for k, v in job.settings if k != of)
                problems.append(
                    f"Axis `{axis.name}`: {' and '.join(f'{v:g}' for v in values)} all give "
                    f"{derived.of} = {job.get(of)}{f' with {rest}' if rest else ''}, a "
                    "duplicate cell."
                )
    return problems


def job_config(job: Job, config: StudyConfig) -> StudyConfig:
    """The study configuration whose controller, motions, plants and noise a job has.

    An axis changes its own scalar and what the controller says must follow, and nothing else.
    """
    entry = entry_for(job.controller, config)
    own = settings_of(job.controller, entry, config)
    given = dict(job.settings)
    keys = {p.name: apart(entry, p.name) for p in entry.parameters}
    changed = {name: given[key] for name, key in keys.items() if key in given}
    table = dict(config.controller.get(job.controller, {})) | changed
    table |= entry.followed(own, changed)
    # The coupler's shape is no setting of a study.
    changes = {k: v for k, v in given.items() if k in STUDY and k not in ("alpha", "arm")}
    tables = dict(config.controller) | {job.controller: table}
    return replace(config, controllers=(job.controller,), controller=tables, **changes)


def cell_numbers(grid: Grid, config: StudyConfig) -> dict[str, tuple[np.ndarray, str, str]]:
    """Numbers that shape the controllers of every cell: counts, and what else derives from them.

    Returns:
        ``cell_NAME`` -> ((*axes, controller) values, NaN for a controller without; label; unit).
    """
    found: dict[str, tuple[np.ndarray, str, str]] = {}
    for j, (controller, jobs) in enumerate(grid.jobs.items()):
        entry = entry_for(controller, config)
        own = settings_of(controller, entry, config)
        shown = [p for p in entry.parameters if p.is_number and p.unit == "samples"]
        for one in [*shown, *(d for d in entry.derived if d.of_cell is not None)]:
            name = f"cell_{one.name}"
            blank = np.full((*grid.shape, len(grid.jobs)), np.nan)
            values = found.setdefault(name, (blank, one.label, one.unit))[0]
            flat = values.reshape(-1, len(grid.jobs))
            for i, job in enumerate(jobs):
                settings = own | {k: job.get(apart(entry, k), v) for k, v in own.items()}
                fs = job.get("fs", config.fs)
                derived = getattr(one, "of_cell", None)
                flat[i, j] = derived(settings, fs) if derived else settings[one.name]
    return found
