"""From a configuration to the things that run: benchmark, controllers, motions, plants."""

from __future__ import annotations

import dataclasses
import hashlib
import inspect
from dataclasses import dataclass

import numpy as np

from martths_jax.benchmark import Benchmark, build_benchmark
from martths_jax.campaign.config import StudyConfig, unknown_names
from martths_jax.campaign.draws import Draws, make_draws
from martths_jax.campaign.sources import code_of, without_source
from martths_jax.control.controllers import ADFC, LQG, Controller, Passthrough
from martths_jax.errors import InputError, raise_all
from martths_jax.files import name_problems
from martths_jax.motions import BUILTIN_NAMES, Motion, load_motion
from martths_jax.motions.catalogue import BENCHMARK_NAMES, record_files
from martths_jax.sensors import SensorNoise
from martths_jax.simulation import prepare

#: Kinds of controllers a configuration can name, and what makes them from their settings.
KINDS = {"lqg": LQG.design, "adfc": ADFC, "passthrough": Passthrough}
#: Arguments of these that are no settings.
_NOT_SETTINGS = {"benchmark", "estimator", "start"}


@dataclass(frozen=True)
class Plan:
    """Everything a study runs with, built and checked.

    Attributes:
        config: the configuration it was built from.
        benchmark: the benchmark.
        controllers: by name, in the order of the results.
        motions: in the order of the results.
        noise: sensor noise.
        draws: plants by trial number.
        controller_settings: what identifies each controller, as JSON can hold it.
    """

    config: StudyConfig
    benchmark: Benchmark
    controllers: dict[str, Controller]
    motions: tuple[Motion, ...]
    noise: SensorNoise
    draws: Draws
    controller_settings: dict[str, dict]

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

    benchmark = attempt(_benchmark, config)
    motions = [attempt(study_motion, name, config) for name in motion_names(config, attempt)]
    controllers, settings = {}, {}
    problems += _unknown_tables(config)
    if benchmark is not None:
        for given in config.controllers:
            made = attempt(build_controller, given, config, benchmark)
            if made is not None:
                name, controllers[name], settings[name] = given_name(given), *made
                attempt(prepare, made[0], benchmark, 1)
    draws = attempt(make_draws, config)
    if draws is not None and any(trial > draws.trials for trial in config.keep):
        problems.append(
            f"Argument `keep` must name trials up to {draws.trials}, but got {max(config.keep)}."
        )
    names = [m.name for m in motions if m is not None]
    for name in sorted({n for n in names if names.count(n) > 1}):
        problems.append(f"Two motions are called {name!r}; rename one of the files.")
    problems += name_problems("motion", names) + name_problems("controller", list(controllers))
    raise_all(problems, "The study cannot be run")
    noise = SensorNoise(config.noise_power, config.noise_shared, config.seed)
    return Plan(config, benchmark, controllers, tuple(motions), noise, draws, settings)


def given_name(given) -> str:
    """Name of a controller in the results."""
    return given.name if isinstance(given, Controller) else given


def _benchmark(config: StudyConfig) -> Benchmark:
    return build_benchmark(config.fs, config.integrator, partition=config.partition)


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


def defaults(kind: str) -> dict:
    """Settings of a kind of controller and their defaults."""
    parameters = inspect.signature(KINDS[kind]).parameters.values()
    return {p.name: p.default for p in parameters if p.name not in _NOT_SETTINGS}


def _unknown_tables(config: StudyConfig) -> list[str]:
    used = {given_name(c) for c in config.controllers}
    return [
        f"Table [controller.{name}] configures a controller that does not run; name it in "
        "`controllers`."
        for name in sorted(set(config.controller) - used - set(KINDS))
    ]


def build_controller(given, config: StudyConfig, benchmark: Benchmark) -> tuple[Controller, dict]:
    """A controller and what identifies it.

    Raises:
        InputError: an unknown kind or setting, or a value the controller refuses.
    """
    if isinstance(given, Controller):
        return given, {"kind": type(given).__name__, "code": code_of(given)}
    table = dict(config.controller.get(given, {}))
    kind = table.pop("kind", given)
    if kind not in KINDS:
        raise InputError(
            f"Controller {given!r} is unknown; known are {', '.join(KINDS)}, and names with a "
            f"table [controller.{given}] that says their kind."
        )
    known = defaults(kind)
    raise_all(unknown_names(sorted(set(table) - set(known)), set(known), f"Setting of {given}"))
    table = {k: tuple(v) if isinstance(v, list) else v for k, v in table.items()}
    values = known | table
    try:
        made = KINDS[kind](benchmark, **table) if kind == "lqg" else KINDS[kind](**table)
        raise_all(made.problems(benchmark))
    except InputError as error:
        raise InputError(f"Controller {given!r}: {error}") from None
    except (TypeError, ValueError) as error:
        raise InputError(f"Controller {given!r} has a setting of the wrong type: {error}") from None
    values |= dict(getattr(made, "weights", ()))  # those left out are LQG's to choose
    plain = {k: list(v) if isinstance(v, tuple) else v for k, v in values.items()}
    if dataclasses.is_dataclass(made) and made.name != given:
        made = _named(made, given)
    return made, {"kind": kind} | plain


def _named(controller: Controller, name: str) -> Controller:
    # The name is a class attribute, not a field, so that it stays out of the compiled program.
    object.__setattr__(controller, "name", name)
    return controller


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
