"""`StudyConfig`: what a study is, from Python, TOML or flags, with every problem found at once."""

from __future__ import annotations

import difflib
import os
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from martths_jax.campaign.fields import BY_NAME, FIELDS, SECTIONS
from martths_jax.campaign.given import EXAMPLE, expand
from martths_jax.control.base import Controller
from martths_jax.errors import InputError, argument_error, raise_all
from martths_jax.indices import DEFAULT, Index, choose
from martths_jax.motions import DEFAULT_SCALE, Motion
from martths_jax.problem import find_problem
from martths_jax.published import COMPARED
from martths_jax.sensors import SensorNoise
from martths_jax.text import shortened


@dataclass(frozen=True)
class StudyConfig:
    """Controllers x motions x trials, and how to run them.

    ``fields.FIELDS`` says what each setting means.  From Python, `controllers` may hold
    ``Controller`` objects and `motions` ``Motion`` objects beside names; ``make_config`` takes
    `controllers` in all forms of ``given``, such as ``["adfc", "slow=adfc{nb=2048,no=2047}"]`` or
    ``{"adfc": "adfc", "slow": ADFC(nb=2048, no=2047)}``.

    Attributes:
        controller: settings of the controllers by name, as in ``{"adfc": {"pull": 1e-6}}``; a new
            name says its ``kind`` too, as in ``{"literal": {"kind": "adfc", "pull": 0}}``.
    """

    trials: int = 1000
    seed: int = 1
    problem: str = "marths"
    case: int | None = None
    controllers: tuple = COMPARED
    indices: tuple = DEFAULT
    draws: str = "independent"
    spread: float = 1.0
    plants: str | None = None
    plants_as: str = "auto"
    motions: tuple | None = None
    records: str | None = None
    scale: float = DEFAULT_SCALE
    pga: str | float | None = None
    sa: str | None = None
    units: str | None = None
    dt: float | None = None
    variable: str | int | None = None
    resample: str = "linear"
    fs: float = 1024.0
    integrator: str = "newmark"
    partition: str = "benchmark"
    force_from: str = "estimate"
    noise_power: float = SensorNoise.noise_power
    noise_shared: bool = SensorNoise.shared
    out: str = "study"
    keep: tuple = ()
    signals: bool = True
    devices: int | None = None
    memory_gb: float | None = None
    max_failed: int | None = None
    controller: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def problems(self) -> list[str]:
        """Sentences about settings that cannot be used, without loading or building anything."""
        found = [
            str(argument_error(f.name, f.wanted, shortened(getattr(self, f.name))))
            for f in FIELDS
            if not f.good(getattr(self, f.name))
        ]
        if found:
            return found
        try:
            problem = find_problem(self.problem, self.case)
        except InputError as error:
            return [str(error)]
        for what, kind in (("controllers", Controller), ("motions", Motion)):
            given = getattr(self, what) or ()
            odd = [g for g in given if not isinstance(g, (str, kind))]
            if odd:
                found.append(str(argument_error(what, "hold names", repr(odd[0]))))
                continue
            names = [g if isinstance(g, str) else g.name for g in given]
            for name in sorted({n for n in names if names.count(n) > 1}):
                hint = f"; give one a name, as in {EXAMPLE}" if what == "controllers" else ""
                found.append(f"Argument `{what}` names {name!r} twice{hint}.")
        try:
            choose(self.indices, problem.layout)
        except InputError as error:
            found.append(str(error))
        if self.partition not in problem.partitions:
            known = ", ".join(problem.partitions)
            found.append(str(argument_error("partition", f"be one of {known}", self.partition)))
        if self.plants and self.draws != "independent":
            found.append("Arguments `plants` and `draws` exclude each other; give one of them.")
        return found


def controller_name(given) -> str:
    """Name of a controller in tables: the text itself, or the object's."""
    return given.name if isinstance(given, Controller) else given


def make_config(given=None, **changes) -> StudyConfig:
    """`StudyConfig` from one, from a mapping of settings, or from the path of a TOML file.

    Raises:
        InputError: listing every setting that is unknown or cannot be used.
    """
    if isinstance(given, (str, os.PathLike)):
        given = read_toml(Path(given))
    if not isinstance(given, StudyConfig):
        given = _from_mapping(dict(given or {}) | changes)
    else:
        known = {f.name for f in fields(StudyConfig)}
        raise_all(unknown_names(sorted(set(changes) - known), known, "Setting"))
        given = _expanded(replace(given, **{k: _plain(v) for k, v in changes.items()}))
    raise_all(given.problems())
    return given


def _expanded(config: StudyConfig) -> StudyConfig:
    """With names for controllers that were given by their settings, and tables for the names."""
    if not isinstance(config.controller, Mapping):
        raise argument_error("controller", "map names to settings", shortened(config.controller))
    controllers, tables = expand(config.controllers, config.controller)
    return replace(config, controllers=controllers, controller=tables)


def _plain(value):
    if isinstance(value, list):
        return tuple(value)
    if isinstance(value, np.generic):
        return value.item()
    return os.fspath(value) if isinstance(value, os.PathLike) else value


def _from_mapping(settings: dict) -> StudyConfig:
    known = {f.name for f in fields(StudyConfig)}
    problems = unknown_names(sorted(set(settings) - known), known, "Setting")
    settings = _usual(settings) | settings
    config = StudyConfig(**{k: _plain(v) for k, v in settings.items() if k in known})
    try:
        config = _expanded(config)
    except InputError as error:
        problems.append(str(error))
    raise_all([*problems, *config.problems()])
    return config


def _usual(settings: dict) -> dict:
    """Settings of the problem that is meant, where they are other than a study's usual ones."""
    name, case = settings.get("problem", StudyConfig.problem), settings.get("case")
    if not (BY_NAME["problem"].good(name) and BY_NAME["case"].good(case)):
        return {}  # said by ``StudyConfig.problems``
    try:
        problem = find_problem(name, case)
    except InputError:
        return {}  # likewise
    return dict(problem.settings)


def with_usual(given: Mapping, defaults: Mapping) -> dict:
    """Settings over what a campaign has where a study has another default, and over what the
    problem that is meant has in place of both."""
    return dict(defaults) | _usual(dict(given)) | dict(given)


def unknown_names(names, known, what: str) -> list[str]:
    """Sentences about names that are not among the known ones, each with the nearest."""
    problems = []
    for name in names:
        near = difflib.get_close_matches(str(name), sorted(known), n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(sorted(known))}."
        problems.append(f"{what} {name!r} is unknown; {hint}")
    return problems


def read_toml(path: Path) -> dict:
    """Settings of a TOML file as ``martths init-config`` writes it, by name.

    Raises:
        InputError: the file cannot be read, is no TOML, or holds unknown tables or keys.
    """
    try:
        document = tomllib.loads(path.read_text("utf-8"))
    except OSError as error:
        raise InputError(
            f"Configuration {path} cannot be read ({error.strerror}); `martths init-config` "
            "writes one to start from."
        ) from None
    except RecursionError:
        raise InputError(f"Configuration {path} nests its brackets too deeply.") from None
    except ValueError as error:  # of TOML, of its encoding, or a number beyond all bounds
        hint = f" {_BACKSLASHES}" if _escapes(path) else ""
        raise InputError(f"Configuration {path} is not valid TOML: {error}.{hint}") from None
    settings: dict = {}
    problems = unknown_names(sorted(set(document) - {*SECTIONS, "controller"}),
                        {*SECTIONS, "controller"}, "Table")  # fmt: skip
    for section in SECTIONS:
        table = document.get(section, {})
        if not isinstance(table, dict):
            problems.append(f"`{section}` must be a table, [{section}].")
            continue
        known = {f.name for f in FIELDS if f.section == section}
        problems += unknown_names(sorted(set(table) - known), known, f"Key in [{section}]")
        settings |= {k: v for k, v in table.items() if k in known}
        problems += [
            f"`{k}` in [{section}] holds {v!r:.80}, which is no path. {_BACKSLASHES}"
            for k, v in table.items() if k in known and _has_control(v)
        ]  # fmt: skip
    controller = document.get("controller", {})
    if not isinstance(controller, dict) or not all(
        isinstance(t, dict) for t in controller.values()
    ):
        problems.append("`controller` must hold one table a controller, such as [controller.adfc].")
    else:
        settings["controller"] = controller
    known = {f.name for f in fields(StudyConfig)}
    # The values are looked at too, so that one message lists everything that is wrong.
    values = StudyConfig(**{k: _plain(v) for k, v in settings.items() if k in known})
    raise_all([*problems, *values.problems()], f"Configuration {path} cannot be used")
    return settings


_BACKSLASHES = (
    "In a path write / or put it in single quotes, 'C:\\records\\a.csv': between double quotes "
    "TOML takes \\ for the start of a sign such as \\t."
)


def _escapes(path: Path) -> bool:
    """Whether a file holds a backslash between double quotes."""
    return re.search(rb'"[^"\n]*\\', path.read_bytes()) is not None


def _has_control(value) -> bool:
    """Whether a text, or one of a list, holds a tab or another sign that no path has."""
    texts = value if isinstance(value, list) else [value]
    return any(isinstance(text, str) and re.search(r"[\x00-\x1f]", text) for text in texts)


def plain_value(name: str, value):
    """A setting as JSON can hold it: objects by name."""
    if name == "controllers":
        return [controller_name(c) for c in value]
    if name == "motions" and value is not None:
        return [m.name if isinstance(m, Motion) else m for m in value]
    if name == "indices":
        return [i.name if isinstance(i, Index) else i for i in value]
    if isinstance(value, Mapping):
        return {k: plain_value("", v) for k, v in value.items()}
    return list(value) if isinstance(value, tuple) else value


def as_settings(config: StudyConfig) -> dict:
    """The effective configuration as JSON can hold it."""
    return {f.name: plain_value(f.name, getattr(config, f.name)) for f in fields(config)}


assert {f.name for f in fields(StudyConfig)} == {*BY_NAME, "controller"}
