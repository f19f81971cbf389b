"""The descent: Adam on log-numbers, with back-off, early stop and resumption."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import optax

from martths_jax.benchmark import VOLT_LIMIT, Benchmark
from martths_jax.campaign.files import set_aside, write_text
from martths_jax.campaign.header import sealed
from martths_jax.campaign.machine import machine_identity
from martths_jax.campaign.owner import Owner, owned
from martths_jax.campaign.plan import motion_identity
from martths_jax.campaign.provenance import differences, versions
from martths_jax.campaign.sources import engine_code
from martths_jax.errors import InputError, argument_error, raise_all
from martths_jax.motions import Motion
from martths_jax.plant import draw_plants
from martths_jax.runtime import check_runtime
from martths_jax.sensors import SensorNoise
from martths_jax.tune.gradient import Gradient
from martths_jax.tune.objective import Objective
from martths_jax.tune.parameters import start_of

STATE = "state.json"
SHORTEST = 1e-3  # of the first step length: below, backing off has failed and tuning ends


@dataclass(frozen=True)
class Options:
    """What to tune and how.

    Attributes:
        controller: ``lqg`` or ``adfc``.
        objective: see ``Objective.parse``.
        plants: number of uncertain plants; seed: of plants and noise.
        start: numbers to start from instead of the defaults (not logs).
        free: the numbers that may move; all by default.
        steps: number of accepted or refused steps in all.
        rate: length of a step, in decades of each number.
        patience: stop after so many steps that improve the best by less than 0.1 %.
        volts, penalty: see ``Objective``.
    """

    controller: str
    objective: str
    plants: int = 32
    seed: int = 1
    start: tuple[tuple[str, float], ...] = ()
    free: tuple[str, ...] = ()
    steps: int = 50
    rate: float = 0.1
    patience: int = 15
    volts: float = VOLT_LIMIT
    penalty: float = 10.0

    def check(self) -> tuple[Objective, dict[str, float]]:
        """The objective and the start as log10.

        Raises:
            InputError: naming every option that cannot be used.
        """
        problems, results = [], []
        for make in (
            lambda: Objective.parse(self.objective, self.volts, self.penalty),
            lambda: start_of(self.controller, dict(self.start)),
        ):
            try:
                results.append(make())
            except InputError as error:
                problems.append(str(error))
        for name in ("plants", "steps", "patience"):
            if getattr(self, name) < 1:
                value = getattr(self, name)
                problems.append(str(argument_error(name, "be at least 1", value)))
        if not 0 < self.rate <= 2:
            problems.append(str(argument_error("rate", "lie in (0, 2] decades", self.rate)))
        raise_all(problems, "The tuning cannot start")
        unknown = sorted(set(self.free) - set(results[1]))
        if unknown:
            raise argument_error("free", f"name some of {', '.join(results[1])}", unknown[0])
        return results[0], results[1]


def tune(
    benchmark: Benchmark,
    options: Options,
    motions: list[Motion],
    folder: Path,
    *,
    tell: Callable[[dict], None] = lambda row: None,
    notice: Callable[[str], None] = lambda text: None,
    gradient: Gradient | None = None,
) -> dict:
    """Minimise the objective; keeps ``state.json`` in `folder` after each step and goes on from it.

    Args:
        motions: what to tune on.
        folder: where the state is kept; a folder with the state of other options is refused.
        tell: called with each row of the history.
        notice: is told what was damaged and set aside.
        gradient: of the same plants and motions with other weights of the same indices, which
            saves compiling one.

    Returns:
        the state: ``start``, ``best`` (log10 of the numbers), ``history`` (rows), ``ended``.

    Raises:
        InputError: for options that cannot be used, a start with which a trial diverges, or a
            folder that holds another tuning or in which one runs.
    """
    check_runtime()
    options.check()
    with owned(folder, f"tune {options.controller}") as owner:
        return _descend(benchmark, options, motions, owner, tell, notice, gradient)


def setting_of(options: Options, motions: list[Motion]) -> dict:
    """What decides the course of a tuning, as JSON can hold it."""
    setting = {k: v for k, v in asdict(options).items() if k != "steps"} | {
        "motions": [[m.name, motion_identity(m)] for m in motions],
        "versions": versions(),
        "code": engine_code(("tune/*.py",)),
        "machine": machine_identity(),
    }
    return json.loads(json.dumps(setting))


def _descend(benchmark, options, motions, owner: Owner, tell, notice, gradient) -> dict:
    """The steps that are not done yet; see ``tune``."""
    objective, start = options.check()
    folder, setting = owner.folder, setting_of(options, motions)
    free = options.free or tuple(start)
    optimiser = optax.adam(1.0)
    state = _load(folder / STATE, setting, notice)
    if state is None:
        blank = optimiser.init({name: jnp.zeros(()) for name in free})
        state = {
            "setting": setting, "start": start, "best": start, "here": start, "trial": start,
            "moments": _leaves(blank), "length": options.rate, "history": [], "ended": "",
        }  # fmt: skip
    plants = draw_plants(options.plants, options.seed)
    if gradient is None:
        noise = SensorNoise(seed=options.seed)
        gradient = Gradient(benchmark, options.controller, objective, plants, motions, noise)
    else:
        gradient = gradient.of(objective)
    template = jax.tree.structure(optimiser.init({name: jnp.zeros(()) for name in free}))
    while not state["ended"] and len(state["history"]) < options.steps:
        loss, slope, smooth, lost = gradient(state["trial"])
        finite = np.all(np.isfinite([loss, *slope.values()]))
        good = bool(finite and lost == 0)
        if not state["history"] and not good:
            raise InputError(
                "Argument `start` must be stable on every plant, but "
                f"{100 * lost:.3g} % of the trials diverged; start from other values."
            )
        state["history"].append(
            {
                "step": len(state["history"]), "accepted": good, "objective": loss,
                "diverged": lost, "length": state["length"], **smooth,
                **{f"log10_{name}": value for name, value in state["trial"].items()},
            }
        )  # fmt: skip
        if good:
            _accept(state, slope, free, optimiser, template)
        else:
            _back_off(state, options)
        if _stalled(state["history"], options.patience):
            state["ended"] = state["ended"] or "no more improvement"
        tell(state["history"][-1])
        owner.check()
        write_text(folder / STATE, json.dumps(sealed(state), indent=1))
    return state


def _accept(state, slope, free, optimiser, template):
    """Move the state to the point just evaluated, and propose the next one."""
    moments = jax.tree.unflatten(template, [jnp.asarray(x) for x in state["moments"]])
    slope = {name: jnp.asarray(slope[name]) for name in free}
    move, moments = optimiser.update(slope, moments)
    state["moments"] = _leaves(moments)
    state["here"] = state["trial"]
    state["trial"] = dict(state["here"])
    for name in free:
        state["trial"][name] += state["length"] * float(move[name])
    good = [row for row in state["history"] if row["accepted"]]
    best = min(good, key=lambda row: row["objective"])
    state["best"] = {name: best[f"log10_{name}"] for name in state["start"]}


def _back_off(state, options):
    """Half the way back to the last good point, and shorter steps from now on."""
    state["length"] /= 2
    state["trial"] = {
        name: (value + state["here"][name]) / 2 for name, value in state["trial"].items()
    }
    if state["length"] < SHORTEST * options.rate:
        state["ended"] = "steps became too short: every direction is unstable"


def _stalled(history, patience) -> bool:
    """Whether the last `patience` steps did not improve the best by 0.1 %."""
    best = np.minimum.accumulate([r["objective"] if r["accepted"] else np.inf for r in history])
    return len(best) > patience and best[-1] > (1 - 1e-3) * best[-1 - patience]


def _leaves(tree) -> list:
    return [np.asarray(x).tolist() for x in jax.tree.leaves(tree)]


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
