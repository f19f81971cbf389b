"""Hand-vectorised C: the sampler of experiments/guarded_adfc, eight trials to a vector."""

from __future__ import annotations

import ctypes
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from job import LAG, LAGS, LEAD, NEVER, Job, Sums

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments" / "guarded_adfc"))


def prepare(job: Job):
    """A function without arguments that runs the job; raises FileNotFoundError without gcc."""
    import fast_loop as c

    library = c.library()
    arm, alpha, pull, nb = job.scalars
    p = c.Params(N=job.samples, T=job.trials, nb=int(nb), hop=1, ns=job.num_a.size // 2, mode=0)
    p.cond, p.dt, p.arm, p.sin_a, p.cos_a = 1e14, 1 / 1024, arm, np.sin(alpha), np.cos(alpha)
    p.pull, p.prox, p.bias = (c.DOUBLES_36(*c.pack(x)) for x in (pull, 0.0, 0.0))
    p.anchor, p.start = (c.DOUBLES_16(*np.ravel(x)) for x in (job.anchor, job.start))
    plants = [job.plant_a, job.plant_b, job.plant_B, job.plant_C]
    own = [c.lanes(x, axis=0) for x in plants]
    noise = c.lanes(job.noise[:, None], axis=-1)
    shared = [job.num_a, job.num_b, job.num_B, job.num_C, job.num_D, job.kal_a, job.kal_b,
              job.kal_B, job.kal_C, job.kal_L, job.restoring,
              np.concatenate([job.volt_per_mm, job.volt_offset])]  # fmt: skip
    inputs = [np.ascontiguousarray(x, dtype=float) for x in (job.ground, job.reference)]
    shared = [np.ascontiguousarray(x, dtype=float) for x in shared]
    at = lambda x: ctypes.c_void_p(x.ctypes.data)  # noqa: E731
    blocks, number = own[0].shape[0], ctypes.c_int

    def run() -> Sums:
        pairs = np.zeros((blocks, 10, 4, c.LANES))
        correlation = np.zeros((blocks, 4, c.NLAG, c.LANES))
        info = np.zeros((blocks, 5, c.LANES))

        def one(b):  # the sampler counts blocks from zero in every array
            library.run(
                ctypes.byref(p), *map(at, inputs), at(noise[b]), number(1),
                *(at(x[b]) for x in own), *map(at, shared),
                at(pairs[b]), at(correlation[b]), at(info[b]), None, number(0),
                number(0), number(1),
            )  # fmt: skip

        with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
            list(pool.map(one, range(blocks)))
        trial = lambda x: np.moveaxis(x, -1, 1).reshape(-1, *x.shape[1:-1])[: job.trials]  # noqa: E731
        info = trial(info)
        # Its lags are -4 ... 15; those outside the common range are left out.
        wide = np.full((job.trials, 4, LAGS), -np.inf)
        first = LEAD - c.LEAD
        wide[:, :, first:] = trial(correlation)[:, :, : LAG + c.LEAD + 1]
        never = np.where(info[:, :2] < 1e14, info[:, :2], NEVER)
        return Sums(trial(pairs), wide, never[:, 0], never[:, 1], info[:, 2])

    return run
