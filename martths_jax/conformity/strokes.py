"""Strokes that a compensator is driven with where no loop is closed around it.

    x_a,i(t) = (1 - exp(-t / T_r)) sum_n a_n sin(2 pi f_n t + p_n)
    x_m      = strokes of an uncertain plant whose command is x_a, and the sensors' noise

Sizes and phases differ from trial to trial, so that whoever mixes trials is found out.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.benchmark import Benchmark
from martths_jax.plant import Plants
from martths_jax.sensors import SensorNoise
from martths_jax.simulation import draw_noise
from martths_jax.structure.modal import advance, output

#: Frequencies [Hz] of the targets, and their largest size [mm]: those of the benchmark's motions.
FREQUENCIES, SIZE = np.linspace(0.5, 9.0, 12), 1.2
#: Time T_r in which they rise [s].
RISE = 0.25


def targets(samples: int, trials: int, dt: float, seed: int) -> np.ndarray:
    """(N, 2, T) target strokes x_a [mm] that start at rest."""
    rng = np.random.default_rng(seed)
    shape = (FREQUENCIES.size, 2, trials)
    sizes = rng.uniform(0.2, SIZE, shape) / np.sqrt(FREQUENCIES)[:, None, None]
    phases = rng.uniform(0, 2 * np.pi, shape)
    t = np.arange(samples)[:, None, None] * dt
    waves = zip(FREQUENCIES, sizes, phases, strict=True)
    total = sum(size * np.sin(2 * np.pi * f * t + phase) for f, size, phase in waves)
    return (1 - np.exp(-t / RISE)) * total


def measured(
    benchmark: Benchmark, plants: Plants, x_a: np.ndarray, noise: SensorNoise
) -> np.ndarray:
    """(N, 2, T) measured strokes x_m [mm] of T plants whose commands are `x_a`."""
    drawn = draw_noise(noise, plants.trial, len(x_a), benchmark.fs)
    return np.asarray(_strokes(plants.discretise(benchmark.dt), jnp.asarray(x_a)) + drawn)


@jax.jit
def _strokes(plant, commands):
    def sample(state, command):
        return advance(plant, state, command), output(plant, state)

    rest = jnp.zeros((*plant.a.shape[:2], commands.shape[-1]))
    return jax.lax.scan(sample, rest, commands)[1]
