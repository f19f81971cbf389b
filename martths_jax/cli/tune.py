"""``martths tune``: tune a controller by gradients through whole simulations."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from martths_jax.benchmark import VOLT_LIMIT, build_benchmark
from martths_jax.cli.console import console, error_console
from martths_jax.cli.motion_options import Dt, Records, Scale, Units, Variable, load_all
from martths_jax.errors import InputError
from martths_jax.screen import ScreenTable
from martths_jax.text import counted
from martths_jax.tune import Options
from martths_jax.tune import tune as run_tuning
from martths_jax.tune.report import write_report


def tune(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder of the results.")],
    controller: Annotated[str, typer.Option("--controller", help="lqg or adfc.")] = "lqg",
    objective: Annotated[
        str, typer.Option("--objective", help="Sum of weighted indices, such as j2+0.5*j5+J8_26.")
    ] = "j2+j5",
    motions: Annotated[
        list[str], typer.Option("--motions", help="What to tune on; may be repeated.")
    ] = ["elcentro-like"],  # noqa: B006
    check: Annotated[
        str, typer.Option("--check", help="Motion of the final comparison, not tuned on.")
    ] = "kobe-like",
    records: Records = None,
    scale: Scale = None,
    units: Units = None,
    dt: Dt = None,
    variable: Variable = None,
    plants: Annotated[int, typer.Option("--plants", help="Uncertain plants to tune on.")] = 32,
    fresh: Annotated[int, typer.Option("--fresh-plants", help="Plants of the comparison.")] = 128,
    seed: Annotated[int, typer.Option("--seed", help="Seed of plants and noise.")] = 1,
    steps: Annotated[int, typer.Option("--steps", help="Steps in all; a later call goes on.")] = 50,
    rate: Annotated[float, typer.Option("--rate", help="Length of a step [decades].")] = 0.1,
    patience: Annotated[
        int, typer.Option("--patience", help="Stop after so many steps without 0.1 % gain.")
    ] = 15,
    start: Annotated[
        list[str] | None, typer.Option("--start", metavar="NAME=VALUE", help="Start value.")
    ] = None,
    free: Annotated[
        list[str] | None, typer.Option("--free", metavar="NAME", help="Tune only these [all].")
    ] = None,
    volts: Annotated[
        float, typer.Option("--volts", help="Valve command where the penalty starts [V].")
    ] = VOLT_LIMIT,
    penalty: Annotated[
        float, typer.Option("--penalty", help="Weight of the squared excess [1/V^2].")
    ] = 10.0,
) -> None:
    """Tune LQG's weights or ADFC's lambda, and the filter's q, on a set of plants and motions."""
    options = Options(
        controller, objective, plants, seed, _starts(start), tuple(free or ()), steps, rate,
        patience, volts, penalty,
    )  # fmt: skip
    options.check()
    if check in motions:
        raise InputError(
            f"Option --check must name a motion that is not tuned on, but {check} is; give another."
        )
    if fresh < 1:
        raise InputError(f"Option --fresh-plants must be at least 1, but got {fresh}.")
    *tuned_on, unseen = load_all(
        [*motions, check], records, scale, units=units, dt=dt, variable=variable
    )
    benchmark = build_benchmark()
    state = run_tuning(benchmark, options, tuned_on, out, tell=_tell, notice=_notice)
    rows = write_report(benchmark, controller, state, unseen, fresh, out)
    console.print(_table(rows, controller, unseen.name, fresh))
    console.print(f"{state['ended'] or 'All steps done'}; results in {out}", soft_wrap=True)


def _starts(given) -> tuple[tuple[str, float], ...]:
    pairs = []
    for text in given or ():
        name, _, value = text.partition("=")
        try:
            pairs.append((name, float(value)))
        except ValueError:
            raise InputError(f"Option --start must be NAME=VALUE, but got {text!r}.") from None
    return tuple(pairs)


def _tell(row: dict) -> None:
    skip = ("step", "accepted", "objective", "diverged", "length")
    shown = [f"{n} {v:.3f}" for n, v in row.items() if n not in skip and not n.startswith("log10_")]
    line = f"step {row['step']}: objective {row['objective']:.4f}; {', '.join(shown)}"
    error_console.print(line if row["accepted"] else f"{line} (unstable: backed off)")


def _notice(text: str) -> None:
    error_console.print(text, highlight=False, markup=False, soft_wrap=True)


def _table(rows: list[dict], controller: str, motion: str, plants: int) -> ScreenTable:
    heads = ("index", "start", "tuned", "published (nominal, mean of three records)")
    cells = []
    for row in rows:
        published = f"{row['published']:.2f}" if row["published"] != "" else ""
        cells.append((row["index"], f"{row['start']:.2f}", f"{row['tuned']:.2f}", published))
    title = f"{controller} on {motion}, medians of {counted(plants, 'fresh plant')}"
    return ScreenTable(title, heads, cells)
