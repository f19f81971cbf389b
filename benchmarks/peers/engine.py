"""This package: `simulate` with its defaults.  It draws its own noise, and its time includes it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from job import Job

from martths_jax import (
    ADFC,
    Motion,
    SensorNoise,
    build_benchmark,
    draw_plants,
    indices,
    simulate,
)


@dataclass
class Table:
    """Indices that are there already."""

    table: np.ndarray

    def indices(self) -> np.ndarray:
        return self.table


def prepare(job: Job, seed: int = 1):
    """A function without arguments that runs the job."""
    bench = build_benchmark()
    motion = Motion("benchmark", job.ground, bench.fs)
    plants = draw_plants(job.trials, seed=seed)

    def run() -> Table:
        found = indices(simulate(bench, ADFC(), plants, motion, SensorNoise(seed=seed)))
        return Table(np.stack(list(found.values())))

    return run
