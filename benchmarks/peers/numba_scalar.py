"""Numba as a user would write it: one trial is one scalar loop, trials run in parallel."""

from __future__ import annotations

import numpy as np
from job import LAGS, LEAD, NEVER, RUNAWAY_MM, VOLT_LIMIT, Job, Sums

from peers.wide_numba import numba

FASTMATH = {"contract", "nsz", "arcp"}


@numba.njit(fastmath=FASTMATH)
def regress(history, newest, phi):
    """Shift the newest sample into history (2, 5); backward differences phi (8,)."""
    for i in range(2):
        for j in range(4, 0, -1):
            history[i, j] = history[i, j - 1]
        history[i, 0] = newest[i]
        x = history[i]
        phi[4 * i] = x[0]
        phi[4 * i + 1] = 1.5 * x[0] - 2.0 * x[1] + 0.5 * x[2]
        phi[4 * i + 2] = 2.0 * x[0] - 5.0 * x[1] + 4.0 * x[2] - x[3]
        phi[4 * i + 3] = 2.5 * x[0] - 9.0 * x[1] + 12.0 * x[2] - 7.0 * x[3] + 1.5 * x[4]


@numba.njit(fastmath=FASTMATH)
def add_row(G, h, phi, u, sign):
    """Add an observation to the upper triangle of G (8, 8) and to h (8, 2)."""
    for i in range(8):
        p = sign * phi[i]
        for j in range(i, 8):
            G[i, j] += p * phi[j]
        h[i, 0] += p * u[0]
        h[i, 1] += p * u[1]


@numba.njit(fastmath=FASTMATH)
def fit(old, new, h_old, h_new, pull, anchor, M, y, c):
    """Pulled least squares by LDL'; c (8, 2) stays as it is if the matrix is badly conditioned."""
    for i in range(8):
        for j in range(i, 8):
            M[i, j] = old[i, j] + new[i, j]
        M[i, i] += pull
        for s in range(2):
            y[i, s] = h_old[i, s] + h_new[i, s] + pull * anchor[i, s]
    for j in range(8):
        if not M[j, j] / (old[j, j] + new[j, j] + pull) >= 1e-14:
            return False
        for i in range(j + 1, 8):
            f = M[j, i] / M[j, j]
            for m in range(i, 8):
                M[i, m] -= f * M[j, m]
            y[i, 0] -= f * y[j, 0]
            y[i, 1] -= f * y[j, 1]
    for j in range(7, -1, -1):
        for s in range(2):
            value = y[j, s]
            for i in range(j + 1, 8):
                value -= M[j, i] * c[i, s]
            c[j, s] = value / M[j, j]
    return True


@numba.njit(fastmath=FASTMATH)
def step_modal(a, b, x, x_next):
    """x_next = A x in slots of two states."""
    for s in range(x.size):
        x_next[s] = a[s] * x[s] + b[s] * x[s ^ 1]


@numba.njit(fastmath=FASTMATH)
def one_trial(shared, plant, ground, reference, noise, pairs, correlation, seen):
    """The whole run of a trial; writes pairs (10, 4), correlation (4, LAGS) and seen (3,)."""
    (num_a, num_b, num_B, num_C, num_D, kal_a, kal_b, kal_B, kal_C, kal_L, restoring, anchor,
     start, volt_per_mm, volt_offset, scalars) = shared  # fmt: skip
    p_a, p_b, p_B, p_C = plant
    arm, alpha, pull, nb = scalars[0], scalars[1], scalars[2], int(scalars[3])
    N, n = ground.size, num_a.size
    sin_a, cos_a = np.sin(alpha), np.cos(alpha)
    x, x_next = np.zeros(n), np.zeros(n)
    z, z_next, filtered, zc = np.zeros(8), np.zeros(8), np.zeros(8), np.zeros(8)
    q, q1, q2, load, num = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(4), np.zeros(6)
    x_a, x_m, x_hat, u, applied = (np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2))
    taps, taps_left, taps_target = np.zeros((2, 5)), np.zeros((2, 5)), np.zeros((2, 5))
    phi, phi_left, phi_target = np.zeros(8), np.zeros(8), np.zeros(8)
    old, new, h_old, h_new = np.zeros((8, 8)), np.zeros((8, 8)), np.zeros((8, 2)), np.zeros((8, 2))
    M, y, c = np.zeros((8, 8)), np.zeros((8, 2)), start.copy()
    ring, strokes = np.zeros((nb, 4)), np.zeros((N, 6))
    value, target = np.zeros(10), np.zeros(10)
    for k in range(N):
        for i in range(2):
            x_m[i] = noise[k]
            for s in range(8):
                x_m[i] += p_C[i, s] * z[s]
        innovation_0, innovation_1 = x_m[0], x_m[1]
        for s in range(8):
            innovation_0 -= kal_C[0, s] * filtered[s]
            innovation_1 -= kal_C[1, s] * filtered[s]
        for s in range(8):
            zc[s] = filtered[s] + kal_L[s, 0] * innovation_0 + kal_L[s, 1] * innovation_1
        for i in range(2):
            x_hat[i] = 0.0
            for s in range(8):
                x_hat[i] += kal_C[i, s] * zc[s]

        x_1, x_2 = x_hat[0] / 1e3, x_hat[1] / 1e3
        sine = (x_1 - x_2) / (2 * arm * sin_a)
        q[1] = np.arcsin(sine)
        q[0] = (x_1 + x_2) / 2 + arm * cos_a * sine**2 / (1 + np.sqrt(1 - sine**2))
        if k == 0:
            q1[:], q2[:] = q, q
        load[0] = ground[k]
        for f in range(3):
            force = 0.0
            for i in range(2):
                force += restoring[0, f, i] * q[i] + restoring[1, f, i] * q1[i]
                force += restoring[2, f, i] * q2[i]
            load[f + 1] = -force
        q2[:] = q1
        q1[:] = q
        for o in range(6):
            num[o] = 0.0
            for s in range(n):
                num[o] += num_C[o, s] * x[s]
            for i in range(4):
                num[o] += num_D[o, i] * load[i]
        half = np.sin(num[1] / 2)
        common = num[0] - 2 * arm * cos_a * half**2
        skew = arm * sin_a * np.sin(num[1])
        x_a[0], x_a[1] = 1e3 * (common + skew), 1e3 * (common - skew)

        slot = ring[k % nb]
        regress(taps, x_hat, phi)
        regress(taps_left, slot[:2], phi_left)
        regress(taps_target, x_a, phi_target)
        add_row(new, h_new, phi, applied, 1.0)
        add_row(old, h_old, phi_left, slot[2:], -1.0)
        slot[:2], slot[2:] = x_hat, applied
        if k >= nb + 4:
            fit(old, new, h_old, h_new, pull, anchor, M, y, c)
        if (k + 1) % nb == 0:
            old[:], h_old[:] = new, h_new
            new[:], h_new[:] = 0.0, 0.0
        for i in range(2):
            u[i] = 0.0
            for j in range(8):
                u[i] += c[j, i] * phi_target[j]
        applied[:] = u

        strokes[k, :2], strokes[k, 2:4], strokes[k, 4:] = x_a, x_m, x_hat
        value[:2], value[2:4], value[4:6], value[6:] = x_m, q, q, num[2:]
        target[:2], target[2:4], target[4:] = x_a, num[:2], reference[k]
        for i in range(10):
            error = value[i] - target[i]
            pairs[i, 0] += error * error
            pairs[i, 1] += target[i] * target[i]
            pairs[i, 2] = max(pairs[i, 2], abs(error))
            pairs[i, 3] = max(pairs[i, 3], abs(target[i]))
        for i in range(2):
            volts = abs(u[i] * volt_per_mm[i] + volt_offset[i])
            seen[2] = max(seen[2], volts)
            if volts > VOLT_LIMIT and seen[1] == NEVER:
                seen[1] = k
            if not (abs(u[i]) <= RUNAWAY_MM and abs(x_m[i]) <= RUNAWAY_MM) and seen[0] == NEVER:
                seen[0] = k

        step_modal(num_a, num_b, x, x_next)
        for s in range(n):
            for i in range(4):
                x_next[s] += num_B[s, i] * load[i]
        step_modal(p_a, p_b, z, z_next)
        step_modal(kal_a, kal_b, zc, filtered)
        for s in range(8):
            z_next[s] += p_B[s, 0] * u[0] + p_B[s, 1] * u[1]
            filtered[s] += kal_B[s, 0] * u[0] + kal_B[s, 1] * u[1]
        x, x_next = x_next, x
        z, z_next = z_next, z

    for i in range(4):
        for k in range(N):
            value_k = strokes[k, 2 + i]
            for lag in range(max(-LEAD, k - N + 1), min(LAGS - LEAD - 1, k) + 1):
                correlation[i, lag + LEAD] += value_k * strokes[k - lag, i % 2]


@numba.njit(parallel=True, fastmath=FASTMATH)
def all_trials(shared, a, b, B, C, ground, reference, noise, pairs, correlation, seen):
    for t in numba.prange(a.shape[0]):
        plant = (a[t], b[t], B[t], C[t])
        one_trial(shared, plant, ground, reference, noise[t], pairs[t], correlation[t], seen[t])


SHARED = (
    "num_a", "num_b", "num_B", "num_C", "num_D", "kal_a", "kal_b", "kal_B", "kal_C", "kal_L",
    "restoring", "anchor", "start", "volt_per_mm", "volt_offset", "scalars",
)  # fmt: skip


def prepare(job: Job):
    """A function without arguments that runs the job."""
    keep = lambda x: np.ascontiguousarray(x)  # noqa: E731
    shared = tuple(keep(getattr(job, name)) for name in SHARED)
    plants = tuple(keep(x) for x in (job.plant_a, job.plant_b, job.plant_B, job.plant_C))
    noise = keep(job.noise.T)

    def run() -> Sums:
        T = job.trials
        pairs, correlation = np.zeros((T, 10, 4)), np.zeros((T, 4, LAGS))
        seen = np.tile([NEVER, NEVER, 0.0], (T, 1))
        all_trials(shared, *plants, job.ground, job.reference, noise, pairs, correlation, seen)
        return Sums(pairs, correlation, *seen.T)

    return run
