"""`SweepConfig`: a study and the axes along which it is repeated."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from martths_jax.campaign.config import (
    StudyConfig,
    make_config,
    read_toml,
    unknown_names,
    with_usual,
)
from martths_jax.campaign.plan import study_problem
from martths_jax.control.controllers import ENTRIES
from martths_jax.control.entry import Entry
from martths_jax.errors import InputError, raise_all
from martths_jax.indices import choose
from martths_jax.indices.table import KNOWN, shown_of
from martths_jax.motions import Motion
from martths_jax.published import PROPOSED
from martths_jax.sweep.axes import Axis, make_axes
from martths_jax.sweep.grid import Grid, build_grid, entry_for

#: What a sweep has where a study has another default.
DEFAULTS = {"trials": 200, "controllers": PROPOSED, "out": "sweep", "signals": False}
#: Indices that figures and summary show.
SHOWN = ("J2_1", "J2_2", "J5_4", "J6_4", "J8_2")


@dataclass(frozen=True)
class SweepConfig:
    """Everything a sweep is.

    Attributes:
        study: trials, motions, controllers and so on of every cell.
        grid: axes and what runs in the cells.
        shown: indices of figures and summary.
    """

    study: StudyConfig
    grid: Grid
    shown: tuple[str, ...] = SHOWN

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The axes of the grid."""
        return self.grid.axes

    def axis(self, name: str) -> tuple[float, ...] | None:
        """Values of an axis; None if the sweep has none of that name."""
        return next((axis.values for axis in self.axes if axis.name == name), None)


def make_sweep(
    axes: Mapping | Iterable,
    config: StudyConfig | dict | str | Path | None = None,
    *,
    shown: Iterable[str] = SHOWN,
    **changes,
) -> SweepConfig:
    """`SweepConfig`, with everything checked that can be without loading or building anything.

    Raises:
        InputError: listing every axis, value, combination and setting that cannot be used.
    """
    problems: list[str] = []
    if isinstance(config, (str, Path)):
        config = read_toml(Path(config))
    if not isinstance(config, StudyConfig):
        config = with_usual(dict(config or {}) | changes, DEFAULTS)
    try:
        study = make_config(config, **changes)
    except InputError as error:
        study = None
        problems.append(str(error))
    found, bad = make_axes(axes, _entries(study))
    problems += bad
    names = list(KNOWN) if study is None else _names(study)
    shown = shown_of(shown, SHOWN, names)
    problems += unknown_names([n for n in shown if n not in names], names, "Index")
    grid = Grid(found, {})
    if study is not None:
        problems += _clashes(found, study)
        if not [c for c in study.controllers if not isinstance(c, str)]:
            grid, bad = build_grid(found, study)
            problems += bad
    raise_all(problems, "The sweep cannot be run")
    return SweepConfig(study, grid, shown)


def _names(study: StudyConfig) -> list[str]:
    """Names of the indices of a study."""
    return [index.name for index in choose(study.indices, study_problem(study).layout)]


def _entries(study: StudyConfig | None) -> list[Entry]:
    """Entries of the controllers that run, as far as they can be found; else of all of ours."""
    found = []
    for name in study.controllers if study is not None else ():
        with contextlib.suppress(InputError):  # building the plan says what is wrong
            if isinstance(name, str):
                found.append(entry_for(name, study))
    return found or list(ENTRIES)


def _clashes(axes: tuple[Axis, ...], study: StudyConfig) -> list[str]:
    """Sentences about settings of the study that an axis leaves no room for."""
    names = {axis.name for axis in axes}
    problems = []
    objects = [c for c in study.controllers if not isinstance(c, str)]
    if objects:
        problems.append(
            "Argument `controllers` of a sweep must hold names, since every cell builds its own; "
            "give settings in `controller`, as in {'adfc': {'q': 1e-5}}."
        )
    if "scale" in names and (study.pga is not None or study.sa is not None):
        problems.append("Axis `scale` and arguments `pga` or `sa` exclude each other.")
    if "spread" in names and study.plants is not None and study.plants_as != "draws":
        problems.append(
            "Axis `spread` needs plants that are draws; with `plants` give plants_as='draws'."
        )
    given = [m for m in study.motions or () if isinstance(m, Motion)]
    if "fs" in names and given:
        problems.append(
            "Axis `fs` needs motions by name or path, which are sampled anew at every rate; got "
            f"the `Motion` {given[0].name!r}."
        )
    return problems
