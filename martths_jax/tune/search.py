"""A tuning: the descent of an objective, stored after each evaluation, resumed to the bit."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import jax
import numpy as np

import martths_jax
from martths_jax.benchmark import LAYOUT, Benchmark
from martths_jax.campaign.files import set_aside, write_text
from martths_jax.campaign.header import sealed
from martths_jax.campaign.machine import machine_identity
from martths_jax.campaign.owner import owned
from martths_jax.campaign.plan import motion_identity
from martths_jax.campaign.provenance import differences, versions
from martths_jax.campaign.session import Session
from martths_jax.campaign.sources import code_of, engine_code
from martths_jax.campaign.store import clear
from martths_jax.errors import InputError, argument_error, raise_all
from martths_jax.layout import Layout
from martths_jax.motions import Motion
from martths_jax.plant import Plants
from martths_jax.problem import Problem, find_problem
from martths_jax.runtime import check_runtime
from martths_jax.sensors import SensorNoise
from martths_jax.tune.descent import METHODS, Method
from martths_jax.tune.gradient import MODES, Gradient
from martths_jax.tune.objective import Objective
from martths_jax.tune.parameters import Tuned, tuned

STATE = "state.json"
#: What a tuning leaves in its folder.
OWN = (STATE, "provenance.json", "config.toml", "design.json", "history.csv", "convergence.png",
       "comparison.csv")  # fmt: skip


@dataclass(frozen=True)
class Options:
    """What to tune and how.

    Attributes:
        controller: see ``parameters.tuned``.
        objective: see ``Objective.parse``.
        trials: number of uncertain plants; seed: of plants and noise.
        start: numbers to start from instead of the defaults.
        free: the numbers that may move; all by default.
        steps: number of evaluations in all.
        rate: length of the first step, in decades of each number (in units of its start for one
            that may be negative); with Adam, of every step.
        patience: stop after so many steps that improve the best by less than 0.1 %.
        volts, penalty: see ``Objective``; the limit of the problem's valves by default.
        method: ``lbfgs`` or ``adam``, see ``descent``.
        mode: of differentiation, ``forward`` or ``reverse``; the cheaper one by default.
        settings: of the controller besides those in its text, (name, value) pairs.
    """

    controller: str
    objective: str
    trials: int = 32
    seed: int = 1
    start: tuple[tuple[str, float], ...] = ()
    free: tuple[str, ...] = ()
    steps: int = 50
    rate: float = 0.1
    patience: int = 15
    volts: float | None = None
    penalty: float = 10.0
    method: str = "lbfgs"
    mode: str | None = None
    settings: tuple[tuple[str, object], ...] = ()

    def tuned(self) -> Tuned:
        """The controller with its start."""
        return tuned(self.controller, dict(self.start), dict(self.settings))

    def check(self, layout: Layout = LAYOUT) -> tuple[Objective, Tuned]:
        """The objective and the controller with its start.

        Args:
            layout: of the problem that is run.

        Raises:
            InputError: naming every option that cannot be used.
        """
        problems, results = [], []
        for make in (
            lambda: Objective.parse(self.objective, self.volts, self.penalty, layout),
            self.tuned,
        ):
            try:
                results.append(make())
            except InputError as error:
                problems.append(str(error))
        for name in ("trials", "steps", "patience"):
            if getattr(self, name) < 1:
                value = getattr(self, name)
                problems.append(str(argument_error(name, "be at least 1", value)))
        if not 0 < self.rate <= 2:
            problems.append(str(argument_error("rate", "lie in (0, 2] decades", self.rate)))
        for name, known in (("method", METHODS), ("mode", (None, *MODES))):
            if getattr(self, name) not in known:
                listed = ", ".join(str(k) for k in known if k)
                value = repr(getattr(self, name))
                problems.append(str(argument_error(name, f"be one of {listed}", value)))
        raise_all(problems, "The tuning cannot start")
        objective, controller = results
        unknown = sorted(set(self.free) - set(controller.start))
        if unknown:
            listed = ", ".join(controller.start)
            raise argument_error("free", f"name some of {listed}", repr(unknown[0]))
        return objective, controller


def tune(
    benchmark: Benchmark,
    options: Options,
    motions: list[Motion],
    folder: Path,
    *,
    plants: Plants | None = None,
    noise: SensorNoise | None = None,
    problem: Problem | None = None,
    fresh: bool = False,
    tell: Callable[[dict], None] = lambda row: None,
    notice: Callable[[str], None] = lambda text: None,
    gradient: Gradient | None = None,
    command_line: str = "tune(...)",
) -> dict:
    """Minimise the objective; keeps ``state.json`` in `folder` after each step and goes on from it.

    Args:
        motions: what to tune on.
        folder: where the state is kept; a folder with the state of other options is refused.
        plants: to tune on, in place of ``options.trials`` independent ones.
        noise: of the sensors; the problem's by default.
        problem: whose plants and noise they are; the maRTHS benchmark by default.
        fresh: start over, deleting the tuning in the folder.
        tell: called with each row of the history.
        notice: is told what was damaged and set aside.
        gradient: of the same plants and motions with other weights of the same indices, which
            saves compiling one.
        command_line: kept with the results.

    Returns:
        the state: ``start``, ``best`` (coordinates of the numbers, log10 of those that must not be
        negative), ``history`` (rows), ``ended``.

    Raises:
        InputError: for options that cannot be used, a start with which a trial diverges, or a
            folder that holds another tuning or in which one runs.
    """
    check_runtime()
    problem = problem or find_problem()
    objective, controller = options.check(LAYOUT if benchmark is None else benchmark.layout)
    if gradient is None and benchmark is not None:
        controller.check(benchmark)
    with owned(folder, f"tune {options.controller}") as owner:
        if fresh:
            clear(folder, OWN)
        state = _load_or_begin(
            folder / STATE, controller, options,
            setting_of(options, motions, benchmark, plants, noise), notice,
        )  # fmt: skip
        devices = [str(d) for d in jax.local_devices()]
        session = Session(folder, owner, command_line, devices=devices)
        try:
            if gradient is None:
                plants = plants or problem.draw(options.trials, options.seed)
                noise = noise or usual_noise(problem, options.seed)
                free, mode = options.free, options.mode
                gradient = Gradient(
                    benchmark, controller, objective, plants, motions, noise, free, mode
                )
            else:
                gradient = gradient.of(objective)
            method = METHODS[options.method](options.free or tuple(controller.start), options.rate)
            while not state["ended"] and len(state["history"]) < options.steps:
                _step(state, gradient, controller, method, options)
                tell(state["history"][-1])
                session.count(options.trials * len(motions))
                owner.check()
                write_text(folder / STATE, json.dumps(sealed(state), indent=1))
        finally:
            session.save()
        return state


def usual_noise(problem: Problem, seed: int) -> SensorNoise:
    """The noise of a problem's sensors where nothing else is said."""
    return problem.noise(
        problem.settings.get("noise_power", SensorNoise.noise_power), SensorNoise.shared, seed
    )


def setting_of(
    options: Options,
    motions: list[Motion],
    benchmark: Benchmark | None = None,
    plants: Plants | None = None,
    noise: SensorNoise | None = None,
) -> dict:
    """What decides the course of a tuning, as JSON can hold it."""
    setting = {k: v for k, v in asdict(options).items() if k != "steps"} | {
        "motions": [[m.name, motion_identity(m)] for m in motions],
        "versions": versions(),
        "code": engine_code(("tune/*.py",)),
        "machine": machine_identity(),
        "benchmark": _digest(benchmark),
        "plants": None if plants is None else _digest(plants),
        "noise": None if noise is None else asdict(noise),
        "controller_code": _code(options),
    }
    return json.loads(json.dumps(setting, default=str))


def _digest(tree) -> str:
    """Checksum of all arrays and constants of a pytree."""
    leaves, shape = jax.tree.flatten(tree)
    found = hashlib.sha256(str(shape).encode())
    for leaf in leaves:
        found.update(np.ascontiguousarray(leaf).tobytes())
    return found.hexdigest()


def _code(options: Options) -> dict | None:
    """What identifies the code of a controller that is not of this package."""
    controller = options.tuned()
    kind = controller.entry.controller
    if kind.__module__.partition(".")[0] == martths_jax.__name__:
        return None
    return code_of(kind) | {"file": controller.guest.copy.sha256 if controller.guest.copy else ""}


def _load_or_begin(path: Path, controller: Tuned, options: Options, setting: dict, notice) -> dict:
    """The state in a folder, or that of a tuning that begins."""
    state = _load(path, setting, notice)
    if state is not None:
        return state
    start = controller.coordinates(controller.start)
    method = METHODS[options.method](options.free or tuple(start), options.rate)
    return {"setting": setting, "start": start, "best": start, "descent": method.init(start),
            "history": [], "ended": ""}  # fmt: skip


def _step(state: dict, gradient: Gradient, controller: Tuned, method: Method, options: Options):
    """One evaluation, and where the next will be."""
    descent, history = state["descent"], state["history"]
    here = dict(descent["trial"])
    length = max(abs(x - descent["here"][name]) for name, x in here.items())
    loss, slope, smooth, lost = gradient(here)
    good = bool(np.all(np.isfinite([loss, *slope.values()])) and lost == 0)
    if not history and not good:
        raise InputError(
            "Argument `start` must be stable on every plant, but "
            f"{100 * lost:.3g} % of the trials diverged; start from other values."
        )
    if good and loss < min((row["objective"] for row in _good(history)), default=np.inf):
        state["best"] = here
    accepted = method.advance(descent, loss, slope, good)
    history.append(
        {
            "step": len(history), "accepted": accepted, "objective": loss, "diverged": lost,
            "length": length, **smooth, **controller.shown(here),
        }
    )  # fmt: skip
    state["ended"] = descent["ended"]
    if _stalled(history, options.patience):
        state["ended"] = state["ended"] or "no more improvement"


def _good(history: list[dict]) -> list[dict]:
    """Rows at which no trial diverged."""
    return [r for r in history if r["diverged"] == 0 and np.isfinite(r["objective"])]


def _stalled(history: list[dict], patience: int) -> bool:
    """Whether the last `patience` steps did not improve the best by 0.1 %."""
    values = [r["objective"] if _good([r]) else np.inf for r in history]
    best = np.minimum.accumulate(values)
    return len(best) > patience and best[-1] > (1 - 1e-3) * best[-1 - patience]


def _load(path: Path, setting: dict, notice) -> dict | None:
    if not path.exists():
        return None
    try:
        state = json.loads(path.read_text("utf-8"))
        if state["sha256"] != sealed(state)["sha256"]:
            raise ValueError("its checksum is another")
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror or error}).") from None
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        aside = set_aside(path)
        notice(f"{path} is damaged ({error}); it was set aside as {aside.name}, and the tuning "
               "begins again.")  # fmt: skip
        return None
    differing = differences(state["setting"], setting)
    if differing:
        listed = "\n".join(f"  {text}" for text in differing)
        raise InputError(
            f"{path.parent} holds a tuning with other options.  These differ:\n{listed}\n"
            "Give another --out (`folder`), or repeat the options to go on with it."
        )
    return {k: v for k, v in state.items() if k != "sha256"}
