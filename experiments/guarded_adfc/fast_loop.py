"""Feed the study's sampler (`fast_loop.c`) with the package's matrices, plants and noise.

    python experiments/guarded_adfc/fast_loop.py

builds it and compares it with `martths_jax.simulate` on a few plants.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from martths_jax.benchmark import VOLT_OFFSET, VOLT_PER_MM
from martths_jax.control.estimators import design_kalman
from martths_jax.indices import NAMES, PAIRS
from martths_jax.structure.modal import respond

HERE = Path(__file__).parent
LANES, LEAD, NLAG = 8, 4, 20
FLAGS = "-O3 -march=native -mprefer-vector-width=512 -ffast-math -fno-finite-math-only".split()
DOUBLES_36, DOUBLES_16, DOUBLES_8 = (ctypes.c_double * n for n in (36, 16, 8))


class Params(ctypes.Structure):
    _fields_ = (
        [(n, ctypes.c_int) for n in ("N", "T", "nb", "hop", "ns", "mode")]
        + [("forget", ctypes.c_double)]
        + [(n, DOUBLES_36) for n in ("pull", "prox", "bias")]
        + [(n, DOUBLES_16) for n in ("anchor", "start")]
        + [("noise_var", DOUBLES_8)]
        + [(n, ctypes.c_double) for n in
           ("gate", "rate", "adapt", "relative", "cond", "arm", "sin_a", "cos_a", "dt", "sat_lo")]
    )  # fmt: skip


def library():
    """The compiled sampler."""
    path = Path(tempfile.gettempdir()) / f"martths_fast_loop_{os.getuid()}.so"
    source = HERE / "fast_loop.c"
    if not path.exists() or path.stat().st_mtime < source.stat().st_mtime:
        subprocess.run(["gcc", *FLAGS, "-shared", "-fPIC", "-o", path, source, "-lm"], check=True)
    return ctypes.CDLL(str(path))


PASSTHROUGH = np.zeros((8, 2))
PASSTHROUGH[0, 0] = PASSTHROUGH[4, 1] = 1.0


def pack(matrix) -> np.ndarray:
    """(36,) upper triangle by rows of a symmetric (8, 8), or of a diagonal given as number/(8,)."""
    matrix = np.asarray(matrix, dtype=float)
    if matrix.ndim < 2:
        matrix = np.diag(np.broadcast_to(matrix, 8))
    return matrix[np.triu_indices(8)]


@dataclass
class Guard:
    """Settings of a guarded ADFC in the sampler; the defaults are the literal least squares."""

    q: float = 3e-5
    nb: int = 1024
    hop: int = 1
    pull: object = 0.0
    prox: object = 0.0
    bias: object = 0.0
    anchor: np.ndarray = field(default_factory=lambda: PASSTHROUGH)
    start: np.ndarray = field(default_factory=lambda: PASSTHROUGH)
    noise_var: np.ndarray = field(default_factory=lambda: np.zeros(8))
    gate: float = 0.0
    rate: float = 0.0
    adapt: float = 0.0
    relative: float = 0.0
    cond: float = 1e14
    forget: float = 0.0
    sat_lo: float = 0.0


@dataclass
class Outcome:
    """Indices (T,) by name, and what else was seen of each trial."""

    indices: dict
    lost: np.ndarray
    first_bad: np.ndarray
    saturated: np.ndarray
    volts: np.ndarray
    held: np.ndarray
    moved: np.ndarray
    signals: np.ndarray | None = None


def lanes(x, axis=-1):
    """Trials on `axis` -> (blocks, ..., 8), the last block filled with copies of trial 0."""
    x = np.moveaxis(np.asarray(x), axis, 0)
    blocks = -(-x.shape[0] // LANES)
    x = np.concatenate([x, np.repeat(x[:1], blocks * LANES - x.shape[0], axis=0)])
    x = x.reshape(blocks, LANES, *x.shape[1:])
    return np.ascontiguousarray(np.moveaxis(x, 1, -1))


def slots(x):
    """(2, m, ...) slots -> (2 m, ...) interleaved."""
    x = np.asarray(x)
    return np.ascontiguousarray(np.swapaxes(x, 0, 1).reshape(-1, *x.shape[2:]))


def run(bench, guard: Guard, plants, motion, *, power=1.5e-7, shared=True, seed=0, noise=None,
        keep=0, threads=2) -> Outcome:  # fmt: skip
    """Run trials.  Without `noise` (N, channels, T) it is drawn by NumPy from (seed, block)."""
    lib = library()
    T, N = len(plants), motion.acceleration.size
    system = plants.discretise(bench.dt)
    num = bench.numerical
    ns = num.a.shape[1]
    kalman = design_kalman(bench.plant_model, guard.q, bench.r_mm2)
    p = Params(N=N, T=T, nb=guard.nb, hop=guard.hop, ns=ns, mode=int(guard.forget > 0))
    p.forget, p.gate, p.rate, p.adapt = guard.forget, guard.gate, guard.rate, guard.adapt
    p.relative, p.cond, p.dt, p.sat_lo = guard.relative, guard.cond, bench.dt, guard.sat_lo
    for name in ("pull", "prox", "bias"):
        setattr(p, name, DOUBLES_36(*pack(getattr(guard, name))))
    p.anchor, p.start = (DOUBLES_16(*np.ravel(x)) for x in (guard.anchor, guard.start))
    p.noise_var = DOUBLES_8(*guard.noise_var)
    p.arm = float(bench.coupler.arm)
    p.sin_a, p.cos_a = np.sin(float(bench.coupler.alpha)), np.cos(float(bench.coupler.alpha))
    load = np.zeros((N, 4))
    load[:, 0] = motion.acceleration
    reference = np.ascontiguousarray(respond(bench.reference, load))
    blocks = -(-T // LANES)
    a, b = (lanes(slots(np.broadcast_to(x, (*x.shape[:2], T)))) for x in (system.a, system.b))
    B = lanes(slots(system.B))
    C = lanes(np.swapaxes(np.asarray(system.C), 1, 2).reshape(2, -1, T))
    out_matrix = lambda c: np.ascontiguousarray(  # noqa: E731
        np.swapaxes(np.asarray(c).reshape(c.shape[0], 2, -1), 1, 2).reshape(c.shape[0], -1)
    )
    flat = lambda x: slots(np.asarray(x)[..., 0])  # noqa: E731
    D = np.zeros((6, 4)) if num.D is None else np.ascontiguousarray(num.D)
    k = kalman.model
    kB = np.asarray(k.B)
    kB = slots(kB[..., 0] if kB.ndim == 4 else kB)
    kC = np.asarray(k.C)
    kC = out_matrix(kC[..., 0] if kC.ndim == 4 else kC)
    shared_args = [flat(num.a), flat(num.b), slots(num.B), out_matrix(num.C), D, flat(k.a),
                   flat(k.b), kB, kC, slots(kalman.filter_gain),
                   np.ascontiguousarray(bench.restoring),
                   np.concatenate([VOLT_PER_MM, VOLT_OFFSET])]  # fmt: skip
    ground = np.ascontiguousarray(motion.acceleration, dtype=float)
    channels = 1 if shared else 2
    sums = np.zeros((blocks, 10, 4, LANES))
    corr = np.zeros((blocks, 4, NLAG, LANES))
    info = np.zeros((blocks, 5, LANES))
    kept = np.zeros((keep, N, 24, LANES)) if keep else None
    pointer = lambda x: None if x is None else ctypes.c_void_p(x.ctypes.data)  # noqa: E731
    noise = None if noise is None else lanes(noise)
    channels = channels if noise is None else noise.shape[2]

    def one(block):
        if noise is None:
            rng = np.random.default_rng([seed, block])
            n = rng.standard_normal((1, N, channels, LANES)) * np.sqrt(power * bench.fs)
        else:
            n = noise[block : block + 1]
        n = np.ascontiguousarray(n)
        # The sampler counts blocks from zero in every array; hand it this block's slices.
        own = [np.ascontiguousarray(x[block : block + 1]) for x in (a, b, B, C)]
        outs = [x[block : block + 1] for x in (sums, corr, info)]
        k_arr = kept[block : block + 1] if kept is not None and block < keep else None
        lib.run(ctypes.byref(p), pointer(ground), pointer(reference), pointer(n),
                ctypes.c_int(channels == 1), *map(pointer, own), *map(pointer, shared_args),
                *map(pointer, outs), pointer(k_arr), ctypes.c_int(k_arr is not None),
                ctypes.c_int(0), ctypes.c_int(1))  # fmt: skip

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(one, range(blocks)))
    trials = lambda x: np.moveaxis(x, -1, 1).reshape(-1, *x.shape[1:-1])[:T]  # noqa: E731
    sums, corr, info = trials(sums), trials(corr), trials(info)
    found = {}
    with np.errstate(all="ignore"):
        best = np.argmax(corr, axis=2)
        for i, name in enumerate(("J1_1", "J1_2", "J4_1", "J4_2")):
            found[name] = (best[:, i] - LEAD) * bench.dt * 1e3
        for i, (rms, peak) in enumerate(PAIRS):
            found[rms] = 100 * np.sqrt(sums[:, i, 0] / sums[:, i, 1])
            found[peak] = 100 * sums[:, i, 2] / sums[:, i, 3]
    lost = info[:, 0] < 1e14
    found = {n: np.where(lost, np.nan, found[n]) for n in NAMES}
    signals = None if kept is None else np.moveaxis(kept, -1, 1).reshape(-1, N, 24)
    return Outcome(found, lost, info[:, 0], info[:, 1] < 1e14, info[:, 2], info[:, 3], info[:, 4],
                   signals)  # fmt: skip


if __name__ == "__main__":
    import time

    from martths_jax import ADFC, SensorNoise, build_benchmark, draw_plants, indices, simulate
    from martths_jax.motions import Motion, load_motion

    bench = build_benchmark()
    motion = load_motion("elcentro-like", scale=0.4, fs=1024)
    short = Motion("short", np.append(motion.acceleration[: 8 * 1024], np.zeros(4096)), 1024.0)
    plants = draw_plants(16, seed=1)
    model = SensorNoise(seed=1)
    for settings, guard in (
        ({"pull": 1e-5}, Guard(pull=1e-5)),
        ({"pull": 0.0, "no": 1020}, Guard(hop=4)),
    ):
        theirs = indices(simulate(bench, ADFC(**settings), plants, short, model))
        noise = np.asarray(model.draw(plants.trial, short.acceleration.size, bench.fs))
        ours = run(bench, guard, plants, short, noise=noise).indices
        worst = max(np.nanmax(np.abs(ours[n] / theirs[n] - 1)) for n in NAMES)
        same = all(np.array_equal(np.isnan(ours[n]), np.isnan(theirs[n])) for n in NAMES)
        print(f"{settings}: largest relative difference of an index {worst:.1e}, same lost: {same}")
    started = time.perf_counter()
    run(bench, Guard(pull=1e-5), draw_plants(256, seed=1), motion)
    print(f"256 trials x {motion.acceleration.size} samples: {time.perf_counter() - started:.1f} s")
