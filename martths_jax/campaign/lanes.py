"""Blocks of lanes, each its own controller settings, plant, noise level and noise realisation.

A study runs one controller over many trials; here every lane of a block is a (cell, trial) pair, so
that cells which differ only in traced scalars share a program and fill the blocks to the brim.
"""

from __future__ import annotations

from dataclasses import replace

import jax.numpy as jnp
import numpy as np

from martths_jax.benchmark import Benchmark
from martths_jax.campaign.config import StudyConfig
from martths_jax.campaign.engine import Engine, Outcome
from martths_jax.campaign.plan import Plan, motion_names, study_benchmark, study_motion
from martths_jax.coupler import build_coupler
from martths_jax.motions import Motion
from martths_jax.plant import Plants
from martths_jax.sensors import unit_noise
from martths_jax.simulation import LANES, Setup, fill, pick, reference_response, run_block


class NoiseStore:
    """Unit noise of some trials, drawn once for all cells that use it.

    Args:
        seed, channels: of the study's noise.
        samples: length of the longest motion.
    """

    def __init__(self, seed: int, channels: int, samples: int):
        self.seed, self.channels, self.samples = seed, channels, samples
        self.trial, self.unit = np.zeros(0, int), np.zeros((samples, channels, 0))

    def load(self, trial: np.ndarray) -> None:
        """Draw the noise of trials (T,); forgets all others."""
        trial = np.unique(trial)
        if np.array_equal(trial, self.trial):
            return
        self.unit = np.empty((self.samples, self.channels, trial.size))
        for i in range(0, trial.size, LANES):
            which = np.arange(i, min(i + LANES, trial.size))
            drawn = unit_noise(self.seed, trial[fill(which, LANES)], self.samples, self.channels)
            self.unit[..., which] = np.asarray(drawn)[..., : which.size]
        self.trial = trial

    def block(self, trial: np.ndarray, deviation: np.ndarray, samples: int) -> np.ndarray:
        """(samples, channels, lanes) noise of loaded trials.

        Args:
            trial: (lanes,) their numbers.
            deviation: (lanes,) or (channels, lanes) standard deviations [mm, N].
            samples: how many.
        """
        position = np.searchsorted(self.trial, trial)
        noise = np.empty((samples, self.channels, trial.size))
        # Neighbours in the store are neighbours here most of the time: copy run by run.
        ends = np.flatnonzero(np.diff(position) != 1) + 1
        for run in np.split(np.arange(trial.size), ends):
            first = position[run[0]]
            noise[..., run[0] : run[-1] + 1] = self.unit[:samples, :, first : first + run.size]
        noise *= deviation
        return noise


class LaneEngine(Engine):
    """Runs blocks of lanes on some devices; see ``Engine`` for the arguments."""

    def __init__(self, plan: Plan, devices: list, chunk: int, samples: int):
        super().__init__(plan, devices, chunk)
        self.store = NoiseStore(plan.noise.seed, plan.noise.channels, samples)

    def run_lanes(
        self, cells: Setup, cell: np.ndarray, plants: Plants, noise_trial, power
    ) -> Outcome:
        """Run one block of at most ``block`` lanes.

        Args:
            cells: their common surroundings; the controllers end in an axis of cells.
            cell: (L,) which cell each lane belongs to.
            plants: of the lanes, L of them.
            noise_trial: (L,) trials whose noise the lanes see, loaded in ``store``.
            power: (L,) power of their noise [mm^2 s].
        """
        setup = replace(cells, controller=pick(cells, cell))
        lanes = fill(np.arange(cell.size), self.block)
        deviation = self._deviation(np.asarray(power)[lanes], setup.benchmark.fs)
        noise = self.store.block(np.asarray(noise_trial)[lanes], deviation, setup.ground.shape[0])
        which = np.arange(cell.size)
        ran = run_block(setup, plants, noise, which, self.devices, keep=False, indices=self.indices)
        return self.outcome(ran, which.size)

    def _deviation(self, power: np.ndarray, fs: float) -> np.ndarray:
        """Standard deviations of the noise: (L,), or (channels, L) with load cells [mm, N]."""
        noise = self.plan.noise
        strokes = np.sqrt(power * fs)
        if not noise.load_cells:
            return strokes
        forces = np.full((noise.load_cells, power.size), np.sqrt(noise.force_power * fs))
        return np.vstack([*[strokes] * (noise.channels - noise.load_cells), *forces])


class Worlds:
    """Benchmarks and motions under the settings of cells, each built once.

    Args:
        config: the study the cells vary.
        motions: those of the study, where a cell does not change them.
    """

    def __init__(self, config: StudyConfig, motions: tuple[Motion, ...]):
        self.config = config
        self.known = {(config.fs, None): motions}
        self._benchmarks: dict[tuple, Benchmark] = {}
        self._grounds: dict[tuple, tuple] = {}

    def benchmark(self, fs: float, alpha: float | None, arm: float | None) -> Benchmark:
        """The benchmark at a sampling rate [Hz] with a coupler of angle [degrees] and arm [m]."""
        key = fs, alpha, arm
        if key not in self._benchmarks:
            given = {"alpha_deg": alpha, "arm": arm}
            shape = {k: v for k, v in given.items() if v is not None}
            # A problem may have a coupler of another kind, or none: its own unless one is moved.
            coupler = build_coupler(**shape) if shape else None
            self._benchmarks[key] = study_benchmark(replace(self.config, fs=fs), coupler)
        return self._benchmarks[key]

    def motions(self, fs: float, scale: float | None) -> tuple[Motion, ...]:
        """The motions at a rate [Hz] and scale (None: as the study has them)."""
        key = fs, scale
        if key not in self.known:
            config = replace(self.config, fs=fs)
            names = motion_names(config, lambda make, *args: make(*args))
            self.known[key] = tuple(_scaled(given, config, scale) for given in names)
        return self.known[key]

    def ground(self, benchmark: Benchmark, fs: float, scale: float | None, name: str):
        """Ground acceleration (N,) of a motion, response (N, o) of the reference structure."""
        key = id(benchmark), fs, scale, name
        if key not in self._grounds:
            motion = next(m for m in self.motions(fs, scale) if m.name == name)
            ground = jnp.asarray(motion.acceleration)
            self._grounds[key] = ground, reference_response(benchmark, ground)
        return self._grounds[key]


def _scaled(given, config: StudyConfig, scale: float | None) -> Motion:
    if scale is not None and isinstance(given, Motion):
        factor = scale / given.scale
        return replace(given, acceleration=given.acceleration * factor, scale=scale)
    return study_motion(given, config if scale is None else replace(config, scale=scale))
