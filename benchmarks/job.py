"""The job that all compared programs do, as plain arrays: the guarded ADFC study of one motion.

What goes in comes from the package (matrices, plants, sensor noise, settings of the default
controller), so that a program that does the same arithmetic must give the same 24 indices.
States of modal systems are interleaved slot by slot, s = 2 j + r; the partner of state s, to which
the multiplier b belongs, is s ^ 1.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

#: Range of the cross-correlations, -LEAD ... LAG samples (the package's first one).
LEAD, LAG = 6, 13
LAGS = LEAD + LAG + 1
#: A command or stroke beyond this has run away [mm]; largest valve command [V].
RUNAWAY_MM, VOLT_LIMIT = 100.0, 3.8
#: First sample that has not been reached.
NEVER = float(2**53)


@dataclass
class Job:
    """Inputs of a run of T trials and N samples.

    Attributes:
        num_a, num_b, num_B, num_C, num_D: numerical substructure (n,), (n,), (n, 4), (6, n),
            (6, 4).
        kal_a, kal_b, kal_B, kal_C, kal_L: Kalman filter's model (8,), (8,), (8, 2), (2, 8) and
            gain (8, 2).
        plant_a, plant_b, plant_B, plant_C: plants (T, 8), (T, 8), (T, 8, 2), (T, 2, 8).
        restoring: (3, 3, 2) taps of the restoring force.
        anchor, start: (8, 2) coefficients.
        volt_per_mm, volt_offset: (2,) valve commands.
        scalars: (arm [m], alpha [rad], pull [mm^2], N_b).
        ground: (N,) [m/s^2].
        reference: (N, 6) response of the reference structure.
        noise: (N, T) noise of both sensors [mm].
    """

    num_a: np.ndarray
    num_b: np.ndarray
    num_B: np.ndarray
    num_C: np.ndarray
    num_D: np.ndarray
    kal_a: np.ndarray
    kal_b: np.ndarray
    kal_B: np.ndarray
    kal_C: np.ndarray
    kal_L: np.ndarray
    plant_a: np.ndarray
    plant_b: np.ndarray
    plant_B: np.ndarray
    plant_C: np.ndarray
    restoring: np.ndarray
    anchor: np.ndarray
    start: np.ndarray
    volt_per_mm: np.ndarray
    volt_offset: np.ndarray
    scalars: np.ndarray
    ground: np.ndarray
    reference: np.ndarray
    noise: np.ndarray

    @property
    def trials(self) -> int:
        return self.plant_a.shape[0]

    @property
    def samples(self) -> int:
        return self.ground.size

    @property
    def nb(self) -> int:
        return int(self.scalars[3])

    def part(self, trials: int, samples: int) -> Job:
        """The first trials and samples."""
        cut = {f.name: getattr(self, f.name) for f in fields(self)}
        for name in ("plant_a", "plant_b", "plant_B", "plant_C"):
            cut[name] = cut[name][:trials]
        cut["ground"], cut["reference"] = self.ground[:samples], self.reference[:samples]
        cut["noise"] = self.noise[:samples, :trials]
        return Job(**cut)

    def save(self, folder: Path) -> None:
        """One .npy a field."""
        for f in fields(self):
            np.save(folder / f"{f.name}.npy", getattr(self, f.name))

    @staticmethod
    def load(folder: Path, trials: int, samples: int) -> Job:
        """The first trials and samples of a saved job; the noise stays on disk until it is read."""
        arrays = {
            f.name: np.load(folder / f"{f.name}.npy", mmap_mode="r" if f.name == "noise" else None)
            for f in fields(Job)
        }
        return Job(**arrays).part(trials, samples)


def build_job(motion, trials: int, seed: int = 1) -> Job:
    """The job of `simulate(build_benchmark(), ADFC(), draw_plants(trials, seed), motion, noise)`.

    Args:
        motion: from ``load_motion`` at 1024 Hz.
        trials: how many plants.
        seed: of plants and noise.
    """
    from martths_jax import ADFC, SensorNoise, build_benchmark, draw_plants
    from martths_jax.benchmark import VOLT_OFFSET, VOLT_PER_MM
    from martths_jax.simulation import reference_response

    bench = build_benchmark()
    controller = ADFC().prepare(bench)
    plants, ground = draw_plants(trials, seed=seed), np.asarray(motion.acceleration, dtype=float)
    numerical, model = bench.numerical, controller.estimator.model
    own = plants.discretise(bench.dt)
    noise, sensors = np.empty((ground.size, trials)), SensorNoise(seed=seed)
    for first in range(0, trials, 64):
        drawn = sensors.draw(plants.trial[first : first + 64], ground.size, bench.fs)
        noise[:, first : first + 64] = np.asarray(drawn)[:, 0]
    each = lambda x: np.moveaxis(np.broadcast_to(x, (*x.shape[:-1], trials)), -1, 0)  # noqa: E731
    return Job(
        num_a=_states(numerical.a)[:, 0],
        num_b=_states(numerical.b)[:, 0],
        num_B=_states(numerical.B),
        num_C=_outputs(numerical.C),
        num_D=np.zeros((6, 4)) if numerical.D is None else np.asarray(numerical.D),
        kal_a=_states(model.a)[:, 0],
        kal_b=_states(model.b)[:, 0],
        kal_B=_states(model.B)[..., 0],
        kal_C=_outputs(model.C)[..., 0],
        kal_L=_states(controller.estimator.filter_gain),
        plant_a=each(_states(own.a)),
        plant_b=each(_states(own.b)),
        plant_B=each(_states(own.B)),
        plant_C=each(_outputs(own.C)),
        restoring=np.asarray(bench.specimen.taps),
        anchor=np.asarray(controller.anchor),
        start=np.asarray(controller.start),
        volt_per_mm=VOLT_PER_MM,
        volt_offset=VOLT_OFFSET,
        scalars=np.array(
            [float(bench.coupler.arm), float(bench.coupler.alpha), float(controller.pull), 1024]
        ),
        ground=ground,
        reference=np.asarray(reference_response(bench, ground)),
        noise=noise,
    )


def _states(x) -> np.ndarray:
    """(2, m, ...) slots as (2 m, ...)."""
    x = np.swapaxes(np.asarray(x), 0, 1)
    return np.ascontiguousarray(x.reshape(-1, *x.shape[2:]))


def _outputs(x) -> np.ndarray:
    """(o, 2, m, ...) as (o, 2 m, ...)."""
    x = np.swapaxes(np.asarray(x), 1, 2)
    return np.ascontiguousarray(x.reshape(x.shape[0], -1, *x.shape[3:]))


@dataclass
class Sums:
    """What every program hands back.

    Attributes:
        pairs: (T, 10, 4) sum of squares of error and of target, largest magnitude of both, of the
            ten compared pairs.
        correlation: (T, 4, LAGS) of x_m with x_a and of x_hat with x_a, from -LEAD to LAG.
        first_bad: (T,) first sample with a command or stroke out of its range, NEVER for none.
        first_saturated: (T,) the same of a valve beyond its limit.
        volt_peak: (T,) largest valve command [V].
    """

    pairs: np.ndarray
    correlation: np.ndarray
    first_bad: np.ndarray
    first_saturated: np.ndarray
    volt_peak: np.ndarray

    def indices(self, fs: float = 1024.0) -> np.ndarray:
        """(24, T) indices in the order of Table 4, NaN for trials that ran away."""
        from martths_jax.indices import DELAYS, NAMES, PAIRS

        found = {}
        with np.errstate(all="ignore"):
            delay = (np.argmax(self.correlation, axis=2) - LEAD) / fs * 1e3
            rms = 100 * np.sqrt(self.pairs[:, :, 0] / self.pairs[:, :, 1])
            peak = 100 * self.pairs[:, :, 2] / self.pairs[:, :, 3]
        for i, name in enumerate(DELAYS):
            found[name] = delay[:, i]
        for i, (rms_name, peak_name) in enumerate(PAIRS):
            found[rms_name], found[peak_name] = rms[:, i], peak[:, i]
        table = np.stack([found[name] for name in NAMES])
        return np.where(self.first_bad < NEVER, np.nan, table)
