"""Indices of hybrid simulations on a motion, ADFC and LQG, nominal plant.

Shared by `seeds.py` and `measure.py`.  Every index is the median over several draws of the sensor
noise.  In a few draws, on real records too, ADFC identifies its coefficients badly as the motion
sets in, and J2 and J5 are then a multiple of what they are in the others: one draw would compare
chances, and a mean the worst of them.
"""

from __future__ import annotations

import numpy as np

from martths_jax import ADFC, LQG, SensorNoise, build_benchmark, indices, simulate
from martths_jax.motions import Motion, Record
from martths_jax.motions.load import DEFAULT_SCALE, with_quiet_tail
from martths_jax.motions.resampling import resample
from martths_jax.plant import plant_from_draws

FS = 1024.0
NOISE_DRAWS = 16
JUDGED = ("J2_1 J2_2 J5_4 J5_28 J7_4 J7_28 J8_2 J8_26 J8_3 J8_27").split()
CONTROLLERS = ("adfc", "lqg")


class Judge:
    """Runs both controllers on a record, 0.40 times, and returns the judged indices."""

    def __init__(self):
        self.benchmark = build_benchmark(fs=FS)
        self.plants = plant_from_draws(np.zeros((NOISE_DRAWS, 9)))
        self.controllers = (ADFC(), LQG.design(self.benchmark))

    def __call__(self, record: Record) -> np.ndarray:
        """(2, 10) median indices [%]: rows as `CONTROLLERS`, columns as `JUDGED`."""
        record = with_quiet_tail(record)
        samples = DEFAULT_SCALE * resample(record.acceleration, record.dt, FS)
        motion = Motion(record.name, samples, FS, scale=DEFAULT_SCALE)
        table = []
        for controller in self.controllers:
            found = indices(
                simulate(self.benchmark, controller, self.plants, motion, SensorNoise(seed=1))
            )
            table.append([float(np.median(np.asarray(found[name]))) for name in JUDGED])
        return np.array(table)
