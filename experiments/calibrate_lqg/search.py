"""Weights that reproduce the published LQG column, by least squares on the linear loop.

    python experiments/calibrate_lqg/search.py --records DIR --minutes 10

Six structures, each started from the best of the one before and from random points around it:
``shared``: the weights of ``LQG.design`` with the filter that ADFC has; ``published``: these and
the filter's q; ``full``: two-by-two weights of strokes, stroke
rates, integrated errors and commands, two process noises and the filter's measurement noise;
``gains``: the 20 gains themselves and the filter's noises, no Riccati equation at all, which bounds
what any weights can reach; ``estimate`` and ``estimate_q``: as ``published``, with the error of the
estimated strokes integrated instead of the measured ones', at q = 3e-3, whence the defaults of
``LQG.design``, and with q free.  Writes results/search.json, and goes on from it if it is there;
--only names the structures to search.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np
from linear_loop import LinearLoop
from scipy import linalg, optimize

from martths_jax import load_motion
from martths_jax.control.estimators.kalman import steady_state_gains
from martths_jax.published import LQG, TABLE4

RESULTS = Path(__file__).with_name("results")
RECORDS = ("elcentro", "kobe", "morganhill")
LAGS = np.array([2, 3, 2, 3])  # samples: 1.95 and 2.93 ms, printed as 2.0, 1.9 and 2.9
# Weight of a delay beyond the edge of its whole sample [1/sample]: on the edge the printed delay
# jumps by a third, which no smooth penalty shows, so the wall before it has to be steep.
FIRMNESS = 3.0
# Largest valve command of the nominal plant [V]: the indices do not see what noise does to the
# command, and without this the fit takes gains that drive every valve far beyond its 3.8 V.
# Uncertain plants and other noise need what is left.
VOLTS = 3.0
# Extra delay in both actuators that the nominal plant has to bear [samples], 2.9 ms: the margin of
# the weights before.  It also keeps off loops whose growth is too fast for the frequency grid.
DELAY, DECAY = 3, 0.998
SHARED_Q = np.log(3e-5)
# Process noise with which the filter listens to the plants, so that the loop is one: with the error
# of the estimate, print does not tell it from 3e-5 (README).
LISTENING_Q = np.log(3e-3)
START = np.log(10) * np.array([9.343, 3.648, -0.913, 2.836, 0.921, -1.82])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", help="folder of the benchmark's .mat files")
    parser.add_argument("--minutes", type=float, default=10.0, help="time for each structure")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--volts", type=float, default=VOLTS, help="largest valve command [V]")
    parser.add_argument("--only", nargs="+", default=list(DESIGNS), choices=list(DESIGNS))
    chosen = parser.parse_args()
    motions = [load_motion(n, scale=0.4, fs=1024, records=chosen.records) for n in RECORDS]
    loop = LinearLoop(motions)
    path = RESULTS / "search.json"
    found = json.loads(path.read_text()) if path.exists() else {}
    start = START[:5]
    for name in chosen.only:
        design, starts = DESIGNS[name], STARTS.get(name, [start])
        if name in found and name != "gains":  # those are changes of the gains of `full`
            starts.append(np.array(found[name]["parameters"]))
        found[name] = search(
            loop, name, design, starts, 60 * chosen.minutes, chosen.seed, chosen.volts
        )
        RESULTS.mkdir(exist_ok=True)
        path.write_text(json.dumps(found, indent=1) + "\n")
        if name in WIDEN:
            start = WIDEN[name](loop, np.array(found[name]["parameters"]))


def search(loop, name, design, starts, seconds, seed, limit):
    """Best of repeated least squares, first from the best start, then from around the best."""
    rng = np.random.default_rng(seed)
    costs = [0.5 * float(np.sum(residuals(loop, design, x, limit) ** 2)) for x in starts]
    best_cost, best = min(zip(costs, starts, strict=True), key=lambda pair: pair[0])
    end, tries = time.time() + seconds, 0
    spread = 0.02 if name == "gains" else 0.7
    while time.time() < end:
        point = best if tries == 0 else best + spread * rng.normal(size=best.size)
        try:
            fit = optimize.least_squares(
                lambda x: residuals(loop, design, x, limit, end), point, diff_step=1e-4, max_nfev=12
            )
            cost, x = fit.cost, fit.x
        except TimeUp as up:
            cost, x = up.args
        tries += 1
        if cost < best_cost:
            best, best_cost = x, cost
            print(name, tries, f"cost {cost:.4f}", flush=True)
    row, delays, volts = loop.indices(*design(loop, best))
    return {
        "parameters": best.tolist(),
        "starts": tries,
        "indices": row,
        "delays_in_samples": delays.tolist(),
        "largest_volts": volts.tolist(),
        "rms_log": rms_log(row),
    }


class TimeUp(Exception):
    """Raised with (cost, point) when a structure's time is over."""


def residuals(loop, design, x, limit, end=np.inf):
    """Log ratios of the 20 errors to print, delays that round otherwise, volts too many."""
    try:
        gains = design(loop, x)
        row, delays, volts = loop.indices(*gains)
        grown = [max(plant_radius(loop, *gains, delay=d) / DECAY - 1, 0) for d in (0, DELAY)]
    except (np.linalg.LinAlgError, ValueError):
        return np.full(22 + (LAGS.size + 2) * len(loop.records), 3.0)
    ratios = [np.log(row[n] / v[LQG]) for n, v in TABLE4.items() if n[:3] not in ("J1_", "J4_")]
    off = FIRMNESS * np.maximum(np.abs(delays - LAGS) - 0.46, 0).ravel()
    over = FIRMNESS * np.maximum(volts.ravel() / limit - 1, 0)
    grown = 100 * FIRMNESS * np.array(grown)
    found = np.nan_to_num(np.concatenate([ratios, off, over, grown]), nan=3.0)
    found = np.clip(found, -3, 30)  # beyond is nothing but far away
    if time.time() > end:
        raise TimeUp(0.5 * float(found @ found), x)
    return found


def plant_radius(loop, K, L, error="measured", delay=0) -> float:
    """Spectral radius of controller, filter and nominal plant, no structure, commands delayed.

    Args:
        K, L, error: as ``LinearLoop.indices`` has them.
        delay: whole samples between command and plant; the filter hears the command at once.
    """
    A, B, C = loop.plant_dense
    keep, n = np.eye(8) - L @ C, 18 + 2 * delay
    plant, guess, integral = np.eye(n)[:8], np.eye(n)[8:16], np.eye(n)[16:18]
    hat = L @ C @ plant + keep @ guess
    integral = integral - loop.benchmark.dt * C @ (plant if error == "measured" else hat)
    command = -K[:, :8] @ hat - K[:, 8:] @ integral
    chain = [command, *(np.eye(n)[18 + 2 * i :][:2] for i in range(delay))]
    rows = [A @ plant + B @ chain[-1], A @ hat + B @ command, integral, *chain[:-1]]
    return float(np.abs(np.linalg.eigvals(np.concatenate(rows))).max())


def rms_log(row, names=tuple(TABLE4)) -> float:
    """Root-mean-square log deviation of some indices from print, of all 24 by default."""
    return float(np.sqrt(np.mean([np.log(row[n] / TABLE4[n][LQG]) ** 2 for n in names])))


def regulator(loop, Q, R):
    A, B, C = loop.benchmark.plant_continuous
    A = np.block([[A, np.zeros((8, 2))], [-C, np.zeros((2, 2))]])
    B = np.vstack([B, np.zeros((2, 2))])
    return np.linalg.solve(R, B.T @ linalg.solve_continuous_are(A, B, Q, R))


def filter_gain(loop, q1, q2, r):
    A, B, C = loop.plant_dense
    return steady_state_gains(A, B * np.sqrt([q1, q2]), C, 1.0, r)[0]


def published(loop, x):
    e1, e2, r2, y1, y2, q = np.exp(x)
    C = loop.plant_dense[2]
    Q = linalg.block_diag(C.T @ np.diag([y1, y2]) @ C, np.diag([e1, e2]))
    return regulator(loop, Q, np.diag([1, r2])), filter_gain(loop, q, q, loop.benchmark.r_mm2)


def shared(loop, x):
    return published(loop, np.append(x, SHARED_Q))


def pair(a, b, c):
    """Positive definite (2, 2) with diagonal exp(a), exp(b) and correlation tanh(c)."""
    off = np.exp((a + b) / 2) * np.tanh(c)
    return np.array([[np.exp(a), off], [off, np.exp(b)]])


def full(loop, x):
    A, _, C = loop.benchmark.plant_continuous
    rate = C @ A
    Q = linalg.block_diag(C.T @ pair(*x[0:3]) @ C + rate.T @ pair(*x[3:6]) @ rate, pair(*x[6:9]))
    return regulator(loop, Q, pair(0.0, *x[9:11])), filter_gain(loop, *np.exp(x[11:14]))


def to_full(loop, x):
    e1, e2, r2, y1, y2, q = x
    y1, y2 = max(y1, 0.0), max(y2, 0.0)  # the Riccati solver wants weights that are not tiny
    r = np.log(loop.benchmark.r_mm2)
    return np.array([y1, y2, 0, y1 - 14, y2 - 14, 0, e1, e2, 0, r2, 0, q, q, r])


SCALE = {}


def gains(loop, x):
    K, noises = SCALE["K"], SCALE["noises"]
    return K + x[:20].reshape(2, 10) * SCALE["step"], filter_gain(loop, *np.exp(noises + x[20:]))


def to_gains(loop, x):
    """Changes of the gains, each in units of the root mean square of its row's like."""
    K, _ = full(loop, x)
    step = np.sqrt(np.mean(K[:, :8] ** 2, axis=1, keepdims=True)) * np.ones((1, 8))
    step = np.hstack([step, np.sqrt(np.mean(K[:, 8:] ** 2, axis=1, keepdims=True)) * [[1, 1]]])
    SCALE.update(K=K, noises=x[11:14], step=step)
    return np.zeros(23)


def estimate(loop, x):
    return estimate_q(loop, np.append(x, LISTENING_Q))


def estimate_q(loop, x):
    return *published(loop, x), "estimate"


DESIGNS = {
    "shared": shared,
    "published": published,
    "full": full,
    "gains": gains,
    "estimate": estimate,
    "estimate_q": estimate_q,
}
STARTS = {"estimate": [START[:5]], "estimate_q": [np.append(START[:5], LISTENING_Q)]}
WIDEN = {
    "shared": lambda loop, x: np.append(x, SHARED_Q),
    "published": to_full,
    "full": to_gains,
}

if __name__ == "__main__":
    main()
