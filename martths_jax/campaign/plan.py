"""From a configuration to the things that run: benchmark, controllers, motions, plants."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

from martths_jax.benchmark import Benchmark
from martths_jax.campaign.config import StudyConfig, plain_value, unknown_names
from martths_jax.campaign.draws import Draws, make_draws
from martths_jax.campaign.given import named
from martths_jax.campaign.sources import code_of, without_source
from martths_jax.control.base import Controller
from martths_jax.control.controllers import ENTRIES
from martths_jax.control.entry import Entry
from martths_jax.control.registry import find, find_class, names
from martths_jax.coupler import Coupler
from martths_jax.errors import InputError, raise_all
from martths_jax.files import name_problems
from martths_jax.guests import Copy
from martths_jax.indices import Index, choose, files_of
from martths_jax.motions import BUILTIN_NAMES, Motion, load_motion
from martths_jax.motions.catalogue import BENCHMARK_NAMES, record_files
from martths_jax.problem import Problem, find_problem
from martths_jax.sensors import SensorNoise
from martths_jax.simulation import prepare


@dataclass(frozen=True)
class Plan:
    """Everything a study runs with, built and checked.

    Attributes:
        config: the configuration it was built from.
        benchmark: the benchmark.
        chosen: controllers by name, in the order of the results.
        motions: in the order of the results.
        noise: sensor noise.
        draws: plants by trial number.
        problem: what is tested.
    """

    config: StudyConfig
    benchmark: Benchmark
    chosen: dict[str, Chosen]
    motions: tuple[Motion, ...]
    noise: SensorNoise
    draws: Draws
    problem: Problem

    @property
    def controllers(self) -> dict[str, Controller]:
        """What runs, by name."""
        return {name: one.controller for name, one in self.chosen.items()}

    @property
    def controller_settings(self) -> dict[str, dict]:
        """What identifies each controller, as JSON can hold it."""
        return {name: one.identity for name, one in self.chosen.items()}

    @property
    def tables(self) -> dict[str, dict]:
        """Settings from which controllers can be made again; those of files name their copies."""
        found = {}
        for name, one in self.chosen.items():
            if one.table is not None:
                found[name] = dict(one.table)
                if one.copy is not None:
                    found[name]["kind"] = one.copy.again(one.table["kind"])
        return found

    @property
    def index_names(self) -> list[str]:
        """What names the indices again; those of files by their copies."""
        places = files_of(self.config.indices)
        listed = plain_value("indices", self.config.indices)
        return [places[i].copy.again(i) if i in places else i for i in listed]

    @property
    def copies(self) -> list[Copy]:
        """Files of the user's that controllers, indices and the problem were loaded from."""
        places = files_of(self.config.indices).values()
        found = [*(one.copy for one in self.chosen.values()), *(place.copy for place in places)]
        found += self.problem.copies
        return [one for one in dict.fromkeys(found) if one is not None]

    @property
    def indices(self) -> tuple[Index, ...]:
        """What is evaluated."""
        return choose(self.config.indices, self.problem.layout)

    @property
    def counts(self) -> dict[str, str]:
        """What the controllers count, in words by the names of their signals.

        What any of ours counts is always among it, so that all results have the same variables.
        """
        kinds = [*(entry.controller for entry in ENTRIES), *self.controllers.values()]
        signals = [signal for kind in kinds for signal in kind.signals if signal.count]
        return {signal.name: signal.label or signal.name for signal in signals}

    @property
    def trials(self) -> int:
        """Number of uncertain plants; trial 0, the nominal plant, comes on top."""
        return self.draws.trials

    @property
    def notices(self) -> list[str]:
        """Sentences a user should read before it runs."""
        found = [text for motion in self.motions for text in motion.notices]
        for name, settings in self.controller_settings.items():
            unknown = without_source(settings.get("code", {}))
            if unknown:
                found.append(
                    f"Controller {name!r}: the source of {', '.join(unknown)} cannot be found, so "
                    "these results can be neither resumed nor extended nor merged; define it with "
                    "`def` in a file to have that."
                )
        return found


def build_plan(config: StudyConfig) -> Plan:
    """Build and load everything a configuration names.

    Raises:
        InputError: listing every controller, motion and file that cannot be used.
    """
    problems: list[str] = []

    def attempt(make, *args):
        try:
            return make(*args)
        except InputError as error:
            problems.append(str(error))

    problem = attempt(study_problem, config)
    raise_all(problems, "The study cannot be run")
    benchmark = attempt(study_benchmark, config)
    motions = [attempt(study_motion, name, config) for name in motion_names(config, attempt)]
    chosen = {}
    problems += _unknown_tables(config)
    if benchmark is not None:
        for given in config.controllers:
            made = attempt(build_controller, given, config, benchmark)
            if made is not None:
                chosen[given_name(given)] = made
                attempt(prepare, made.controller, benchmark, 1)
    draws = attempt(make_draws, config, problem)
    if draws is not None and any(trial > draws.trials for trial in config.keep):
        problems.append(
            f"Argument `keep` must name trials up to {draws.trials}, but got {max(config.keep)}."
        )
    names = [m.name for m in motions if m is not None]
    for name in sorted({n for n in names if names.count(n) > 1}):
        problems.append(f"Two motions are called {name!r}; rename one of the files.")
    problems += name_problems("motion", names) + name_problems("controller", list(chosen))
    raise_all(problems, "The study cannot be run")
    noise = problem.noise(config.noise_power, config.noise_shared, config.seed)
    return Plan(config, benchmark, chosen, tuple(motions), noise, draws, problem)


def given_name(given) -> str:
    """Name of a controller in the results."""
    return given.name if isinstance(given, Controller) else given


def study_problem(config: StudyConfig) -> Problem:
    """The problem of a configuration.

    Raises:
        InputError: for one, or a case, that does not exist.
    """
    return find_problem(config.problem, config.case)


def study_benchmark(config: StudyConfig, coupler: Coupler | None = None) -> Benchmark:
    """The problem of a configuration as it runs, with another coupler if one is given."""
    return study_problem(config).build(
        config.fs, config.integrator, partition=config.partition, force_from=config.force_from,
        coupler=coupler,
    )  # fmt: skip


def motion_names(config: StudyConfig, attempt) -> tuple:
    """What the configuration runs on: its list, the records of its folder, or the built-in ones."""
    if config.motions is not None:
        return config.motions
    if config.records is None:
        return BUILTIN_NAMES
    found = attempt(record_files, config.records) or {}
    known = [name for name in BENCHMARK_NAMES.values() if name in found]
    return tuple(known or found)


def study_motion(given, config: StudyConfig) -> Motion:
    """A motion at the study's rate, from its name, its path or one that is loaded already."""
    if isinstance(given, Motion):
        if given.fs != config.fs:
            raise InputError(
                f"Motion `{given.name}` is sampled at {given.fs:g} Hz, the study runs at "
                f"{config.fs:g} Hz; load it with fs={config.fs:g}."
            )
        return given
    return load_motion(
        given,
        scale=config.scale,
        fs=config.fs,
        records=config.records,
        units=config.units,
        pga=config.pga,
        sa=config.sa,
        resample=config.resample,
        dt=config.dt,
        variable=config.variable,
    )


def _unknown_tables(config: StudyConfig) -> list[str]:
    used = {given_name(c) for c in config.controllers}
    return [
        f"Table [controller.{name}] configures a controller that does not run; name it in "
        "`controllers`."
        for name in sorted(set(config.controller) - used - set(names()))
    ]


@dataclass(frozen=True)
class Chosen:
    """A controller of a configuration.

    Attributes:
        controller: the object that runs.
        entry: what speaks for it.
        identity: what decides what it computes, as JSON can hold it.
        table: its settings with their ``kind``, from which it can be made again; None for an
            object, which cannot.
        copy: how a run keeps the file that its class was loaded from, if from one.
    """

    controller: Controller
    entry: Entry
    identity: dict
    table: dict | None = None
    copy: Copy | None = None

    @property
    def name(self) -> str:
        """Its name in the results."""
        return self.controller.name

    @property
    def about(self) -> dict:
        """What tables and figures say of it, as JSON can hold it."""
        own = self.name == self.entry.name
        return {
            "kind": self.entry.name,
            "label": self.entry.title if own else self.name,
            "look": self.entry.look if own else None,
            "paper": self.entry.paper,
        }


def build_controller(given, config: StudyConfig, benchmark: Benchmark) -> Chosen:
    """A controller, and what identifies it.

    Raises:
        InputError: an unknown kind or setting, a value the controller refuses, or a file or package
            that cannot be loaded.
    """
    if isinstance(given, Controller):
        kind = type(given)
        identity = {"kind": kind.__name__, "code": code_of(given)}
        return Chosen(given, find_class(kind), identity)
    table = dict(config.controller.get(given, {}))
    kind = table.pop("kind", given)
    try:
        guest = find(kind)
    except InputError as error:
        where = "" if kind == given else f"Controller {given!r}: "
        raise InputError(f"{where}{error}") from None
    entry = guest.entry
    known = entry.defaults
    raise_all(unknown_names(sorted(set(table) - set(known)), set(known), f"Setting of {given}"))
    table = {k: tuple(v) if isinstance(v, list) else v for k, v in table.items()}
    values = known | table
    try:
        made = entry.build(benchmark, **table)
        raise_all(made.problems(benchmark))
    except InputError as error:
        raise InputError(f"Controller {given!r}: {error}") from None
    except (TypeError, ValueError) as error:
        raise InputError(f"Controller {given!r} has a setting of the wrong type: {error}") from None
    values |= dict(getattr(made, "weights", ()))  # those left out were the design's to choose
    plain = {k: list(v) if isinstance(v, tuple) else v for k, v in values.items()}
    if made.name != given:
        made = named(made, given)
    identity = {"kind": kind} | plain
    if kind != entry.name or entry not in ENTRIES:
        identity |= {"kind": entry.name, "code": code_of(made)}
    if guest.copy is not None:
        identity |= {"sha256": guest.copy.sha256}
    return Chosen(made, entry, identity, {"kind": kind} | plain, guest.copy)


def motion_identity(motion: Motion) -> dict:
    """What identifies a motion: its file, and the very samples that run."""
    samples = np.ascontiguousarray(motion.acceleration, dtype="<f8")
    return {
        "sha256": motion.sha256,
        "scale": motion.scale,
        "samples": int(samples.size),
        "pga": float(np.max(np.abs(samples))),
        "samples_sha256": hashlib.sha256(samples.tobytes()).hexdigest(),
    }
