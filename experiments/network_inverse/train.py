"""Train the linear inverse network: ridge regression on strokes of drawn plants.

    python experiments/network_inverse/train.py

Writes martths_jax/control/controllers/network_inverse.npz, and results/training.json with the
settings, the seconds it took and the error left on plants that it has not seen.
"""

from __future__ import annotations

import json
import time
from pathlib import Path

import jax
import numpy as np
from scipy.signal import butter, freqz

from martths_jax import SensorNoise, draw_plants
from martths_jax.structure.modal import to_dense

FS = 1024.0
#: Samples that the network looks at, of each stroke.
TAPS = 50
#: Commands: periodic noise of so much rms [mm], of equal power up to so far [Hz], then falling.
#: The sensors' noise hides leads, and the more so the smaller the motion.
SIZE_MM, BAND_HZ = 5.0, 3.0
#: Variance of the ridge on every tap, as if the strokes had so much more noise [mm^2].
RIDGE = 1e-5
PLANTS, SECONDS, SEED = 64, 16, 2024
HERE = Path(__file__).parent
WEIGHTS = HERE.parents[1] / "martths_jax" / "control" / "controllers" / "network_inverse.npz"


def commands(rng: np.random.Generator, samples: int) -> np.ndarray:
    """(samples, 2) periodic noise [mm], Butterworth of fourth order at ``BAND_HZ``."""
    f = np.fft.rfftfreq(samples, 1 / FS)
    shape = np.abs(freqz(*butter(4, BAND_HZ, fs=FS), worN=f, fs=FS)[1])
    shape[0] = 0.0
    spectrum = shape[:, None] * np.exp(2j * np.pi * rng.random((len(f), 2)))
    u = np.fft.irfft(spectrum, samples, axis=0)
    return SIZE_MM * u / u.std(axis=0)


def strokes(plant, u: np.ndarray) -> np.ndarray:
    """(samples, 2) what a plant makes of periodic commands, once it has always done so [mm]."""
    A, B, C, _ = to_dense(plant)
    spectrum = np.fft.rfft(u, axis=0)
    heard = np.flatnonzero(np.abs(spectrum).max(axis=1) > 1e-9 * np.abs(spectrum).max())
    z = np.exp(2j * np.pi * heard / len(u))
    H = C @ np.linalg.solve(z[:, None, None] * np.eye(len(A)) - A, B)
    answer = np.zeros_like(spectrum)
    answer[heard] = np.einsum("fij,fj->fi", H, spectrum[heard])
    return np.fft.irfft(answer, len(u), axis=0)


def rows(x: np.ndarray, taps: int) -> np.ndarray:
    """(samples, 2 taps): x_1(k), x_1(k-1), ..., then those of x_2, of periodic strokes."""
    late = [np.roll(x, j, axis=0) for j in range(taps)]
    return np.concatenate([np.stack([one[:, i] for one in late], axis=1) for i in (0, 1)], axis=1)


def pairs(count: int, first: int, seconds: int, taps: int, seed: int):
    """Rows and commands of drawn plants, one plant after the other.

    u(k) goes with x(k), x(k-1), ..., which cannot have felt it: the network has to look a sample
    ahead, as it must where it commands.
    """
    plants = draw_plants(first + count, seed=seed).discretise(1 / FS)
    rng, sigma = np.random.default_rng(seed), np.sqrt(SensorNoise().variance(FS))
    one = lambda i: jax.tree.map(lambda a: a[..., i : i + 1], plants)  # noqa: E731
    for i in range(first, first + count):
        u = commands(rng, int(seconds * FS))
        x = strokes(one(i), u)
        yield rows(x + sigma * rng.standard_normal(x.shape), taps), u


def train(count=PLANTS, seconds=SECONDS, taps=TAPS, ridge=RIDGE, seed=SEED) -> np.ndarray:
    """(2 taps, 2) that minimise the mean of |u - W' phi|^2 + ridge |W|^2."""
    G, h, n = ridge * np.eye(2 * taps), np.zeros((2 * taps, 2)), int(seconds * FS) * count
    for phi, u in pairs(count, 0, seconds, taps, seed):
        G, h = G + phi.T @ phi / n, h + phi.T @ u / n
    return np.linalg.solve(G, h)


def left_over(W: np.ndarray, count: int = 16) -> float:
    """Share of the commands' rms that the network misses on plants after those of the training."""
    found = [
        np.mean((u - phi @ W) ** 2) / np.mean(u**2)
        for phi, u in pairs(count, PLANTS, SECONDS, len(W) // 2, SEED)
    ]
    return float(np.sqrt(np.mean(found)))


def main() -> None:
    start = time.perf_counter()
    W = train()
    seconds = time.perf_counter() - start
    np.savez(WEIGHTS, weights=W, fs=FS)
    said = {
        "plants": PLANTS, "seconds_each": SECONDS, "seed": SEED, "taps": TAPS,
        "size_mm": SIZE_MM, "band_hz": BAND_HZ, "ridge_mm2": RIDGE, "training_s": round(seconds, 1),
        "missed_on_unseen_plants": round(left_over(W), 4),
    }  # fmt: skip
    (HERE / "results").mkdir(exist_ok=True)
    (HERE / "results" / "training.json").write_text(json.dumps(said, indent=1) + "\n", "utf-8")
    print(said)


if __name__ == "__main__":
    main()
