"""The 24 indices of LQG and ADFC with their defaults, nominal plant, kept to the last digit.

    python -m tests.engine.pins --records DIR

writes pins.json again, from the benchmark's three records and one built-in motion.  Do so only for
a change that is meant to change numbers, and say in its message which and why.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from martths_jax import build_benchmark, load_motion
from martths_jax.indices import NAMES
from martths_jax.nominal import Comparison, compare_with_table4

FILE = Path(__file__).with_name("pins.json")
RECORDS = ("elcentro", "kobe", "morganhill")
BUILTIN = ("elcentro-like",)


def compute(benchmark, motions: Sequence[str], records=None) -> dict:
    """Motion -> controller -> index -> value."""
    loaded = [load_motion(n, scale=0.4, fs=benchmark.fs, records=records) for n in motions]
    each = compare_with_table4(benchmark, loaded).each
    return {motion: {name: runs[motion] for name, runs in each.items()} for motion in motions}


def pinned() -> dict:
    """What the file holds, as ``compute`` gives it."""
    return json.loads(FILE.read_text(encoding="utf-8"))


def table4() -> Comparison:
    """The pins beside Table 4: means over the three records."""
    pins = pinned()
    each = {c: {m: pins[m][c] for m in RECORDS} for c in pins[RECORDS[0]]}
    ours = {
        c: {n: float(np.mean([runs[m][n] for m in RECORDS])) for n in NAMES}
        for c, runs in each.items()
    }
    return Comparison(RECORDS, ours, each)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", required=True, help="folder of the benchmark's .mat files")
    chosen = parser.parse_args()
    benchmark = build_benchmark()
    found = compute(benchmark, RECORDS, chosen.records) | compute(benchmark, BUILTIN)
    FILE.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
