"""``martths check-controller``: whether a controller keeps what is promised of all."""

from __future__ import annotations

import json
from typing import Annotated

import typer
from rich.markup import escape

from martths_jax.benchmark import build_benchmark
from martths_jax.cli.console import console, progress
from martths_jax.cli.motion_options import Records
from martths_jax.cli.options import one_of, option, setting
from martths_jax.conformity import check
from martths_jax.conformity.run import CHECKS, MOTION, SEED
from martths_jax.motions import load_motion

Name = Annotated[
    str,
    typer.Argument(
        metavar="NAME|FILE:CLASS",
        help="A name such as lqg, package.module:Class or path/file.py:Class, also with settings.",
    ),
]


def check_controller(
    controller: Name,
    quick: option(bool, "--quick", help="Leave out the checks that run the whole loop") = False,
    as_json: option(bool, "--json", help="Print the findings as JSON") = False,
    motion: setting("motions", MOTION) = None,
    records: Records = None,
    seed: setting("seed", SEED) = None,
    fs: setting("fs") = 1024.0,
) -> None:
    """Check a controller: causal, pure, the same for every trial, differentiable, stable.

    The exit code is 1 where a check fails, and each failure says what to change.
    """
    benchmark = build_benchmark(fs)
    ground = load_motion(one_of("--motion", motion) or MOTION, fs=fs, records=records)
    with progress(f"checking {controller}", len(CHECKS)) as tell:
        report = check(
            controller, benchmark, motion=ground, seed=SEED if seed is None else seed, quick=quick,
            progress=lambda done, total: tell(done),
        )  # fmt: skip
    if as_json:
        print(json.dumps(report.as_dict(), indent=2))
    else:
        console.print(report.table())
        colour = "green" if report.passed else "red"
        console.print(f"[bold {colour}]{escape(report.verdict)}", highlight=False, soft_wrap=True)
    if not report.passed:
        raise typer.Exit(1)
