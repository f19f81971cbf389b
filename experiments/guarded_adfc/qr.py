"""Would QR instead of normal equations save the literal controller?  Both fits on the same buffers.

    MARTHS_RECORDS=... python experiments/guarded_adfc/qr.py

takes the strokes and commands of literal trials that are lost, and solves each buffer up to the
loss again by Householder QR (columns scaled).
"""

from __future__ import annotations

import numpy as np
from scipy import linalg
from study import RECORDS

from martths_jax import ADFC, SensorNoise, build_benchmark, draw_plants, load_motion, simulate
from martths_jax.control.adaptive.differences import BACKWARD_DIFFERENCES, TAPS

NB, PLANTS, STEP = 1024, 200, 16


def regressors(strokes: np.ndarray) -> np.ndarray:
    """(N, 8) rows of the fit from (N, 2) strokes."""
    late = np.stack([np.roll(strokes, i, axis=0) for i in range(TAPS)], axis=-1)
    return np.einsum("nat,dt->nad", late, BACKWARD_DIFFERENCES).reshape(len(strokes), 8)


def main():
    bench = build_benchmark()
    motion = load_motion("elcentro", scale=0.4, fs=bench.fs, records=RECORDS)
    plants, literal = draw_plants(PLANTS, seed=1), ADFC(nb=NB, no=NB - 1, pull=0.0)
    lost = np.flatnonzero(simulate(bench, literal, plants, motion, SensorNoise(seed=1)).lost)
    # A trial has the same bits in any batch, so only those that are lost keep their signals.
    result = simulate(bench, literal, plants[lost], motion, SensorNoise(seed=1), keep=True)
    watch, signals = result.watch, result.signals
    first_bad = np.minimum(watch.command, watch.stroke).min(axis=1).astype(int)
    apart = []
    for i, last in enumerate(first_bad):
        phi, applied = regressors(signals["x_hat"][i]), np.roll(signals["u"][i], 1, axis=0)
        for k in range(NB + TAPS - 1, last, STEP):
            rows = slice(k - NB + 1, k + 1)
            size = np.linalg.norm(phi[rows], axis=0)
            q, r = linalg.qr(phi[rows] / size, mode="economic")
            by_qr = linalg.solve_triangular(r, q.T @ applied[rows]) / size[:, None]
            used = signals["C_A"][i, k]
            apart.append(np.abs(by_qr - used).max() / np.abs(by_qr).max())
    apart = np.array(apart)
    print(
        f"{lost.size} of {PLANTS} trials lost; {apart.size} buffers before a loss: "
        f"coefficients by QR and by normal equations differ by {np.median(apart):.1e} in the "
        f"median and {apart.max():.1e} at most (relative to the largest coefficient)"
    )


if __name__ == "__main__":
    main()
