"""How closely every controller tracks, sensor noise taken off, on the same plants and noise.

    python experiments/controllers/true_tracking.py [NAME ...]

64 uncertain plants on the whole ``elcentro-like``.  Writes results/true_tracking.csv: median and
largest J2true of both strokes [%], trials lost.  With names only these controllers run, and the
rows of the others stay.  No contest: some defaults were chosen on these plants or this motion.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np

from martths_jax import SensorNoise, build_benchmark, draw_plants, indices, load_motion, simulate
from martths_jax.control.controllers import ENTRIES

TRIALS, SEED, MOTION = 64, 1, "elcentro-like"
RESULTS = Path(__file__).parent / "results" / "true_tracking.csv"
NAMES = ("J2true_1", "J2true_2")


def main(*only: str) -> None:
    benchmark, motion = build_benchmark(), load_motion(MOTION)
    plants, noise = draw_plants(TRIALS, seed=SEED), SensorNoise(seed=SEED)
    before = earlier() if only else {}
    rows = []
    for entry in (e for e in ENTRIES if e.problem == "marths"):
        if entry.name in before and entry.name not in only:
            rows.append(before[entry.name])
            continue
        result = simulate(
            benchmark, entry.build(benchmark), plants, motion, noise, indices=["true"]
        )
        found, row = indices(result), {"controller": entry.name}
        for name in NAMES:
            values = np.asarray(found[name])
            row |= {f"{name}_median": f"{np.nanmedian(values):.4f}",
                    f"{name}_largest": f"{np.nanmax(values):.4f}"}  # fmt: skip
        rows.append(row | {"lost": int(np.sum(result.lost))})
        print(rows[-1], flush=True)
    RESULTS.parent.mkdir(exist_ok=True)
    with RESULTS.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def earlier() -> dict[str, dict[str, str]]:
    """Rows of the table as it stands, by controller."""
    with RESULTS.open(encoding="utf-8", newline="") as file:
        return {row["controller"]: row for row in csv.DictReader(file)}


if __name__ == "__main__":
    main(*sys.argv[1:])
