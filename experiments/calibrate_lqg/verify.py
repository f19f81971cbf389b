"""The found weights in the engine itself: 24 indices against print, with the true delays.

    python experiments/calibrate_lqg/verify.py --records DIR

Reads results/search.json, writes results/table.csv and prints it with the root-mean-square log
deviations.  ``check`` are the weights that ``LQG.design`` began with, ``measured`` its fit for the
error of the measured strokes, ``other`` one from elsewhere for that of the estimate, ``default`` is
what it has; ``unlimited`` is ``published`` searched with --volts inf.
"""

from __future__ import annotations

import argparse
import csv
import json
from dataclasses import replace

import jax.numpy as jnp
import numpy as np
from linear_loop import dense_nominal
from search import DESIGNS, RECORDS, RESULTS, START, rms_log, to_gains
from soundness import OTHER

from martths_jax import LQG, build_benchmark, indices, load_motion, plant_from_draws, simulate
from martths_jax.control.estimators import KalmanFilter
from martths_jax.indices import NAMES
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
    controllers["measured"] = LQG.design(plant.benchmark, error="measured")
    controllers["other"] = LQG.design(plant.benchmark, **OTHER)
    controllers["default"] = LQG.design(plant.benchmark)
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
    local = [n for n in errors if n[:4] != "J10_"]
    for title, names in (("all 24", NAMES), ("20 errors", errors), ("16, no J10", local)):
        line = "".join(f"{rms_log(table[c], names):11.3f}" for c in controllers)
        print(f"{'RMS log, ' + title:>17}{line}")
    print(f"{'largest V':>17}" + "".join(f"{table[c]['volts']:11.2f}" for c in controllers))


def controller(benchmark, K, L, error="measured") -> LQG:
    """LQG with the gains K (2, 10) and filter gain L (8, 2), states slot by slot."""
    gain = np.transpose(L.reshape(4, 2, 2), (1, 0, 2))
    return LQG(
        K_z=jnp.asarray(np.swapaxes(K[:, :8].reshape(2, 4, 2), 1, 2)),
        K_e=jnp.asarray(K[:, 8:]),
        estimator=KalmanFilter(benchmark.plant_model, jnp.asarray(gain)),
        error=error,
    )


def run(benchmark, controllers, records) -> dict:
    """Mean indices over the three records, nominal plant, one noise draw."""
    motions = [load_motion(n, scale=0.4, fs=1024, records=records) for n in RECORDS]
    found = {}
    # One batch holds controllers of one structure.
    for error in ("measured", "estimate"):
        batch = {n: replace(c, weights=()) for n, c in controllers.items() if c.error == error}
        plants = plant_from_draws(np.zeros((len(batch), 9)), trial=np.zeros(len(batch), int))
        rows = []
        for motion in motions:
            result = simulate(benchmark, list(batch.values()), plants, motion)
            values = indices(result)
            volts = np.max(np.asarray(result.watch.volt_peak), axis=0)
            rows.append(np.array([*(values[i] for i in NAMES), volts]))
        mean, volts = np.mean(rows, axis=0), np.max(rows, axis=0)[-1]
        for i, name in enumerate(batch):
            found[name] = dict(zip(NAMES, mean[:, i], strict=False)) | {"volts": volts[i]}
    return {name: found[name] for name in controllers}


if __name__ == "__main__":
    main()
