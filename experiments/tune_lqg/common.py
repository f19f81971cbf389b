"""What the scripts of this experiment share: motions, plants, and how a design is judged."""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np

from martths_jax import draw_plants, indices, load_motion, simulate
from martths_jax.control.controllers import Controller
from martths_jax.indices import NAMES
from martths_jax.sensors import SensorNoise

RESULTS = Path(__file__).with_name("results")
TUNED_ON, UNSEEN = "elcentro", "kobe"
SEED = 1
FRESH = 1_000_001  # first trial number of the fresh plants; tuning starts at 1
GROUPS = {g: [n for n in NAMES if n.split("_")[0] == g] for g in ("J2", "J5", "J7", "J8")}


def arguments(doc: str, **more) -> argparse.Namespace:
    """--records, the numbers of `more` with their defaults, and positions where it has a type."""
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument("--records", help="folder of the benchmark's .mat files")
    for name, value in more.items():
        if isinstance(value, type):
            parser.add_argument(name, type=value)
        else:
            parser.add_argument(f"--{name}", type=type(value), default=value)
    return parser.parse_args()


def motion(name: str, records: str | None):
    """A record as the benchmark uses it."""
    return load_motion(name, scale=0.4, fs=1024, records=records)


def run(benchmark, controllers: list[Controller], plants, ground) -> dict[str, np.ndarray]:
    """Every controller on every plant as one batch.

    Returns:
        true indices, ``lost`` and ``volts`` (largest valve command), each (controllers, plants);
        lost trials are NaN.
    """
    n, each = len(controllers), len(plants)
    result = simulate(
        benchmark,
        [c for c in controllers for _ in range(each)] if n > 1 else controllers[0],
        plants[np.tile(np.arange(each), n)],
        ground,
        SensorNoise(seed=SEED),
    )
    found = {k: np.where(result.lost, np.nan, np.asarray(v)) for k, v in indices(result).items()}
    found |= {g: np.mean([found[k] for k in members], axis=0) for g, members in GROUPS.items()}
    found["lost"] = result.lost.astype(float)
    found["volts"] = np.max(np.asarray(result.watch.volt_peak), axis=1)
    return {k: v.reshape(n, each) for k, v in found.items()}


def fresh(count: int):
    """Plants that no tuning has seen."""
    return draw_plants(count, SEED, first=FRESH)


def write(name: str, rows: list[dict]) -> None:
    """Rows as results/name."""
    RESULTS.mkdir(exist_ok=True)
    with (RESULTS / name).open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(
            {k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows
        )


def read(name: str) -> list[dict]:
    """Rows of results/name, numbers as numbers."""
    with (RESULTS / name).open(newline="") as file:
        return [{k: _number(v) for k, v in row.items()} for row in csv.DictReader(file)]


def _number(text: str):
    try:
        return float(text)
    except ValueError:
        return text
