"""This package as a study runs it: the noise is drawn once, before, and serves every controller."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from job import Job

from martths_jax import ADFC, SensorNoise, build_benchmark, draw_plants
from martths_jax.indices import final_indices
from martths_jax.simulation import (
    LANES,
    Setup,
    draw_on,
    fill,
    reference_response,
    run_block,
)
from martths_jax.simulation import (
    prepare as ready,
)
from martths_jax.watch import Status, status_of
from peers.engine import Table


def prepare(job: Job, seed: int = 1):
    """A function without arguments that runs the job."""
    bench = build_benchmark()
    ground = jnp.asarray(job.ground)
    reference = reference_response(bench, ground)
    setup = Setup(bench, *ready(ADFC(), bench, job.trials), ground, reference)
    plants = draw_plants(job.trials, seed=seed)
    devices = jax.local_devices()
    size = LANES * len(devices)
    blocks = []
    for first in range(0, job.trials, size):
        which = np.arange(first, min(first + size, job.trials))
        trial = np.asarray(plants.trial)[fill(which, size)]
        noise = draw_on(devices, SensorNoise(seed=seed), trial, job.samples, bench.fs)
        blocks.append((which, jax.block_until_ready(noise)))

    def run() -> Table:
        tables = []
        for which, noise in blocks:
            ran = run_block(setup, plants, noise, which, devices, keep=False)
            lost = np.asarray(status_of(ran.watch)) >= Status.DIVERGED
            tables.append(np.stack(list(final_indices(ran.sums, lost).values())))
        return Table(np.concatenate(tables, axis=1))

    return run
