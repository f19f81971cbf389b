"""``martths modes``, ``martths run`` and ``martths table4``: the benchmark itself, one trial."""

from __future__ import annotations

import json
from itertools import product
from pathlib import Path

import numpy as np
import typer
from rich.markup import escape

from martths_jax import published
from martths_jax.benchmark import Benchmark, build_benchmark
from martths_jax.campaign import plan
from martths_jax.campaign.config import with_usual
from martths_jax.campaign.formats.mat import save_mat
from martths_jax.cli.console import console, error_console, progress
from martths_jax.cli.motion_options import (
    Dt,
    Motions,
    Pga,
    Records,
    Resample,
    Sa,
    Scale,
    Units,
    Variable,
    load_all,
)
from martths_jax.cli.options import Trial, option, required, setting
from martths_jax.control.base import Controller
from martths_jax.errors import InputError, argument_error
from martths_jax.files import atomic, safe_name
from martths_jax.indices import DEFAULT, choose
from martths_jax.indices import indices as evaluate
from martths_jax.indices.table import units_in_words
from martths_jax.motions import available_motions
from martths_jax.nominal import Comparison, compare_with_table4
from martths_jax.problem import Problem, find_problem
from martths_jax.published import COMPARED, PROPOSED
from martths_jax.screen import ScreenTable
from martths_jax.sensors import SensorNoise
from martths_jax.simulation import simulate
from martths_jax.structure.frame import build_reference
from martths_jax.structure.frame import modes as natural_modes
from martths_jax.study import make_config

#: The paper's records as a folder of theirs names them, and the built-in motions that stand in.
REAL = ("elcentro", "kobe", "morganhill")
BUILT_IN = ("elcentro-like", "kobe-like", "morganhill-like")

Seed = setting("seed")
Asked = setting("problem", "marths")
Case = setting("case")


def build_controller(given: str, benchmark: Benchmark) -> tuple[Controller, dict]:
    """Controller of ``[NAME=]KIND[{KEY=VALUE,...}]`` and its settings."""
    config = make_config(controllers=[given])
    chosen = plan.build_controller(config.controllers[0], config, benchmark)
    return chosen.controller, chosen.identity


def default_motions(records: Path | None) -> list[str]:
    """The paper's three records if they can be found, else the three built-in motions."""
    there = {info.name for info in available_motions(records) if not info.problem}
    return list(REAL if there.issuperset(REAL) else BUILT_IN)


def _only_marths(problem: str | None, case: int | None, what: str, instead: str) -> None:
    """Refuse another problem than the one that a printed table is of."""
    asked = find_problem(problem or "marths", case)
    if asked is not find_problem():
        raise InputError(
            f"{what} is of the maRTHS benchmark, but got the {asked.title}; {instead}."
        )


def modes(problem: Asked = None, case: Case = None) -> None:
    """Natural modes of the reference structure beside Table 1 of the benchmark."""
    _only_marths(problem, case, "Table 1", "`martths figures` draws the modes that it has")
    found = natural_modes(build_reference())
    rows = []
    for mode, (f, mass) in published.TABLE1.items():
        ours_f, ours_mass = found.frequency[mode - 1], 100 * found.effective_mass[mode - 1]
        rows.append((str(mode), f"{ours_f:.4f}", f"{f:.4f}", _like(ours_mass, mass), f"{mass:g}"))
    heads = ("mode", "f [Hz]", "published", "effective mass in x [%]", "published")
    console.print(ScreenTable("Reference structure: Table 1", heads, rows))


def _like(value: float, printed: float) -> str:
    """`value` with as many digits as `printed` shows."""
    if printed < 1e-3:
        return f"{value:.0e}"
    return f"{value:.{len(f'{printed:.10g}'.partition('.')[2]) or 2}f}"


def run(
    motion: required("motions"),
    out: required("out", "a folder"),
    problem: Asked = None,
    case: Case = None,
    controller: setting("controllers", f"{', '.join(PROPOSED)}, or the problem's own") = None,
    trial: Trial = 0,
    seed: Seed = 0,
    fs: setting("fs", "the problem's") = None,
    integrator: setting("integrator", "the problem's") = None,
    records: Records = None,
    scale: Scale = None,
    pga: Pga = None,
    sa: Sa = None,
    units: Units = None,
    dt: Dt = None,
    variable: Variable = None,
    resample: Resample = None,
    indices: setting("indices", "benchmark") = None,
    matlab: option(bool, "--matlab", help="Write all of it as a MATLAB file NAME.mat too") = False,
) -> None:
    """Run one trial and save its signals and indices.

    Writes, for each motion, NAME_signals.npz (time histories; strokes and commands in mm, motion in
    m and rad, force in N and N m), NAME_indices.csv and NAME_run.json (status and settings).  In
    NAME.mat the signals are variables, indices and settings the structs indices and about.  A trial
    that diverges has no indices: its files are written all the same, and the exit code is 1.
    """
    asked = {"problem": problem, "case": case, "fs": fs, "integrator": integrator, "seed": seed,
             "controllers": controller}  # fmt: skip
    given = {name: value for name, value in asked.items() if value is not None}
    config = make_config(with_usual(given, {"controllers": PROPOSED}))
    tested = plan.study_problem(config)
    motions = load_all(motion, records, scale, pga, sa, units, resample, config.fs, dt, variable)
    benchmark = plan.study_benchmark(config)
    chosen = [plan.build_controller(name, config, benchmark) for name in config.controllers]
    drives = [(one.controller, one.identity) for one in chosen]
    plants = _plants(tested, trial, seed)
    noise = tested.noise(config.noise_power, config.noise_shared, seed)
    evaluated = choose(indices or DEFAULT, tested.layout)
    lost = []
    names = ", ".join(drive.name for drive, _ in drives)
    with progress(f"{names}, trial {trial}", len(motions) * len(drives)) as tell:
        for done, (one, (drive, settings)) in enumerate(product(motions, drives), 1):
            about = {"problem": config.problem, "case": case, "trial": trial, "seed": seed,
                     "integrator": config.integrator, "settings": settings}  # fmt: skip
            result = simulate(benchmark, drive, plants, one, noise, keep=True, indices=evaluated)
            _save_run(out, one, drive.name, result, about, matlab)
            console.print(str(result), highlight=False)
            _print_indices(result)
            if result.lost[0]:
                lost.append(f"{result.controller} on {one.name}: {result.describe(0)}")
            tell(done)
    console.print(f"Saved in {out}", highlight=False)
    if lost:
        for line in lost:
            error_console.print(f"[bold red]Diverged:[/] {escape(line)}.", highlight=False)
        raise typer.Exit(1)


def _plants(problem: Problem, trial: int, seed: int):
    """One plant: the nominal one as trial 0, else a drawn one."""
    if trial:
        return problem.draw(1, seed, first=trial)
    return problem.plants(np.zeros((1, len(problem.parameters))), np.zeros(1, int), 1.0)


def _save_run(out: Path, motion, name: str, result, settings: dict, mat: bool) -> None:
    stem = f"{safe_name(motion.name)}_{safe_name(name)}"
    signals = {
        "time": motion.time,
        "ground": motion.acceleration,
        "ref": result.reference,
        **{key: np.asarray(value)[0] for key, value in result.signals.items()},
    }
    values = {key: float(v[0]) for key, v in evaluate(result).items()}
    about = settings | {
        "motion": motion.name,
        "source": motion.source,
        "sha256": motion.sha256,
        "scale": motion.scale,
        "fs": result.fs,
        "controller": name,
        "status": result.describe(0),
        "volt_peak": np.asarray(result.watch.volt_peak)[0].tolist(),
    }
    with atomic(out / f"{stem}_signals.npz") as part:
        np.savez_compressed(part, **signals)
    with atomic(out / f"{stem}_indices.csv") as part:
        rows = [f"{key},{value!r}\n" for key, value in values.items()]
        part.write_text("index,value\n" + "".join(rows), encoding="utf-8")
    with atomic(out / f"{stem}_run.json") as part:
        part.write_text(json.dumps(about, indent=2) + "\n", encoding="utf-8")
    if mat:
        save_mat(out / f"{stem}.mat", signals | {"indices": values, "about": _for_matlab(about)})


def _for_matlab(value):
    """Nothing, which MATLAB has no word for, as an empty array."""
    if isinstance(value, dict):
        return {key: _for_matlab(item) for key, item in value.items()}
    return np.empty(0) if value is None else value


def _print_indices(result) -> None:
    rows = [(name, f"{value[0]:.3f}") for name, value in evaluate(result).items()]
    # Four indices a line, the last one filled up.
    rows += [("", "")] * (-len(rows) % 4)
    lines = [tuple(c for row in rows[i : i + 4] for c in row) for i in range(0, len(rows), 4)]
    told = units_in_words(result.sums.indices)
    title = f"{result.controller}, {result.motion}: {told}"
    console.print(ScreenTable(title, ("index", "value") * 4, lines, keys=0, text=("index",)))


def table4(
    records: Records = None,
    motion: Motions = None,
    out: setting("out", "the screen only; else a folder") = None,
    seed: Seed = 0,
    scale: Scale = None,
    units: Units = None,
    dt: Dt = None,
    variable: Variable = None,
    controller: setting("controllers", COMPARED) = None,
    indices: setting("indices", "benchmark") = None,
    problem: Asked = None,
    case: Case = None,
) -> None:
    """The numbers of Table 4 (24 indices, nominal plant) beside those in print.

    Uses El Centro, Kobe and Morgan Hill from --records (or $MARTHS_RECORDS), and the built-in
    motions that behave like them where those are not found.
    """
    _only_marths(problem, case, "Table 4",
                 "`martths study` sets what is printed of it beside its nominal plant")  # fmt: skip
    names = motion or default_motions(records)
    if not names:
        raise argument_error("--motion", "name at least one motion", "none")
    motions = load_all(names, records, scale, units=units, dt=dt, variable=variable)
    benchmark = build_benchmark()
    drives = [build_controller(given, benchmark)[0] for given in controller or COMPARED]
    with progress("Table 4", len(drives) * len(motions)) as tell:
        found = compare_with_table4(
            benchmark, motions, drives, noise=SensorNoise(seed=seed), progress=tell,
            indices=indices or DEFAULT,
        )  # fmt: skip
    _print_comparison(found)
    if out:
        for name, text in (("table4.md", found.to_markdown()), ("table4.csv", found.to_csv())):
            with atomic(out / name) as part:
                part.write_text(text, encoding="utf-8")
        console.print(f"Saved in {out}", highlight=False)


def _print_comparison(found: Comparison) -> None:
    heads = ("index", *(head for name in found.ours for head in (name, "paper", "deviation")))
    rows = [(index, *cells) for index, cells in found.cells().items()]
    title = f"Table 4, nominal plant, mean over {', '.join(found.motions)}"
    console.print(ScreenTable(title, heads, rows))
