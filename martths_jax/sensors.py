"""Displacement sensors: band-limited white noise on the measured strokes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.errors import argument_error, check_seed
from martths_jax.runtime import check_precision

NOISE_STREAM = 1  # separates noise draws from plant draws of the same seed
BLOCK = 1024  # samples drawn from one key, so that a longer record only adds to a shorter one


@dataclass(frozen=True)
class SensorNoise:
    """White noise of the two displacement sensors.

    The noise of trial i depends on (seed, i) alone: not on the record's length, the controller, or
    which other trials run.

    Attributes:
        noise_power: power spectral density [mm^2 s]; a sample's variance is noise_power * fs.
        shared: all sensors see the same sequence, as in the benchmark; False draws one each.
        seed: seed of the study.
        actuators: number of displacement sensors.
        load_cells: number of load cells, each with a sequence of its own.
        force_power: power spectral density of theirs [N^2 s].
    """

    noise_power: float = 1.5e-7
    shared: bool = True
    seed: int = 0
    actuators: int = 2
    load_cells: int = 0
    force_power: float = 0.0

    def __post_init__(self):
        try:
            good = 0 <= self.noise_power < float("inf")
        except TypeError:
            good = False
        if not good:
            wanted = "be zero or positive and finite (mm^2 s)"
            raise argument_error("noise_power", wanted, repr(self.noise_power))
        check_seed(self.seed)

    @property
    def channels(self) -> int:
        """Rows of the noise: displacement sensors, one row if they share it, then load cells."""
        return (1 if self.shared else self.actuators) + self.load_cells

    def variance(self, fs: float) -> float:
        """Variance of one sample [mm^2]."""
        return self.noise_power * fs

    def variances(self, fs: float):
        """``variance``; with load cells (1, channels, 1), theirs [N^2] after it."""
        if not self.load_cells:
            return self.variance(fs)
        strokes = [self.variance(fs)] * (self.channels - self.load_cells)
        return np.array([*strokes, *[self.force_power * fs] * self.load_cells])[None, :, None]

    def draw(self, trial: jax.Array, samples: int, fs: float) -> jax.Array:
        """Noise of the given trials.

        Args:
            trial: (T,) trial numbers.
            samples: record length N.
            fs: sampling rate [Hz].

        Returns:
            (N, channels, T) noise [mm, N].
        """
        check_precision()
        unit = unit_noise(self.seed, trial, samples, self.channels)
        return unit * jnp.sqrt(self.variances(fs))


@partial(jax.jit, static_argnames=("samples", "channels"))
def unit_noise(seed: int, trial: jax.Array, samples: int, channels: int) -> jax.Array:
    """(N, channels, T) standard normal sequences of the given trials."""
    stream = jax.random.fold_in(jax.random.key(seed), NOISE_STREAM)
    blocks = -(-samples // BLOCK)

    def one_block(i, block):
        key = jax.random.fold_in(jax.random.fold_in(stream, i), block)
        return jax.random.normal(key, (channels, BLOCK))

    def block_of_all(block):
        return jnp.moveaxis(jax.vmap(lambda i: one_block(i, block))(trial), 0, -1)

    noise = jax.lax.map(block_of_all, jnp.arange(blocks))  # (blocks, channels, BLOCK, T)
    noise = jnp.swapaxes(noise, 1, 2).reshape(blocks * BLOCK, channels, -1)
    return noise[:samples]
