"""JAX in the obvious way: `vmap` of a scalar step, `jnp.linalg.solve`, all trials side by side."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from job import LAGS, LEAD, NEVER, RUNAWAY_MM, VOLT_LIMIT, Job, Sums

jax.config.update("jax_enable_x64", True)

C_D = jnp.array([[1, 0, 0, 0, 0], [1.5, -2, 0.5, 0, 0], [2, -5, 4, -1, 0], [2.5, -9, 12, -7, 1.5]])


def regress(history, newest):
    """History (2, 5) with the newest sample in it; backward differences (8,)."""
    history = jnp.concatenate([newest[:, None], history[:, :-1]], axis=1)
    return history, (history @ C_D.T).ravel()


def sample(m, nb, plant, state, k, ground, reference, noise):
    """One sample of one trial: state at k + 1, and strokes (6,) for the correlations."""
    p_a, p_b, p_B, p_C = plant
    arm, alpha, pull, _ = m["scalars"]
    sin_a, cos_a = jnp.sin(alpha), jnp.cos(alpha)
    pair = lambda x: x.reshape(-1, 2)[:, ::-1].ravel()  # noqa: E731

    x_m = p_C @ state["z"] + noise
    zc = state["filtered"] + m["kal_L"] @ (x_m - m["kal_C"] @ state["filtered"])
    x_hat = m["kal_C"] @ zc

    x_1, x_2 = x_hat / 1e3
    sine = (x_1 - x_2) / (2 * arm * sin_a)
    drop = arm * cos_a * sine**2 / (1 + jnp.sqrt(1 - sine**2))
    q = jnp.array([(x_1 + x_2) / 2 + drop, jnp.arcsin(sine)])
    q1, q2 = (jnp.where(k == 0, q, before) for before in (state["q1"], state["q2"]))
    force = m["restoring"][0] @ q + m["restoring"][1] @ q1 + m["restoring"][2] @ q2
    load = jnp.concatenate([ground[None], -force])
    num = m["num_C"] @ state["x"] + m["num_D"] @ load
    common = num[0] - 2 * arm * cos_a * jnp.sin(num[1] / 2) ** 2
    skew = arm * sin_a * jnp.sin(num[1])
    x_a = 1e3 * jnp.array([common + skew, common - skew])

    # Ring of the last N_b samples; writing before reading lets the compiler update it in place.
    taps, phi = regress(state["taps"], x_hat)
    taps_target, phi_target = regress(state["taps_target"], x_a)
    ring = state["ring"].at[k % nb].set(jnp.concatenate([x_hat, state["applied"]]))
    taps_left, phi_left = regress(state["taps_left"], state["left"][:2])
    G = state["G"] + jnp.outer(phi, phi) - jnp.outer(phi_left, phi_left)
    h = state["h"] + jnp.outer(phi, state["applied"]) - jnp.outer(phi_left, state["left"][2:])
    fitted = jnp.linalg.solve(G + pull * jnp.eye(8), h + pull * m["anchor"])
    good = (k >= nb + 4) & jnp.all(jnp.isfinite(fitted))
    c = jnp.where(good, fitted, state["c"])
    u = phi_target @ c

    target = jnp.concatenate([x_a, num[:2], reference])
    error = jnp.concatenate([x_m, q, q, num[2:]]) - target
    now = jnp.stack([error**2, target**2, jnp.abs(error), jnp.abs(target)])
    pairs = jnp.concatenate(
        [state["pairs"][:2] + now[:2], jnp.maximum(state["pairs"][2:], now[2:])]
    )
    volts = jnp.max(jnp.abs(u * m["volt_per_mm"] + m["volt_offset"]))
    inside = jnp.all((jnp.abs(u) <= RUNAWAY_MM) & (jnp.abs(x_m) <= RUNAWAY_MM))
    seen = jnp.array(
        [
            jnp.minimum(state["seen"][0], jnp.where(inside, NEVER, k)),
            jnp.minimum(state["seen"][1], jnp.where(volts > VOLT_LIMIT, k, NEVER)),
            jnp.maximum(state["seen"][2], volts),
        ]
    )
    after = {
        "x": m["num_a"] * state["x"] + m["num_b"] * pair(state["x"]) + m["num_B"] @ load,
        "z": p_a * state["z"] + p_b * pair(state["z"]) + p_B @ u,
        "filtered": m["kal_a"] * zc + m["kal_b"] * pair(zc) + m["kal_B"] @ u,
        "q1": q,
        "q2": q1,
        "taps": taps,
        "taps_left": taps_left,
        "taps_target": taps_target,
        "ring": ring,
        "left": ring[(k + 1) % nb],
        "G": G,
        "h": h,
        "c": c,
        "applied": u,
        "pairs": pairs,
        "seen": seen,
    }
    return after, jnp.concatenate([x_a, x_m, x_hat])


def start(m, nb):
    """State of one trial before the first sample."""
    zeros = jnp.zeros
    return {
        "x": zeros(m["num_a"].size), "z": zeros(8), "filtered": zeros(8), "q1": zeros(2),
        "q2": zeros(2), "taps": zeros((2, 5)), "taps_left": zeros((2, 5)),
        "taps_target": zeros((2, 5)), "ring": zeros((nb, 4)), "left": zeros(4),
        "G": zeros((8, 8)), "h": zeros((8, 2)), "c": jnp.asarray(m["start"]), "applied": zeros(2),
        "pairs": zeros((4, 10)), "seen": jnp.array([NEVER, NEVER, 0.0]),
    }  # fmt: skip


@partial(jax.jit, static_argnames="nb")
def all_trials(m, plants, ground, reference, noise, nb):
    state = jax.vmap(lambda _: start(m, nb))(plants[0])
    step = jax.vmap(partial(sample, m, nb), in_axes=(0, 0, None, None, None, 0))

    def body(state, inputs):
        return step(plants, state, *inputs)

    inputs = (jnp.arange(ground.size), ground, reference, noise)
    state, strokes = jax.lax.scan(body, state, inputs)
    N = ground.size

    def correlation(lag):
        y, x = strokes[max(lag, 0) : N + min(lag, 0)], strokes[max(-lag, 0) : N - max(lag, 0)]
        return jnp.sum(y[..., 2:] * jnp.concatenate([x[..., :2]] * 2, axis=-1), axis=0)

    lags = jnp.stack([correlation(lag) for lag in range(-LEAD, LAGS - LEAD)], axis=-1)
    return jnp.moveaxis(state["pairs"], 1, 2), lags, state["seen"]


def prepare(job: Job):
    """A function without arguments that runs the job."""
    names = [f for f in vars(job) if f not in ("noise", "ground", "reference") and "plant" not in f]
    shared = {name: jnp.asarray(getattr(job, name)) for name in names}
    plants = tuple(jnp.asarray(x) for x in (job.plant_a, job.plant_b, job.plant_B, job.plant_C))
    series = tuple(jnp.asarray(x) for x in (job.ground, job.reference, job.noise))

    def run() -> Sums:
        pairs, correlation, seen = all_trials(shared, plants, *series, nb=job.nb)
        return Sums(np.asarray(pairs), np.asarray(correlation), *np.asarray(seen).T)

    return run
