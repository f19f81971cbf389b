"""Runs of the nominal plant, and how they compare with the published tables."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from martths_jax import published
from martths_jax.benchmark import LAYOUT, Benchmark
from martths_jax.control.base import Controller
from martths_jax.control.registry import find
from martths_jax.errors import argument_error
from martths_jax.indices import DEFAULT, Index, choose
from martths_jax.indices import indices as evaluate
from martths_jax.motions import Motion
from martths_jax.plant import nominal_plant
from martths_jax.sensors import SensorNoise
from martths_jax.simulation import simulate


@dataclass(frozen=True)
class Comparison:
    """Indices of the nominal plant beside Table 4.

    Attributes:
        motions: names of the motions that were averaged.
        ours: controller -> index -> mean over the motions.
        each: controller -> motion -> index -> value.
    """

    motions: tuple[str, ...]
    ours: dict[str, dict[str, float]]
    each: dict[str, dict[str, dict[str, float]]]

    def rows(self) -> list[dict[str, object]]:
        """One row an index and controller: ours, published, deviation [%] if there is one."""
        found = []
        for controller, values in self.ours.items():
            for name in values:
                target = published.MARTHS.printed(name, controller)
                value = values[name]
                row = {"controller": controller, "index": name, "martths_jax": value,
                       "published": "", "deviation_percent": ""}  # fmt: skip
                if target is not None:
                    row |= {"published": target, "deviation_percent": 100 * (value / target - 1)}
                found.append(row)
        return found

    def to_csv(self) -> str:
        """The rows as CSV."""
        text = io.StringIO()
        rows = self.rows()
        writer = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        return text.getvalue()

    def cells(self) -> dict[str, list[str]]:
        """Of each index, what its row shows: ours, published and deviation by controller."""
        found: dict[str, list[str]] = {n: [] for values in self.ours.values() for n in values}
        rows = {(r["controller"], r["index"]): r for r in self.rows()}
        for index, cells in found.items():
            for name in self.ours:
                r = rows[name, index]
                printed = r["published"] != ""
                cells += [
                    f"{r['martths_jax']:.2f}",
                    f"{r['published']:g}" if printed else "–",
                    f"{r['deviation_percent']:+.1f} %" if printed else "–",
                ]
        return found

    def to_markdown(self) -> str:
        """A table like the published one, with deviations."""
        head = "| index | " + " | ".join(f"{n} | {n} paper | deviation" for n in self.ours) + " |"
        lines = [head, "|---|" + "---:|" * (3 * len(self.ours))]
        lines += [f"| {index} | " + " | ".join(row) + " |" for index, row in self.cells().items()]
        return "\n".join(lines) + "\n"


def compare_with_table4(
    benchmark: Benchmark,
    motions: Sequence[Motion],
    controllers: Sequence[Controller] | None = None,
    noise: SensorNoise | None = None,
    progress: Callable[[int], None] = lambda done: None,
    indices: Iterable[str | Index] | str | Index = DEFAULT,
) -> Comparison:
    """Run the nominal plant under each controller and motion and average over the motions.

    Args:
        benchmark: from ``build_benchmark``.
        motions: the paper averages El Centro, Kobe and Morgan Hill scaled by 0.40.
        controllers: those of the table with their defaults if None.
        noise: sensor noise; the benchmark's if None.
        progress: told how many runs are done.
        indices: what is compared, see ``martths_jax.indices.choose``; the benchmark's 24.

    Raises:
        InputError: for another problem than the maRTHS benchmark, which the table is of.
    """
    if benchmark.layout != LAYOUT:
        got = f"one of {benchmark.layout.paper or 'another problem'}"
        raise argument_error("benchmark", "be the maRTHS benchmark, which Table 4 is of", got)
    controllers = controllers or [find(n).entry.build(benchmark) for n in published.COMPARED]
    chosen = choose(indices, benchmark.layout)
    each: dict[str, dict[str, dict[str, float]]] = {}
    done = 0
    for controller in controllers:
        for motion in motions:
            result = simulate(benchmark, controller, nominal_plant(), motion, noise, indices=chosen)
            values = {name: float(v[0]) for name, v in evaluate(result).items()}
            each.setdefault(controller.name, {})[motion.name] = values
            done += 1
            progress(done)
    ours = {
        name: {i.name: float(np.mean([v[i.name] for v in runs.values()])) for i in chosen}
        for name, runs in each.items()
    }
    return Comparison(tuple(m.name for m in motions), ours, each)
