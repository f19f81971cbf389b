"""ADFC's J5 and J8 over a grid of pull and filter noise, every pair on the same uncertain plants.

    python experiments/tune_lqg/adfc_grid.py --records DIR

With two numbers a grid says more than a descent: it shows the whole trade-off and has no local
minima.  The grid runs as one batch.  Writes results/adfc_grid.csv: means over the plants by the
true indices, and the share of trials that were lost.
"""

from __future__ import annotations

import itertools

import numpy as np
from common import SEED, TUNED_ON, arguments, motion, run, write

from martths_jax import ADFC, build_benchmark, draw_plants

PULLS = 10.0 ** np.arange(-7.0, -1.9, 0.5)
NOISES = 10.0 ** np.arange(-6.0, -2.9, 0.5)


def main() -> None:
    chosen = arguments(__doc__, plants=12)
    benchmark = build_benchmark()
    pairs = list(itertools.product(PULLS, NOISES))
    controllers = [ADFC(pull=float(p), towards="inverse", q=float(q)) for p, q in pairs]
    plants = draw_plants(chosen.plants, SEED)
    found = run(benchmark, controllers, plants, motion(TUNED_ON, chosen.records))
    rows = []
    for i, (pull, q) in enumerate(pairs):
        row = {"pull": float(pull), "q": float(q)}
        row |= {k: float(np.mean(found[k][i])) for k in ("J2", "J5", "J7", "J8", "lost")}
        rows.append(row | {"volts": float(np.max(found["volts"][i]))})
    write("adfc_grid.csv", rows)


if __name__ == "__main__":
    main()
