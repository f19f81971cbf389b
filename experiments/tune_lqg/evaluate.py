"""The fronts on 200 fresh uncertain plants, by the true indices, on El Centro and an unseen record.

    python experiments/tune_lqg/evaluate.py lqg --records DIR
    python experiments/tune_lqg/evaluate.py adfc --records DIR
    python experiments/tune_lqg/evaluate.py figure

Reads lqg_front.csv and adfc_grid.csv from results.  Writes front_lqg.csv and front_adfc.csv (median
and P5-P95 of J5 and J8 for every design and record), comparison_lqg.csv and comparison_adfc.csv
(medians of the 24 indices beside print), and the figure front.{pdf,png}.
"""

from __future__ import annotations

import numpy as np
from common import RESULTS, TUNED_ON, UNSEEN, arguments, fresh, motion, read, run, write

from martths_jax import ADFC, build_benchmark
from martths_jax.benchmark import VOLT_LIMIT
from martths_jax.figures.style import (
    DOUBLE,
    Drawing,
    house_style,
    look,
    motion_label,
    new_figure,
    save,
)
from martths_jax.indices import NAMES
from martths_jax.published import COLUMNS, TABLE4
from martths_jax.tune.parameters import host_controller, start_of

PERCENTS = (5, 50, 95)


MOST = 5  # designs of ADFC's front that are evaluated, besides the default


def main() -> None:
    chosen = arguments(__doc__, what=str, plants=200)
    if chosen.what == "figure":
        draw(read("front_lqg.csv") + read("front_adfc.csv"))
        return
    benchmark = build_benchmark()
    named = {"lqg": lqg_designs, "adfc": adfc_designs}[chosen.what](benchmark)
    plants, rows, comparison = fresh(chosen.plants), [], []
    for name in (TUNED_ON, UNSEEN):
        found = run(benchmark, list(named.values()), plants, motion(name, chosen.records))
        for i, design in enumerate(named):
            rows.append({"controller": chosen.what, "design": design, "motion": name})
            for group in ("J5", "J8"):
                for p in PERCENTS:
                    rows[-1][f"{group} P{p}"] = float(np.nanpercentile(found[group][i], p))
            rows[-1]["lost [%]"] = 100 * float(np.mean(found["lost"][i]))
            rows[-1]["above 3.8 V [%]"] = 100 * float(np.mean(found["volts"][i] > VOLT_LIMIT))
            rows[-1]["largest volts"] = float(np.max(found["volts"][i]))
        comparison += compare(name, list(named), found, COLUMNS[chosen.what])
        print(name, "done", flush=True)
    write(f"front_{chosen.what}.csv", rows)
    write(f"comparison_{chosen.what}.csv", comparison)


def lqg_designs(benchmark) -> dict:
    """The default and the tuned weights."""
    names = tuple(start_of("lqg"))
    tuned = {f"w = {r['objective']:g}": {n: r[n] for n in names} for r in read("lqg_front.csv")}
    weights = {"default": start_of("lqg")} | tuned
    return {name: host_controller("lqg", benchmark, x) for name, x in weights.items()}


def adfc_designs(benchmark) -> dict:
    """The default and pairs from end to end of the grid's front."""
    front = adfc_front(read("adfc_grid.csv"))
    some = [front[i] for i in np.unique(np.linspace(0, len(front) - 1, MOST).round().astype(int))]
    pairs = {f"pull {p:.2g} q {q:.2g}": (p, q) for p, q in some}
    default = host_controller("adfc", benchmark, start_of("adfc"))
    return {"default": default} | {
        name: ADFC(pull=p, towards="inverse", q=q) for name, (p, q) in pairs.items()
    }


def adfc_front(grid) -> list[tuple[float, float]]:
    """Pairs of the grid without a lost trial that no other beats in J5 and J8, along J5."""
    kept = [r for r in grid if r["lost"] == 0]
    front = [r for r in kept if not any(o["J5"] < r["J5"] and o["J8"] < r["J8"] for o in kept)]
    return [(r["pull"], r["q"]) for r in sorted(front, key=lambda r: r["J5"])]


def compare(name, designs, found, column) -> list[dict]:
    """Medians of the indices with each design on a record, beside what Table 4 prints."""
    return [
        {"motion": name, "index": n}
        | {d: float(np.nanmedian(found[n][i])) for i, d in enumerate(designs)}
        | {"published": TABLE4[n][column]}
        for n in NAMES
    ]


def draw(rows) -> None:
    """J5 against J8, a panel a record: medians, P5-P95 as crosses of thin lines."""
    with house_style():
        figure = new_figure(DOUBLE, 68)
        axes = figure.subplots(1, 2, sharex=True, sharey=True)
        for axis, name in zip(axes, (TUNED_ON, UNSEEN), strict=True):
            for position, kind in enumerate(("lqg", "adfc")):
                mine = [r for r in rows if (r["controller"], r["motion"]) == (kind, name)]
                front = [r for r in mine if r["design"] != "default"]
                one(axis, [r for r in front if not r["lost [%]"]], look(position), kind.upper())
                for r in front:
                    if r["lost [%]"]:
                        one(axis, [r], look(position) | {"marker": "x"}, None)
                        place = r["J5 P50"], r["J8 P50"]
                        axis.annotate(f" {r['lost [%]']:.0f} % lost", place, va="bottom", size=6)
                start = [r for r in mine if r["design"] == "default"]
                one(axis, start, look(position) | {"ls": "none"}, f"{kind.upper()}, default", True)
            for position, column in enumerate(COLUMNS.values()):
                point = [
                    np.mean([v[column] for n, v in TABLE4.items() if n.startswith(group + "_")])
                    for group in ("J5", "J8")
                ]
                axis.plot(*point, "+", ms=7, mew=1.4, color=look(position)["color"],
                          label=f"{('LQG', 'ADFC')[position]}, printed")  # fmt: skip
            axis.set_title(motion_label(name))
            axis.set_xlabel("interface error $J_5$ [%]")
        axes[0].set_ylabel("global error $J_8$ [%]")
        axes[0].set_xscale("log")
        ticks = (1.5, 2, 3, 5, 7, 10, 15, 20, 30)
        axes[0].set_xticks(ticks, [f"{t:g}" for t in ticks], minor=False)
        axes[0].set_xticks([], minor=True)
        axes[0].legend(fontsize=6)
        data = {k: [r[k] for r in rows] for k in rows[0]}
        caption = "Median J5 against J8 of 200 fresh uncertain plants, P5-P95 as bars."
        save(Drawing(figure, data, caption), RESULTS, "front")


def one(axis, rows, look, label, open_marker=False) -> None:
    """A front, or a single design with an open marker."""
    x, y = (np.array([[r[f"{g} P{p}"] for p in PERCENTS] for r in rows]).T for g in ("J5", "J8"))
    order = np.argsort(x[1])
    x, y = x[:, order], y[:, order]
    axis.errorbar(
        x[1], y[1], xerr=[x[1] - x[0], x[2] - x[1]], yerr=[y[1] - y[0], y[2] - y[1]],
        color=look["color"], ls=look["ls"], marker=look["marker"], elinewidth=0.5,
        ms=6 if open_marker else 3.2, mfc="white" if open_marker else look["color"], label=label,
    )  # fmt: skip


if __name__ == "__main__":
    main()
