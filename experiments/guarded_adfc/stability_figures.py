"""Frozen-loop figures: spectral radius along El Centro and delay margins, over plants.

MARTHS_RECORDS=... python experiments/guarded_adfc/stability_figures.py
"""

from __future__ import annotations

import numpy as np
from candidates import CANDIDATES, CHOSEN, inverse
from study import RECORDS

from martths_jax import (
    ADFC,
    LQG,
    Passthrough,
    SensorNoise,
    build_benchmark,
    draw_plants,
    load_motion,
    simulate,
)
from martths_jax.stability import delay_margin, radius_along, spectral_radius

PLANTS, FROM_S = 32, 2.0


def main():
    bench = build_benchmark()
    motion = load_motion("elcentro", scale=0.4, fs=bench.fs, records=RECORDS)
    plants = draw_plants(PLANTS, seed=1)
    samples = np.arange(round(FROM_S * bench.fs), motion.acceleration.size, 512)
    identified = {}
    for name in ("literal", CHOSEN):
        controller = CANDIDATES[name](bench)
        result = simulate(bench, controller, plants, motion, SensorNoise(seed=1), keep=True)
        C = identified[name] = result.signals["C_A"]
        radius = radius_along(bench, controller, plants, C, samples)
        first_bad = np.minimum(result.watch.command, result.watch.stroke).min(axis=1)
        alive = first_bad[:, None] > samples
        print(
            f"{name}: {result.lost.sum()} of {PLANTS} lost; frozen loop unstable at "
            f"{100 * np.mean(radius[alive] > 1):.2f} % of instants, largest radius "
            f"{np.max(radius[alive]):.5f}, {np.sum(np.any((radius > 1) & alive, axis=1))} trials "
            "with such an instant",
            flush=True,
        )
    middle = identified[CHOSEN][:, round(12 * bench.fs)]
    loops = {
        "passthrough": Passthrough(q=ADFC().q).prepare(bench),
        "LQG (defaults)": LQG.design(bench),
        "LQG (measured error)": LQG.design(bench, error="measured"),
        "inverse, never adapted": ADFC().frozen(bench, inverse(bench)),
        "ADFC frozen at 12 s": ADFC().frozen(bench, np.moveaxis(middle, 0, -1)),
    }
    for name, controller in loops.items():
        radius = spectral_radius(bench, controller, plants)
        margin = delay_margin(bench, controller, plants, points=2000)
        print(
            f"{name}: radius {radius.min():.5f} to {radius.max():.5f}, delay margin "
            f"{margin.min():.3g} to {margin.max():.3g} ms",
            flush=True,
        )


if __name__ == "__main__":
    main()
