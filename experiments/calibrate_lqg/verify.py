"""The found weights in the engine itself: 24 indices against print, with the true delays.

    python experiments/calibrate_lqg/verify.py --records DIR

Reads results/search.json, writes results/table.csv and prints it with the root-mean-square log
deviations.  ``check`` are the weights that ``LQG.design`` had before, ``default`` is what it has;
``unlimited`` is ``published`` searched with --volts inf.
"""

from __future__ import annotations

import argparse
import csv
import json

import jax.numpy as jnp
import numpy as np
from linear_loop import dense_nominal
from search import DESIGNS, RECORDS, RESULTS, START, rms_log, to_gains

from martths_jax import LQG, build_benchmark, indices, load_motion, plant_from_draws, simulate
from martths_jax.indices import NAMES
from martths_jax.kalman import KalmanFilter
from martths_jax.published import LQG as COLUMN
from martths_jax.published import TABLE4


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", help="folder of the benchmark's .mat files")
    records = parser.parse_args().records
    found = json.loads((RESULTS / "search.json").read_text())
    plant = dense_nominal(build_benchmark())
    points = {"check": ("published", START)}
    points |= {name: (name, np.array(f["parameters"])) for name, f in found.items()}
    controllers = {}
    for name, (design, x) in points.items():
        design = "published" if design == "unlimited" else design
        if design == "gains":
            to_gains(plant, np.array(found["full"]["parameters"]))
        controllers[name] = controller(plant.benchmark, *DESIGNS[design](plant, x))
    controllers["default"] = LQG.design(plant.benchmark).prepare(plant.benchmark)
    table = run(plant.benchmark, controllers, records)
    with (RESULTS / "table.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["index", "print", *controllers])
        for n in NAMES:
            writer.writerow([n, TABLE4[n][COLUMN], *(f"{table[c][n]:.4g}" for c in controllers)])
    print(f"{'index':8}{'print':>9}" + "".join(f"{c:>11}" for c in controllers))
    for n in NAMES:
        line = "".join(f"{table[c][n]:11.2f}" for c in controllers)
        print(f"{n:8}{TABLE4[n][COLUMN]:9.2f}{line}")
    errors = [n for n in NAMES if n[:3] not in ("J1_", "J4_")]
    for title, names in (("all 24", NAMES), ("20 errors", errors)):
        line = "".join(f"{rms_log(table[c], names):11.3f}" for c in controllers)
        print(f"{'RMS log, ' + title:>17}{line}")


def controller(benchmark, K, L) -> LQG:
    """LQG with the gains K (2, 10) and filter gain L (8, 2), states slot by slot."""
    gain = np.transpose(L.reshape(4, 2, 2), (1, 0, 2))
    return LQG(
        K_z=jnp.asarray(np.swapaxes(K[:, :8].reshape(2, 4, 2), 1, 2)),
        K_e=jnp.asarray(K[:, 8:]),
        estimator=KalmanFilter(benchmark.plant_model, jnp.asarray(gain)),
    )


def run(benchmark, controllers, records) -> dict:
    """Mean indices over the three records, nominal plant, one noise draw."""
    n = len(controllers)
    plants = plant_from_draws(np.zeros((n, 9)), trial=np.zeros(n, int))
    rows = []
    for name in RECORDS:
        motion = load_motion(name, scale=0.4, fs=1024, records=records)
        found = indices(simulate(benchmark, list(controllers.values()), plants, motion))
        rows.append(np.array([found[i] for i in NAMES]))
    mean = np.mean(rows, axis=0)
    return {c: dict(zip(NAMES, mean[:, i], strict=True)) for i, c in enumerate(controllers)}


if __name__ == "__main__":
    main()
