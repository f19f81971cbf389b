"""``martths tune``: tune a controller by gradients through whole simulations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from martths_jax.campaign.config import as_settings, make_config, with_usual
from martths_jax.campaign.draws import make_draws
from martths_jax.campaign.plan import study_benchmark, study_motion, study_problem
from martths_jax.campaign.provenance import command_line
from martths_jax.campaign.template import write_config
from martths_jax.cli.console import console, error_console
from martths_jax.cli.options import DRAWN, STUDY, one_of, option, takes
from martths_jax.cli.run_options import Config, Fresh, Quiet, kept, set_devices, settings_of
from martths_jax.errors import InputError
from martths_jax.published import COMPARED, Published
from martths_jax.screen import ScreenTable
from martths_jax.text import counted
from martths_jax.tune import Options
from martths_jax.tune import tune as run_tuning
from martths_jax.tune.descent import METHODS
from martths_jax.tune.gradient import MODES
from martths_jax.tune.report import write_report

#: What a tuning has where a study has another default.
DEFAULTS = {"trials": 32, "controllers": COMPARED[:1], "motions": ("elcentro-like",), "out": "tune",
            "signals": False}  # fmt: skip


@takes((*STUDY, *DRAWN), DEFAULTS)
def tune(
    objective: option(
        str, "--objective", help="Sum of weighted indices, such as j2+0.5*j5+J8_26"
    ) = "j2+j5",
    config: Config = None,
    settings: dict | None = None,
    check: option(
        str,
        "--check-motion",
        "--check",
        metavar="NAME|FILE",
        help="Motion of the final comparison, not tuned on",
    ) = "kobe-like",
    check_trials: option(
        int, "--check-trials", "--fresh-plants", help="Fresh plants of the final comparison"
    ) = 128,
    steps: option(int, "--steps", help="Evaluations in all; a later call goes on") = 50,
    method: option(str, "--method", help=f"How it descends: {', '.join(METHODS)}") = "lbfgs",
    rate: option(
        float, "--rate", help="Length of the first step, with adam of every step [decades]"
    ) = 0.1,
    patience: option(int, "--patience", help="Stop after so many steps without 0.1 % gain") = 15,
    start: option(
        list[str] | None,
        "--start",
        metavar="NAME=VALUE",
        help="Values to start from; repeated or with commas",
    ) = None,
    free: option(
        list[str] | None,
        "--free",
        metavar="NAME",
        default="all",
        help="Numbers that are tuned; repeated or with commas",
    ) = None,
    volts: option(
        float | None,
        "--volts",
        default="the limit of the problem's valves",
        help="Valve command where the penalty starts [V]",
    ) = None,
    penalty: option(float, "--penalty", help="Weight of the squared excess [1/V^2]") = 10.0,
    mode: option(
        str | None,
        "--mode",
        default="the cheaper one",
        help=f"Mode of differentiation: {', '.join(MODES)}",
    ) = None,
    fresh: Fresh = False,
    quiet: Quiet = False,
) -> None:
    """Tune the numbers of a controller on a set of plants and motions, by gradients."""
    study = make_config(with_usual(settings_of(config, settings), DEFAULTS))
    problem = study_problem(study)
    name = one_of("--controller", study.controllers)
    table = dict(study.controller.get(name, {}))
    options = Options(
        name, objective, study.trials, study.seed, _starts(start), tuple(free or ()), steps, rate,
        patience, volts, penalty, method, mode, tuple(table.items()),
    )  # fmt: skip
    _, controller = options.check(problem.layout)
    motions = study.motions or DEFAULTS["motions"]
    if check in motions:
        raise InputError(
            f"Option --check-motion must name a motion that is not tuned on, but {check} is; give "
            "another."
        )
    if check_trials < 1:
        raise InputError(f"Option --check-trials must be at least 1, but got {check_trials}.")
    set_devices(study.devices)
    *tuned_on, unseen = [study_motion(given, study) for given in (*motions, check)]
    if not quiet:
        for text in (text for motion in (*tuned_on, unseen) for text in motion.notices):
            _notice(text)
    benchmark = study_benchmark(study)
    draws = make_draws(study, problem)
    options = replace(options, trials=draws.trials)
    noise = problem.noise(study.noise_power, study.noise_shared, study.seed)
    out = Path(study.out)
    with kept(out):
        state = run_tuning(
            benchmark, options, tuned_on, out, plants=draws.plants(np.arange(1, draws.trials + 1)),
            noise=noise, problem=problem, fresh=fresh,
            tell=(lambda row: None) if quiet else _tell, notice=_notice,
            command_line=command_line(),
        )  # fmt: skip
    write_config(as_settings(replace(study, trials=draws.trials)), out / "config.toml",
                 f"A tuning: `martths tune --config FILE --objective {objective}`.")  # fmt: skip
    rows = write_report(benchmark, controller, state, unseen, check_trials, out, noise, problem)
    if quiet:
        return
    told = _table(rows, controller.name, unseen.name, check_trials, problem.published)
    console.print(told)
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
    indices = [f"{n} {v:.3f}" for n, v in row.items() if n[0] == "J" and n[1:2].isdigit()]
    line = f"step {row['step']}: objective {row['objective']:.4f}; {', '.join(indices)}"
    if row["diverged"]:
        line += " (unstable: backed off)"
    elif not row["accepted"]:
        line += " (a trial on the way)"
    error_console.print(line, highlight=False, markup=False, soft_wrap=True)


def _notice(text: str) -> None:
    error_console.print(text, highlight=False, markup=False, soft_wrap=True)


def _table(
    rows: list[dict], controller: str, motion: str, plants: int, paper: Published
) -> ScreenTable:
    heads = ["index", "start", "tuned"]
    known = any(row["published"] != "" for row in rows)
    if known:
        heads.append(f"{paper.table} (nominal, over {paper.over})")
    cells = []
    for row in rows:
        printed = f"{row['published']:.2f}" if row["published"] != "" else "–"
        cell = (row["index"], f"{row['start']:.2f}", f"{row['tuned']:.2f}", printed)
        cells.append(cell[: len(heads)])
    title = f"{controller} on {motion}, medians of {counted(plants, 'fresh plant')}"
    return ScreenTable(title, tuple(heads), cells)
