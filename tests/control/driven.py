"""A controller on given strokes, sample by sample without the loop; and against passthrough."""

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax import Passthrough, draw_plants, indices, load_motion, simulate
from martths_jax.control.base import Observation


def driven(controller, benchmark, x_a, x_hat=None):
    """Commands (N, 2, T) and signals of a prepared controller on strokes (N, 2, T)."""
    x_hat = x_a if x_hat is None else x_hat
    k = jnp.arange(len(x_a))

    def step(state, given):
        seen = Observation(
            given[0], jnp.asarray(benchmark.dt), given[1], given[2], given[2], (), None
        )
        state, decision = controller.step(state, seen)
        return state, (decision.u, decision.signals)

    series = (k, jnp.asarray(x_a), jnp.asarray(x_hat))
    return jax.tree.map(np.asarray, jax.lax.scan(step, controller.init(x_a.shape[2]), series)[1])


def late_rig(controller, benchmark, x_a, delays, size=1.0, signal="tau"):
    """Strokes (N, 2) and a signal of a rig: stroke i is `size` of the command so long ago."""
    dt, line = jnp.asarray(benchmark.dt), jnp.zeros((max(delays), 2))

    def step(carry, given):
        state, line = carry
        k, target = given
        x = size * jnp.stack([line[d - 1, i] for i, d in enumerate(delays)])[:, None]
        state, said = controller.step(state, Observation(k, dt, target[:, None], x, x, (), None))
        line = jnp.concatenate([said.u.T, line[:-1]])
        return (state, line), (x[:, 0], said.signals[signal][..., 0])

    series = jnp.arange(len(x_a)), jnp.asarray(x_a)
    return [np.asarray(a) for a in jax.lax.scan(step, (controller.init(1), line), series)[1]]


def strokes(samples=300, trials=3, seed=5):
    """Smooth strokes (N, 2, T) [mm] that do not start at rest, as little as that matters."""
    rng = np.random.default_rng(seed)
    t = np.arange(samples)[:, None, None, None] / 1024
    size, f, phase = rng.uniform(0.3, 2, (3, 1, 2, trials, 6))
    return np.sum(size * np.sin(2 * np.pi * 3 * f * t + 3 * phase), axis=-1)


def tracking(benchmark, *controllers, trials=64):
    """Medians of J2true_1, J2true_2 [%], for passthrough first; none of the trials may be lost."""
    motion, plants = load_motion("elcentro-like"), draw_plants(trials, seed=1)
    rows = []
    for controller in (Passthrough(q=3e-5), *controllers):
        result = simulate(benchmark, controller, plants, motion, indices=["true"])
        assert not result.lost.any()
        found = indices(result)
        rows.append([np.median(found[f"J2true_{i}"]) for i in (1, 2)])
    return np.array(rows)
