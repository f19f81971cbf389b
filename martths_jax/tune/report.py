"""What a tuning leaves behind: design, history, convergence plot, and a check on fresh trials."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np

from martths_jax.benchmark import Benchmark
from martths_jax.campaign.files import write_text
from martths_jax.files import atomic
from martths_jax.indices import indices
from martths_jax.motions import Motion
from martths_jax.problem import Problem, find_problem
from martths_jax.sensors import SensorNoise
from martths_jax.simulation import simulate
from martths_jax.tune.parameters import Tuned, tuned
from martths_jax.tune.search import usual_noise

FRESH = 1_000_001  # first trial number of the fresh plants; tuning starts at 1


def write_report(
    benchmark: Benchmark,
    controller: Tuned | str,
    state: dict,
    check: Motion,
    plants: int,
    folder: Path,
    noise: SensorNoise | None = None,
    problem: Problem | None = None,
) -> list[dict]:
    """Write design.json, history.csv, convergence.png and comparison.csv into `folder`.

    Args:
        controller: ``Tuned``, or a text that names it.
        state: from ``tune``.
        check: a motion that was not tuned on.
        plants: number of fresh plants.
        noise: of the sensors; the problem's by default.
        problem: whose plants they are; the maRTHS benchmark by default.

    Returns:
        rows of the comparison: index, medians with the start and the tuned numbers by the true
        indices, and what the paper prints (other motions, nominal plant).  The last two rows are
        the share of trials that diverged and the largest valve command [V].
    """
    controller = tuned(controller) if isinstance(controller, str) else controller
    design = controller.values(state["best"])
    report = {"controller": controller.name, "ended": state["ended"] or "all steps done", **design}
    write_text(folder / "design.json", json.dumps(report, indent=1) + "\n")
    _write_csv(folder / "history.csv", state["history"])
    _plot(state["history"], list(map(controller.column, state["start"])), folder)
    rows = compare(benchmark, controller, state, check, plants, noise, problem)
    _write_csv(folder / "comparison.csv", rows)
    return rows


def compare(
    benchmark, controller: Tuned, state, check: Motion, plants: int, noise=None, problem=None
) -> list[dict]:
    """Start against tuned on fresh plants and an unseen motion; see ``write_report``."""
    seed = state["setting"]["seed"]
    problem = problem or find_problem()
    fresh = problem.draw(plants, seed, first=FRESH)
    noise = noise or usual_noise(problem, seed)
    paper = problem.published.values.get(controller.entry.name, {})
    medians = {}
    for name in ("start", "best"):
        ready = controller.on_host(benchmark, state[name])
        result = simulate(benchmark, ready, fresh, check, noise)
        found = indices(result)
        kept = ~result.lost
        medians[name] = {
            n: float(np.median(found[n][kept])) if kept.any() else np.nan for n in found
        }
        medians[name]["diverged [%]"] = 100 * float(np.mean(result.lost))
        medians[name]["largest volts"] = float(np.max(result.watch.volt_peak))
    return [
        {
            "index": n,
            "start": medians["start"][n],
            "tuned": medians["best"][n],
            "published": paper.get(n, ""),
        }
        for n in medians["start"]
    ]


def _write_csv(path: Path, rows: list[dict]) -> None:
    with atomic(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def _plot(history: list[dict], columns: list[str], folder: Path) -> None:
    """Objective over steps, refused ones marked, and the numbers below."""
    import matplotlib.pyplot as plt  # slow to import, and only needed here

    figure, (top, bottom) = plt.subplots(
        2, 1, sharex=True, figsize=(6.5, 5.5), layout="constrained"
    )
    good = [row for row in history if row["accepted"]]
    top.plot([r["step"] for r in good], [r["objective"] for r in good], ".-")
    for row in history:
        if not row["accepted"]:
            top.axvline(row["step"], color="0.8", zorder=0)
    top.set_ylabel("objective")
    for name in columns:
        steps, values = [r["step"] for r in good], [r[name] - good[0][name] for r in good]
        bottom.plot(steps, values, label=name.removeprefix("log10_"))
    bottom.set_xlabel("step")
    logs = all(name.startswith("log10_") for name in columns)
    bottom.set_ylabel("change of log10" if logs else "change (of log10, if positive)")
    bottom.legend(ncols=3, fontsize="small")
    with atomic(folder / "convergence.png") as part:
        figure.savefig(part, dpi=150)
    plt.close(figure)
