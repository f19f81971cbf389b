"""How far each way down gets with as many evaluations: the package's two and SciPy's L-BFGS-B.

    python experiments/tune_lqg/descents.py --records DIR

LQG's six numbers from the default weights, 16 uncertain plants, the first 16 s of El Centro.
Writes results/descents.csv: the best objective after 1, 11, 21, ... evaluations.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from common import SEED, TUNED_ON, arguments, motion, write
from lqg_front import descend as by_scipy

from martths_jax import build_benchmark, draw_plants
from martths_jax.sensors import SensorNoise
from martths_jax.tune import Objective
from martths_jax.tune.descent import METHODS
from martths_jax.tune.gradient import Gradient
from martths_jax.tune.parameters import start_of

#: Objectives of the same indices share a program.
OBJECTIVES = (("0.1*j5+0.9*j8", "0.2*j5+0.8*j8", "0.5*j5+0.5*j8"), ("j2+0.5*j5",))
RATE = 0.1  # as of ``martths tune`` [decades]


def main() -> None:
    chosen = arguments(__doc__, plants=16, runs=60, seconds=16.0)
    benchmark, start = build_benchmark(), start_of("lqg")
    ground = motion(TUNED_ON, chosen.records)
    ground = replace(ground, acceleration=ground.acceleration[: round(chosen.seconds * 1024)])
    plants, noise = draw_plants(chosen.plants, SEED), SensorNoise(seed=SEED)
    rows = []
    for texts in OBJECTIVES:
        first = Gradient(benchmark, "lqg", Objective.parse(texts[0]), plants, [ground], noise)
        for text in texts:
            gradient = first.of(Objective.parse(text))
            for name in (*METHODS, "scipy"):
                watched = Watched(gradient)
                if name == "scipy":
                    by_scipy(watched, start, chosen.runs)
                else:
                    own(watched, name, start, chosen.runs)
                best = np.minimum.accumulate(watched.losses)
                at = range(0, chosen.runs + 1, 10)
                row = {f"after {i + 1}": float(best[min(i, best.size - 1)]) for i in at}
                rows.append({"objective": text, "method": name, **row})
                print(rows[-1], flush=True)
    write("descents.csv", rows)


class Watched:
    """A gradient that remembers the objective at every point, infinite where a trial was lost."""

    def __init__(self, gradient: Gradient):
        self.gradient, self.losses = gradient, []

    def __call__(self, point):
        found = loss, slope, _, lost = self.gradient(point)
        good = lost == 0 and np.all(np.isfinite([loss, *slope.values()]))
        self.losses.append(loss if good else np.inf)
        return found


def own(gradient: Watched, method: str, start: dict[str, float], runs: int) -> None:
    """A descent of the package."""
    way = METHODS[method](tuple(start), RATE)
    known = way.init(start)
    while not known["ended"] and len(gradient.losses) <= runs:
        loss, slope, _, _ = gradient(known["trial"])
        way.advance(known, loss, slope, np.isfinite(gradient.losses[-1]))


if __name__ == "__main__":
    main()
