"""LQG's weights along the trade-off of J5 against J8, by gradients through the strong motion.

    python experiments/tune_lqg/lqg_front.py --records DIR

For each w the six weights minimise w J5 + (1 - w) J8 on uncertain plants and the first 16 s of El
Centro, each w from where the one before ended.  The gradient is that of ``martths tune``, the
descent L-BFGS: the weights lie in a narrow valley, which its curvature follows in fewer runs than
Adam's steps.  Writes results/lqg_front.csv (log10 of the weights).
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
from common import SEED, TUNED_ON, arguments, motion, write
from scipy import optimize

from martths_jax import build_benchmark, draw_plants
from martths_jax.sensors import SensorNoise
from martths_jax.tune import Objective
from martths_jax.tune.gradient import Gradient
from martths_jax.tune.parameters import start_of

WEIGHTS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9)


UNIT = 0.05  # length of L-BFGS's first step [decades]
UNSTABLE = 1e3  # objective of weights with which a trial diverges


def main() -> None:
    chosen = arguments(__doc__, plants=16, runs=30, seconds=16.0)
    benchmark = build_benchmark()
    ground = motion(TUNED_ON, chosen.records)
    ground = replace(ground, acceleration=ground.acceleration[: round(chosen.seconds * 1024)])
    objectives = {f"{w:g}": Objective.parse(f"{w:g}*j5+{1 - w:g}*j8") for w in WEIGHTS}
    first = next(iter(objectives.values()))
    plants, noise = draw_plants(chosen.plants, SEED), SensorNoise(seed=SEED)
    gradient = Gradient(benchmark, "lqg", first, plants, [ground], noise)
    logs, rows = start_of("lqg"), []
    for name, objective in objectives.items():
        began = time.time()
        before, after, logs, runs = descend(gradient.of(objective), logs, chosen.runs)
        seconds = time.time() - began
        print(f"{name}: {before:.4f} -> {after:.4f}, {runs} runs, {seconds:.0f} s", flush=True)
        rows.append({"objective": name, "before": before, "after": after, **logs})
        write("lqg_front.csv", rows)


def descend(gradient: Gradient, start: dict[str, float], runs: int):
    """Objective at the start and at the best point, that point, and the number of runs."""
    names, x0 = list(start), np.array(list(start.values()))
    tried = []

    def value(steps):
        logs = dict(zip(names, (x0 + UNIT * steps).tolist(), strict=True))
        loss, slope, _, lost = gradient(logs)
        slope = UNIT * np.array([slope[n] for n in names])
        if lost or not np.all(np.isfinite([loss, *slope])):
            loss, slope = UNSTABLE, np.zeros(len(names))
        tried.append((loss, logs))
        return loss, slope

    optimize.minimize(
        value, np.zeros(len(names)), jac=True, method="L-BFGS-B", options={"maxfun": runs}
    )
    loss, logs = min(tried, key=lambda pair: pair[0])
    return tried[0][0], loss, logs, len(tried)


if __name__ == "__main__":
    main()
