"""Hand-vectorised C, eight trials to a vector (`c_by_hand.c`)."""

from __future__ import annotations

import ctypes
import os
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from job import LAGS, NEVER, Job, Sums

SOURCE = Path(__file__).with_suffix(".c")
LANES = 8
FLAGS = (
    "-O3 -march=native -mprefer-vector-width=512 -ffast-math -fno-finite-math-only -Wno-psabi"
).split()
DOUBLES_16 = ctypes.c_double * 16


class Params(ctypes.Structure):
    """Settings, as in the C file."""

    _fields_ = (
        [(n, ctypes.c_int) for n in ("N", "nb", "ns")]
        + [("pull", ctypes.c_double)]
        + [(n, DOUBLES_16) for n in ("anchor", "start")]
        + [(n, ctypes.c_double) for n in ("cond", "arm", "sin_a", "cos_a")]
    )


def library() -> ctypes.CDLL:
    """The compiled program; raises FileNotFoundError without gcc."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "c_by_hand.so"
        subprocess.run(["gcc", *FLAGS, "-shared", "-fPIC", "-o", path, SOURCE, "-lm"], check=True)
        return ctypes.CDLL(str(path))


def lanes(x, axis: int) -> np.ndarray:
    """Trials on `axis` -> (blocks, ..., 8), the last block filled with copies of trial 0."""
    x = np.moveaxis(np.asarray(x), axis, 0)
    blocks = -(-x.shape[0] // LANES)
    x = np.concatenate([x, np.repeat(x[:1], blocks * LANES - x.shape[0], axis=0)])
    x = x.reshape(blocks, LANES, *x.shape[1:])
    return np.ascontiguousarray(np.moveaxis(x, 1, -1))


def prepare(job: Job):
    """A function without arguments that runs the job; raises FileNotFoundError without gcc."""
    c = library()
    arm, alpha, pull, nb = job.scalars
    p = Params(N=job.samples, nb=int(nb), ns=job.num_a.size // 2, pull=pull, cond=1e14)
    p.arm, p.sin_a, p.cos_a = arm, np.sin(alpha), np.cos(alpha)
    p.anchor, p.start = (DOUBLES_16(*np.ravel(x)) for x in (job.anchor, job.start))
    own = [lanes(x, axis=0) for x in (job.plant_a, job.plant_b, job.plant_B, job.plant_C)]
    noise = lanes(job.noise, axis=-1)
    shared = [job.num_a, job.num_b, job.num_B, job.num_C, job.num_D, job.kal_a, job.kal_b,
              job.kal_B, job.kal_C, job.kal_L, job.restoring,
              np.concatenate([job.volt_per_mm, job.volt_offset])]  # fmt: skip
    inputs = [np.ascontiguousarray(x, dtype=float) for x in (job.ground, job.reference)]
    shared = [np.ascontiguousarray(x, dtype=float) for x in shared]
    at = lambda x: ctypes.c_void_p(x.ctypes.data)  # noqa: E731
    blocks = own[0].shape[0]

    def run() -> Sums:
        pairs = np.zeros((blocks, 10, 4, LANES))
        correlation = np.zeros((blocks, 4, LAGS, LANES))
        info = np.zeros((blocks, 3, LANES))

        def one(b):
            c.run(
                ctypes.byref(p), *map(at, inputs), at(noise[b]), *(at(x[b]) for x in own),
                *map(at, shared), at(pairs[b]), at(correlation[b]), at(info[b]),
            )  # fmt: skip

        with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
            list(pool.map(one, range(blocks)))
        trial = lambda x: np.moveaxis(x, -1, 1).reshape(-1, *x.shape[1:-1])[: job.trials]  # noqa: E731
        info = trial(info)
        never = np.where(info[:, :2] < 1e14, info[:, :2], NEVER)
        return Sums(trial(pairs), trial(correlation), never[:, 0], never[:, 1], info[:, 2])

    return run
