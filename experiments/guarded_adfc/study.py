"""Tables of the study: candidates, seeds and conditions, 1000 plants x 3 real motions each.

    MARTHS_RECORDS=... python experiments/guarded_adfc/study.py candidates|seeds|conditions

writes results/<table>.csv, one row a run and motion.  Rows that are there are kept, so a run that
was stopped goes on where it was; remove a table to run it again.
"""

from __future__ import annotations

import csv
import os
import sys
import time
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np
from candidates import CANDIDATES, CHOSEN

from martths_jax import (
    SensorNoise,
    Status,
    build_benchmark,
    draw_plants,
    indices,
    load_motion,
    simulate,
)

HERE = Path(__file__).parent
RECORDS = os.environ.get("MARTHS_RECORDS") or HERE.parents[2] / "shared" / "benchmark"
MOTIONS = ("elcentro", "kobe", "morganhill")
TABLES = ("candidates", "seeds", "conditions")
TRIALS = 1000
FIRST = ("J1_1", "J1_2", "J2_1", "J2_2", "J3_1", "J3_2", "J4_1", "J4_2", "J5_4", "J5_28",
         "J6_4", "J6_28")  # fmt: skip
PEAKS = ("J3_1", "J3_2", "J6_4", "J6_28")
CONDITIONS = {
    "as published": {},
    "independent sensor noise": {"shared": False},
    "noise power x 10": {"noise_power": 1.5e-6},
    "fs = 512 Hz": {"fs": 512},
    "fs = 2048 Hz": {"fs": 2048},
    "fs = 4096 Hz": {"fs": 4096},
    "motion scale 0.1": {"scale": 0.1},
    "motion scale 1.0": {"scale": 1.0},
    "plant uncertainty x 2": {"spread": 2.0},
}

benchmark_at = lru_cache(lambda fs: build_benchmark(fs=fs))
plants_of = lru_cache(draw_plants)


@dataclass(frozen=True)
class Run:
    """One row of a table.

    Attributes:
        label: in the table.
        guard: key of ``CANDIDATES``.
        motion, seed: of the run.
        settings: what differs from the published conditions, see ``one``.
    """

    label: str
    guard: str
    motion: str
    seed: int = 1
    settings: dict = field(default_factory=dict)

    @property
    def keys(self) -> list[tuple[str, str, str]]:
        """Rows that hold its numbers: its own, and that of the same run in another table."""
        names = [self.label] if self.settings else [self.label, self.guard]
        return [(name, self.motion, str(self.seed)) for name in names]


def one(guard, motion, seed, *, fs=1024, scale=0.4, spread=1.0, **noise):
    """Row of numbers of one run."""
    bench = benchmark_at(fs)
    record = load_motion(motion, scale=scale, fs=fs, records=RECORDS)
    plants = plants_of(TRIALS, seed=seed, spread=spread)
    result = simulate(bench, guard(bench), plants, record, SensorNoise(seed=seed, **noise))
    row = {"motion": motion, "seed": seed, "trials": TRIALS, "lost": int(result.lost.sum()),
           "saturated": int(np.sum(result.status == Status.SATURATED))}  # fmt: skip
    found = indices(result)
    with np.errstate(all="ignore"):
        row |= {f"median_{n}": float(np.nanmedian(found[n])) for n in FIRST}
        row |= {f"p99_{n}": float(np.nanpercentile(found[n], 99)) for n in PEAKS}
        row |= {f"max_{n}": float(np.nanmax(found[n])) for n in PEAKS}
    return {k: f"{v:.4g}" if isinstance(v, float) else str(v) for k, v in row.items()}


def stored(table: str) -> dict[tuple[str, str, str], dict[str, str]]:
    """Rows of a table that are there, by run, motion and seed."""
    path = HERE / "results" / f"{table}.csv"
    if not path.exists():
        return {}
    with path.open(newline="") as file:
        return {(r["run"], r["motion"], r["seed"]): r for r in csv.DictReader(file)}


def write(table: str, rows: list[dict[str, str]]) -> None:
    """A whole table at once: who stops the study finds the rows before this one."""
    path = HERE / "results" / f"{table}.csv"
    path.parent.mkdir(exist_ok=True)
    with path.with_suffix(".new").open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    path.with_suffix(".new").replace(path)


def runs_of(table: str) -> list[Run]:
    if table == "candidates":
        return [Run(name, name, m) for name in CANDIDATES for m in MOTIONS]
    if table == "seeds":
        return [Run(CHOSEN, CHOSEN, m, seed) for seed in range(1, 6) for m in MOTIONS]
    runs = [Run(name, CHOSEN, m, 1, c) for name, c in CONDITIONS.items() for m in MOTIONS]
    # What the literal controller does where the default misses its goal.
    return runs + [
        Run(f"{name}, literal", "literal", m, 1, CONDITIONS[name])
        for name in ("motion scale 0.1", "plant uncertainty x 2")
        for m in MOTIONS
    ]


def main(table: str) -> None:
    runs, own = runs_of(table), stored(table)
    others = {key: row for name in TABLES if name != table for key, row in stored(name).items()}
    missing = [run for run in runs if run.keys[0] not in own]
    spent = []
    for number, run in enumerate(missing, 1):
        found = next((others[key] for key in run.keys if key in others), None)
        if found is None:
            started = time.perf_counter()
            found = one(CANDIDATES[run.guard], run.motion, run.seed, **run.settings)
            spent.append(time.perf_counter() - started)
            left = np.mean(spent) * (len(missing) - number) / 60
            print(
                f"{table} {number}/{len(missing)}: {run.label}, {run.motion}, seed {run.seed}: "
                f"lost {found['lost']}, {spent[-1]:.0f} s, about {left:.0f} min left",
                flush=True,
            )
        own[run.keys[0]] = {"run": run.label} | {k: v for k, v in found.items() if k != "run"}
        write(table, [own[r.keys[0]] for r in runs if r.keys[0] in own])


if __name__ == "__main__":
    unknown = [name for name in sys.argv[1:] if name not in TABLES]
    if unknown:
        sys.exit(f"Tables are {', '.join(TABLES)}, but got {unknown[0]!r}.")
    try:
        for table in sys.argv[1:] or TABLES:
            main(table)
    except KeyboardInterrupt:
        sys.exit("Stopped; the same command goes on.")
