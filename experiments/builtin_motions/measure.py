"""Measure everything that docs/motions.md claims about the built-in motions.

    python experiments/builtin_motions/measure.py --records DIR

Writes results/fit.csv (misfit of each built-in motion to its target) and results/closed_loop.csv
(J2, J5, J7, J8 of ADFC and LQG on the real records and on the built-in motions).
"""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path

import numpy as np
from closed_loop import CONTROLLERS, JUDGED, Judge

from martths_jax.motions import BUILTIN_NAMES, load_record
from martths_jax.motions.builtin import builtin_facts, fit_of, generate
from martths_jax.motions.builtin.facts import stored_seeds

RESULTS = Path(__file__).with_name("results")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", help="folder of the benchmark's .mat files")
    chosen = parser.parse_args()
    save("fit.csv", [fit_row(name) for name in BUILTIN_NAMES])
    judge = Judge()
    rows = [row for name in BUILTIN_NAMES for row in loop_rows(name, judge, chosen.records)]
    save("closed_loop.csv", rows)


def fit_row(name: str) -> dict:
    """Misfits of the built-in motion, and the processor time it took to make it."""
    facts = builtin_facts(name)
    seed = stored_seeds()[BUILTIN_NAMES[name]]
    start = time.process_time()
    made = generate(facts, seed)
    seconds = time.process_time() - start
    kept = load_record(name).acceleration
    assert np.array_equal(made, kept)
    misfits = {k: round(v, 4) for k, v in vars(fit_of(made, facts)).items()}
    return {"motion": name, "seed": seed, **misfits, "cpu_seconds": round(seconds, 2)}


def loop_rows(name: str, judge: Judge, records: str | None) -> list[dict]:
    """One row a controller and index: real record, built-in motion, relative departure."""
    real = judge(load_record(BUILTIN_NAMES[name], records=records))
    made = judge(load_record(name))
    return [
        {
            "motion": name,
            "controller": controller,
            "index": index,
            "real": round(real[i, j], 3),
            "built_in": round(made[i, j], 3),
            "departure": round(made[i, j] / real[i, j] - 1, 4),
        }
        for i, controller in enumerate(CONTROLLERS)
        for j, index in enumerate(JUDGED)
    ]


def save(name: str, rows: list[dict]) -> None:
    """Write rows under the results and print them."""
    RESULTS.mkdir(exist_ok=True)
    with (RESULTS / name).open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    for row in rows:
        print(*row.values(), flush=True)


if __name__ == "__main__":
    main()
