"""Which unprinted setting of ADFC gives the printed column of Table 4?  Some, in the engine.

    python experiments/table4/settings.py --records DIR

Nominal plant, three records at 0.40, eight draws of the sensor noise that no setting was chosen on.
Writes results/settings.csv: for each setting the trials lost, the medians over the draws of the
means over the records, and the root-mean-square log deviation from print of the 20 errors (without
the delays J1, J4): median, least and largest over the draws.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np

from martths_jax import ADFC, SensorNoise, build_benchmark, indices, load_motion, simulate
from martths_jax.indices import NAMES
from martths_jax.plant import plant_from_draws
from martths_jax.published import ADFC as COLUMN
from martths_jax.published import TABLE4

RESULTS = Path(__file__).with_name("results")
RECORDS = ("elcentro", "kobe", "morganhill")
DRAWS, FIRST = 8, 101
ERRORS = [n for n in NAMES if n[:3] not in ("J1_", "J4_")]
# Name -> controller, whether both sensors have the same noise.
SETTINGS = {
    "default: q 3e-5, pull 6e-5 to the inverse plant": (ADFC(), True),
    "q 1e-5, pull 1e-6 to u = x_a": (ADFC(pull=1e-6, q=1e-5), True),
    "q 1e-5, pull 1e-5 to u = x_a": (ADFC(pull=1e-5, q=1e-5), True),
    "q 1e-5, no pull": (ADFC(pull=0.0, q=1e-5), True),
    "q 3e-5, no pull": (ADFC(pull=0.0, q=3e-5), True),
    "q 1e-4, no pull": (ADFC(pull=0.0, q=1e-4), True),
    "q 1e-4, no pull, a fit every 8th sample": (ADFC(pull=0.0, q=1e-4, no=1016), True),
    "q 1e-5, pull 1e-6, independent noise": (ADFC(pull=1e-6, q=1e-5), False),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", help="folder of the benchmark's .mat files")
    records = parser.parse_args().records
    benchmark = build_benchmark()
    # The drawing of the noise goes by the trial's number.
    draws = np.tile(np.arange(FIRST, FIRST + DRAWS), len(SETTINGS))
    plants = plant_from_draws(np.zeros((draws.size, 9)), trial=draws)
    controllers = [c.prepare(benchmark) for c, _ in SETTINGS.values() for _ in range(DRAWS)]
    shared = np.repeat([s for _, s in SETTINGS.values()], DRAWS)
    values, lost = [], []
    for name in RECORDS:
        motion = load_motion(name, scale=0.4, fs=1024, records=records)
        size = motion.acceleration.size
        kinds = [np.asarray(SensorNoise(shared=s).draw(plants.trial, size, 1024.0)) for s in (1, 0)]
        noise = np.where(shared, *np.broadcast_arrays(*kinds))
        result = simulate(benchmark, controllers, plants, motion, np.moveaxis(noise, -1, 0))
        found = indices(result)
        values.append([np.asarray(found[n]) for n in NAMES])
        lost.append(result.lost)
    mean = np.mean(values, axis=0).reshape(len(NAMES), len(SETTINGS), DRAWS)
    lost = np.sum(lost, axis=0).reshape(len(SETTINGS), DRAWS).sum(axis=1)
    printed = np.array([TABLE4[n][COLUMN] for n in ERRORS])[:, None]
    RESULTS.mkdir(exist_ok=True)
    with (RESULTS / "settings.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["setting", "lost_of_24", "rms", "rms_least", "rms_largest", *NAMES])
        writer.writerow(["print", "", "", "", "", *(TABLE4[n][COLUMN] for n in NAMES)])
        for i, name in enumerate(SETTINGS):
            rows = mean[[NAMES.index(n) for n in ERRORS], i]
            rms = np.sqrt(np.mean(np.log(rows / printed) ** 2, axis=0))
            rms = (np.nanmedian(rms), np.nanmin(rms), np.nanmax(rms))
            middle = np.nanmedian(mean[:, i], axis=1)
            writer.writerow([name, lost[i], *(f"{v:.3f}" for v in (*rms, *middle))])
    print((RESULTS / "settings.csv").read_text())


if __name__ == "__main__":
    main()
