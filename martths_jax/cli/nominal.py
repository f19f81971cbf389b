"""``martths modes``, ``martths run`` and ``martths table4``: the benchmark itself, one trial."""

from __future__ import annotations

import csv
import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.table import Table

from martths_jax import published
from martths_jax.benchmark import build_benchmark
from martths_jax.cli.console import console, progress
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
from martths_jax.controllers import ADFC, LQG, Passthrough
from martths_jax.errors import argument_error
from martths_jax.files import atomic
from martths_jax.indices import indices
from martths_jax.motions import available_motions
from martths_jax.nominal import Comparison, compare_with_table4
from martths_jax.plant import draw_plants, nominal_plant
from martths_jax.sensors import SensorNoise
from martths_jax.simulation import simulate
from martths_jax.structure.frame import build_reference
from martths_jax.structure.frame import modes as natural_modes

#: The paper's records as a folder of theirs names them, and the built-in motions that stand in.
REAL = ("elcentro", "kobe", "morganhill")
BUILT_IN = ("elcentro-like", "kobe-like", "morganhill-like")

Fs = Annotated[float, typer.Option("--fs", help="Sampling rate [Hz].")]
Seed = Annotated[int, typer.Option("--seed", help="Seed of the plant and noise draws.")]


class ControllerName(StrEnum):
    """Controllers that the command line can run."""

    lqg = "lqg"
    adfc = "adfc"
    passthrough = "passthrough"


def build_controller(name: str, benchmark):
    """Controller of a name with its documented defaults."""
    return {
        "lqg": lambda: LQG.design(benchmark),
        "adfc": ADFC,
        "passthrough": Passthrough,
    }[name]()


def default_motions(records: Path | None) -> list[str]:
    """The paper's three records if they can be found, else the three built-in motions."""
    there = {info.name for info in available_motions(records) if not info.problem}
    return list(REAL if there.issuperset(REAL) else BUILT_IN)


def modes() -> None:
    """Natural modes of the reference structure beside Table 1 of the benchmark."""
    found = natural_modes(build_reference())
    table = Table(title="Reference structure: Table 1")
    for title in ("mode", "f [Hz]", "published", "effective mass in x [%]", "published"):
        table.add_column(title, justify="right")
    for mode, (f, mass) in published.TABLE1.items():
        ours_f, ours_mass = found.frequency[mode - 1], 100 * found.effective_mass[mode - 1]
        table.add_row(
            str(mode), f"{ours_f:.4f}", f"{f:.4f}", f"{_like(ours_mass, mass)}", f"{mass:g}"
        )
    console.print(table)


def _like(value: float, printed: float) -> str:
    """`value` with as many digits as `printed` shows."""
    if printed < 1e-3:
        return f"{value:.0e}"
    return f"{value:.{len(f'{printed:.10g}'.partition('.')[2]) or 2}f}"


def run(
    motion: Motions,
    out: Annotated[Path, typer.Option("--out", help="Folder for signals.npz and indices.")],
    controller: Annotated[
        ControllerName, typer.Option("--controller", help="What drives the actuators.")
    ] = ControllerName.adfc,
    trial: Annotated[
        int,
        typer.Option("--trial", min=0, help="0 is the nominal plant, 1, 2, ... uncertain ones."),
    ] = 0,
    seed: Seed = 0,
    fs: Fs = 1024,
    integrator: Annotated[str, typer.Option(help="newmark, rk4 or zoh.")] = "newmark",
    records: Records = None,
    scale: Scale = None,
    pga: Pga = None,
    sa: Sa = None,
    units: Units = None,
    dt: Dt = None,
    variable: Variable = None,
    resample: Resample = "linear",
) -> None:
    """Run one trial and save its signals and indices.

    Writes, for each motion, NAME_signals.npz (time histories; strokes and commands in mm, motion in
    m and rad, force in N and N m), NAME_indices.csv and NAME_run.json (status and settings).
    """
    motions = load_all(motion, records, scale, pga, sa, units, resample, fs, dt, variable)
    benchmark = build_benchmark(fs, integrator)
    drive = build_controller(controller, benchmark)
    plants = nominal_plant() if trial == 0 else draw_plants(1, seed, first=trial)
    with progress(f"{controller.value}, trial {trial}", len(motions)) as tell:
        for done, one in enumerate(motions, 1):
            result = simulate(benchmark, drive, plants, one, SensorNoise(seed=seed), keep=True)
            _save_run(out, one, result, {"trial": trial, "seed": seed, "integrator": integrator})
            console.print(str(result), highlight=False)
            _print_indices(result)
            tell(done)
    console.print(f"Saved in {out}", highlight=False)


def _save_run(out: Path, motion, result, settings: dict) -> None:
    stem = f"{motion.name}_{result.controller}"
    signals = {name: np.asarray(value)[0] for name, value in result.signals.items()}
    with atomic(out / f"{stem}_signals.npz") as part:
        np.savez_compressed(
            part, time=motion.time, ground=motion.acceleration, ref=result.reference, **signals
        )
    with atomic(out / f"{stem}_indices.csv") as part, part.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["index", "value"])
        writer.writerows((name, repr(float(v[0]))) for name, v in indices(result).items())
    about = settings | {
        "motion": motion.name,
        "source": motion.source,
        "sha256": motion.sha256,
        "scale": motion.scale,
        "fs": result.fs,
        "controller": result.controller,
        "status": result.describe(0),
        "volt_peak": np.asarray(result.watch.volt_peak)[:, 0].tolist(),
    }
    with atomic(out / f"{stem}_run.json") as part:
        part.write_text(json.dumps(about, indent=2) + "\n")


def _print_indices(result) -> None:
    table = Table(title=f"{result.controller}, {result.motion}: J1, J4 in ms, the others in %")
    values = list(indices(result).items())
    for _ in range(4):
        table.add_column("index")
        table.add_column("value", justify="right")
    for i in range(0, len(values), 4):
        table.add_row(*[c for name, v in values[i : i + 4] for c in (name, f"{v[0]:.3f}")])
    console.print(table)


def table4(
    records: Records = None,
    motion: Annotated[
        list[str] | None, typer.Option("--motion", help="Motions instead of the paper's three.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for table4.md and table4.csv.")
    ] = None,
    seed: Seed = 0,
    scale: Scale = None,
    units: Units = None,
    dt: Dt = None,
    variable: Variable = None,
) -> None:
    """The 48 numbers of Table 4 (24 indices, LQG and ADFC, nominal plant) beside those in print.

    Uses El Centro, Kobe and Morgan Hill from --records (or $MARTHS_RECORDS), and the built-in
    motions that behave like them where those are not found.
    """
    names = motion or default_motions(records)
    if not names:
        raise argument_error("--motion", "name at least one motion", "none")
    motions = load_all(names, records, scale, units=units, dt=dt, variable=variable)
    benchmark = build_benchmark()
    with progress("Table 4", 2 * len(motions)) as tell:
        found = compare_with_table4(benchmark, motions, noise=SensorNoise(seed=seed), progress=tell)
    _print_comparison(found)
    if out:
        for name, text in (("table4.md", found.to_markdown()), ("table4.csv", found.to_csv())):
            with atomic(out / name) as part:
                part.write_text(text)
        console.print(f"Saved in {out}", highlight=False)


def _print_comparison(found: Comparison) -> None:
    table = Table(title=f"Table 4, nominal plant, mean over {', '.join(found.motions)}")
    table.add_column("index")
    for name in found.ours:
        for title in (name, "paper", "deviation"):
            table.add_column(title, justify="right")
    for index, cells in found.cells().items():
        table.add_row(index, *cells)
    console.print(table)
