"""Is a design sound? 1000 uncertain plants, three records, and delay margins.

    python experiments/calibrate_lqg/soundness.py --records DIR

``before`` are the weights that ``LQG.design`` began with, ``measured`` its fit for the error of the
measured strokes, ``other`` another fit for that of the estimate, ``default`` what it has.  Prints
for each the trials lost, the share of trials that reach the valve's limit, the spectral radius and
the delay margin; writes the indices' 5, 50 and 95 % points to results/soundness.csv.
"""

from __future__ import annotations

import argparse
import csv

import numpy as np
from search import RECORDS, RESULTS

from martths_jax import LQG, build_benchmark, draw_plants, indices, load_motion, simulate
from martths_jax.benchmark import VOLT_LIMIT
from martths_jax.indices import NAMES
from martths_jax.stability import delay_margin, spectral_radius

BEFORE = {
    "error": "measured",
    "e": (10**9.343, 10**3.648),
    "r": (1.0, 10**-0.913),
    "y": (10**2.836, 10**0.921),
    "q": 10**-1.82,
}
# Fitted elsewhere, to all but J1, J4 and J10.
OTHER = {
    "error": "estimate",
    "e": (10**9.612, 10**3.659),
    "r": (1.0, 10**-0.778),
    "y": (10**3.264, 10**2.007),
    "q": 10**-1.828,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", help="folder of the benchmark's .mat files")
    parser.add_argument("--plants", type=int, default=1000)
    chosen = parser.parse_args()
    benchmark = build_benchmark()
    plants = draw_plants(chosen.plants, seed=1)
    motions = [load_motion(n, scale=0.4, fs=1024, records=chosen.records) for n in RECORDS]
    designs = {
        "before": LQG.design(benchmark, **BEFORE),
        "measured": LQG.design(benchmark, error="measured"),
        "other": LQG.design(benchmark, **OTHER),
        "default": LQG.design(benchmark),
    }
    rows = []
    for name, controller in designs.items():
        margin = delay_margin(benchmark, controller, plants[: min(200, len(plants))], points=2000)
        radius = spectral_radius(benchmark, controller, plants)
        print(
            f"{name}: delay margin {margin.min():.3f} (least), {np.median(margin):.3f} (median) ms "
            f"of {len(margin)} plants; largest spectral radius {radius.max():.6f}",
            flush=True,
        )
        for motion in motions:
            result = simulate(benchmark, controller, plants, motion)
            volts = np.max(np.asarray(result.watch.volt_peak), axis=1)
            found = {n: np.asarray(v)[~result.lost] for n, v in indices(result).items()}
            print(
                f"  {motion.name}: {result.lost.sum()} of {len(plants)} lost, "
                f"{100 * np.mean(volts > VOLT_LIMIT):.1f} % reach {VOLT_LIMIT} V, "
                f"largest {volts.max():.2f} V",
                flush=True,
            )
            for n in NAMES:
                p5, p50, p95 = np.percentile(found[n], (5, 50, 95))
                rows.append([name, motion.name, n, f"{p5:.4g}", f"{p50:.4g}", f"{p95:.4g}"])
    with (RESULTS / "soundness.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["design", "motion", "index", "p5", "p50", "p95"])
        writer.writerows(rows)


if __name__ == "__main__":
    main()
