"""NumPy, vectorised over the trials; a Python loop over time."""

from __future__ import annotations

import numpy as np
from job import LAGS, LEAD, NEVER, RUNAWAY_MM, VOLT_LIMIT, Job, Sums

C_D = np.array(
    [[1, 0, 0, 0, 0], [1.5, -2, 0.5, 0, 0], [2, -5, 4, -1, 0], [2.5, -9, 12, -7, 1.5]], dtype=float
)


def regress(history, newest):
    """Shift newest (T, 2) into history (T, 2, 5); backward differences (T, 8)."""
    history[:, :, 1:] = history[:, :, :-1].copy()
    history[:, :, 0] = newest
    return (history @ C_D.T).reshape(-1, 8)


def solve(G, h, c):
    """(T, 8, 2) solutions of G c = h, the old c where G is singular or not finite."""
    good = np.all(np.isfinite(G), axis=(1, 2))
    G = np.where(good[:, None, None], G, np.eye(8))
    try:
        found = np.linalg.solve(G, h)
    except np.linalg.LinAlgError:
        found = np.stack([np.linalg.lstsq(g, r, rcond=None)[0] for g, r in zip(G, h, strict=True)])
    good &= np.all(np.isfinite(found), axis=(1, 2))
    return np.where(good[:, None, None], found, c)


def prepare(job: Job):
    """A function without arguments that runs the job."""
    arm, alpha, pull, nb = job.scalars
    nb, T, N, n = int(nb), job.trials, job.samples, job.num_a.size
    sin_a, cos_a = np.sin(alpha), np.cos(alpha)
    partner, partner_8 = np.arange(n) ^ 1, np.arange(8) ^ 1
    noise = np.array(job.noise)
    pull_matrix, pull_side = pull * np.eye(8), pull * job.anchor

    def run() -> Sums:
        x, z, filtered = np.zeros((T, n)), np.zeros((T, 8)), np.zeros((T, 8))
        q1 = q2 = None
        taps, taps_left, taps_target = (np.zeros((T, 2, 5)) for _ in range(3))
        old, new = np.zeros((T, 8, 10)), np.zeros((T, 8, 10))
        c, applied, ring = np.tile(job.start, (T, 1, 1)), np.zeros((T, 2)), np.zeros((nb, T, 4))
        strokes, pairs = np.zeros((N, T, 6)), np.zeros((4, T, 10))
        first_bad, first_saturated = np.full(T, NEVER), np.full(T, NEVER)
        volt_peak = np.zeros(T)
        for k in range(N):
            x_m = (job.plant_C @ z[:, :, None])[:, :, 0] + noise[k][:, None]
            zc = filtered + (x_m - filtered @ job.kal_C.T) @ job.kal_L.T
            x_hat = zc @ job.kal_C.T

            mean, sine = x_hat.sum(1) / 2e3, (x_hat[:, 0] - x_hat[:, 1]) / (2e3 * arm * sin_a)
            drop = arm * cos_a * sine**2 / (1 + np.sqrt(1 - sine**2))
            q = np.stack([mean + drop, np.arcsin(sine)], axis=1)
            if k == 0:
                q1 = q2 = q
            force = q @ job.restoring[0].T + q1 @ job.restoring[1].T + q2 @ job.restoring[2].T
            q1, q2 = q, q1
            load = np.concatenate([np.full((T, 1), job.ground[k]), -force], axis=1)
            num = x @ job.num_C.T + load @ job.num_D.T
            common = num[:, 0] - 2 * arm * cos_a * np.sin(num[:, 1] / 2) ** 2
            skew = arm * sin_a * np.sin(num[:, 1])
            x_a = 1e3 * np.stack([common + skew, common - skew], axis=1)

            slot = ring[k % nb]
            phi, phi_target = regress(taps, x_hat), regress(taps_target, x_a)
            phi_left = regress(taps_left, slot[:, :2])
            new += phi[:, :, None] * np.concatenate([phi, applied], axis=1)[:, None]
            old -= phi_left[:, :, None] * np.concatenate([phi_left, slot[:, 2:]], axis=1)[:, None]
            slot[:, :2], slot[:, 2:] = x_hat, applied
            # Also before the buffer is full, when the solution is not used: so a short run costs
            # as much a sample as a long one.
            total = old + new
            fitted = solve(total[:, :, :8] + pull_matrix, total[:, :, 8:] + pull_side, c)
            if k >= nb + 4:
                c = fitted
            if (k + 1) % nb == 0:
                old, new = new, np.zeros_like(new)
            u = applied = (phi_target[:, None] @ c)[:, 0]

            strokes[k] = np.concatenate([x_a, x_m, x_hat], axis=1)
            target = np.concatenate([x_a, num[:, :2], np.tile(job.reference[k], (T, 1))], axis=1)
            error = np.concatenate([x_m, q, q, num[:, 2:]], axis=1) - target
            pairs[0] += error**2
            pairs[1] += target**2
            np.maximum(pairs[2], np.abs(error), out=pairs[2])
            np.maximum(pairs[3], np.abs(target), out=pairs[3])
            volts = np.abs(u * job.volt_per_mm + job.volt_offset).max(1)
            volt_peak = np.maximum(volt_peak, volts)
            first_saturated[(volts > VOLT_LIMIT) & (first_saturated == NEVER)] = k
            inside = np.all((np.abs(u) <= RUNAWAY_MM) & (np.abs(x_m) <= RUNAWAY_MM), axis=1)
            first_bad[~inside & (first_bad == NEVER)] = k

            x = job.num_a * x + job.num_b * x[:, partner] + load @ job.num_B.T
            driven = (job.plant_B @ u[:, :, None])[:, :, 0]
            z = job.plant_a * z + job.plant_b * z[:, partner_8] + driven
            filtered = job.kal_a * zc + job.kal_b * zc[:, partner_8] + u @ job.kal_B.T
        correlation = np.stack([correlate(strokes, lag) for lag in range(-LEAD, LAGS - LEAD)], 2)
        return Sums(np.moveaxis(pairs, 0, 2), correlation, first_bad, first_saturated, volt_peak)

    return run


def correlate(strokes, lag):
    """(T, 4) sums over k of y(k) x(k - lag) for measured and estimated strokes."""
    N = strokes.shape[0]
    y, x = strokes[max(lag, 0) : N + min(lag, 0), :, 2:], strokes[max(-lag, 0) : N - max(lag, 0)]
    return np.concatenate(
        [np.einsum("kti,kti->ti", y[:, :, i : i + 2], x[:, :, :2]) for i in (0, 2)], axis=1
    )
