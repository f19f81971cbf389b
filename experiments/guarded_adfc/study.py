"""Tables of the study: candidates, seeds and conditions, 1000 plants x 3 real motions each.

    MARTHS_RECORDS=... python experiments/guarded_adfc/study.py candidates|seeds|conditions

writes results/<table>.csv, one row a run and motion.
"""

from __future__ import annotations

import csv
import os
import sys
import time
from functools import lru_cache
from pathlib import Path

import numpy as np
from candidates import CANDIDATES, CHOSEN
from fast_loop import run

from martths_jax import build_benchmark, draw_plants, load_motion

HERE = Path(__file__).parent
RECORDS = os.environ.get("MARTHS_RECORDS") or HERE.parents[2] / "shared" / "benchmark"
MOTIONS = ("elcentro", "kobe", "morganhill")
FIRST = ("J1_1", "J1_2", "J2_1", "J2_2", "J3_1", "J3_2", "J4_1", "J4_2", "J5_4", "J5_28",
         "J6_4", "J6_28")  # fmt: skip
PEAKS = ("J3_1", "J3_2", "J6_4", "J6_28")
CONDITIONS = {
    "as published": {},
    "independent sensor noise": {"shared": False},
    "noise power x 10": {"power": 1.5e-6},
    "fs = 512 Hz": {"fs": 512},
    "fs = 2048 Hz": {"fs": 2048},
    "fs = 4096 Hz": {"fs": 4096},
    "motion scale 0.1": {"scale": 0.1},
    "motion scale 1.0": {"scale": 1.0},
    "plant uncertainty x 2": {"spread": 2.0},
}

benchmark_at = lru_cache(lambda fs: build_benchmark(fs=fs))


def one(guard, motion, seed, *, trials=1000, fs=1024, scale=0.4, spread=1.0, **noise):
    """Row of numbers of one run."""
    bench = benchmark_at(fs)
    record = load_motion(motion, scale=scale, fs=fs, records=RECORDS)
    plants = draw_plants(trials, seed=seed, spread=spread)
    outcome = run(bench, guard(bench), plants, record, seed=seed, **noise)
    row = {"motion": motion, "seed": seed, "trials": trials, "lost": int(outcome.lost.sum()),
           "saturated": int((outcome.saturated & ~outcome.lost).sum())}  # fmt: skip
    with np.errstate(all="ignore"):
        found = outcome.indices
        row |= {f"median_{n}": float(np.nanmedian(found[n])) for n in FIRST}
        row |= {f"p99_{n}": float(np.nanpercentile(found[n], 99)) for n in PEAKS}
        row |= {f"max_{n}": float(np.nanmax(found[n])) for n in PEAKS}
    return row


def write(table, runs):
    path = HERE / "results" / f"{table}.csv"
    path.parent.mkdir(exist_ok=True)
    rows = []
    for label, guard, motion, seed, settings in runs:
        started = time.perf_counter()
        rows.append({"run": label} | one(guard, motion, seed, **settings))
        print(f"{label}, {motion}, seed {seed}: lost {rows[-1]['lost']}, "
              f"{time.perf_counter() - started:.0f} s", flush=True)  # fmt: skip
        with path.open("w", newline="") as file:
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows(
                {k: f"{v:.4g}" if isinstance(v, float) else v for k, v in r.items()} for r in rows
            )


def main(table):
    chosen = CANDIDATES[CHOSEN]
    if table == "candidates":
        runs = [(n, g, m, 1, {}) for n, g in CANDIDATES.items() for m in MOTIONS]
    elif table == "seeds":
        runs = [(CHOSEN, chosen, m, s, {}) for s in range(1, 6) for m in MOTIONS]
    else:
        runs = [(n, chosen, m, 1, c) for n, c in CONDITIONS.items() for m in MOTIONS]
        # What the literal controller does where the default misses its goal.
        runs += [
            (f"{n}, literal", CANDIDATES["literal"], m, 1, CONDITIONS[n])
            for n in ("motion scale 0.1", "plant uncertainty x 2")
            for m in MOTIONS
        ]
    write(table, runs)


if __name__ == "__main__":
    for table in sys.argv[1:] or ("candidates", "seeds", "conditions"):
        main(table)
