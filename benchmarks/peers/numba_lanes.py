"""Numba, trials blocked by hand: the scalar program with a loop over lanes inside every line."""

from __future__ import annotations

import numpy as np
from job import LAGS, LEAD, NEVER, RUNAWAY_MM, VOLT_LIMIT, Job, Sums

from peers.numba_scalar import SHARED
from peers.wide_numba import numba

LANES = 16
FASTMATH = {"contract", "nsz", "arcp"}
jit = numba.njit(fastmath=FASTMATH, error_model="numpy")


@jit
def combine(out, coefficients, x):
    """out (L,) = coefficients (n,) @ x (n, L)."""
    for l in range(LANES):
        out[l] = 0.0
    for s in range(coefficients.size):
        for l in range(LANES):
            out[l] += coefficients[s] * x[s, l]


@jit
def combine_own(out, coefficients, x):
    """The same with coefficients (n, L) of each trial's own, added to out."""
    for s in range(coefficients.shape[0]):
        for l in range(LANES):
            out[l] += coefficients[s, l] * x[s, l]


@jit
def regress(history, newest, phi):
    """Backward differences of newest (2, L) from those before in history (2, 4, L)."""
    for i in range(2):
        for l in range(LANES):
            d0 = newest[i, l]
            d1 = d0 - history[i, 0, l]
            d2 = d1 - history[i, 1, l]
            d3 = d2 - history[i, 2, l]
            d4 = d3 - history[i, 3, l]
            history[i, 0, l], history[i, 1, l] = d0, d1
            history[i, 2, l], history[i, 3, l] = d2, d3
            phi[4 * i, l] = d0
            phi[4 * i + 1, l] = d1 + 0.5 * d2
            phi[4 * i + 2, l] = d2 + d3
            phi[4 * i + 3, l] = d3 + 1.5 * d4


@jit
def add_row(G, row, sign):
    """Add an observation, row (10, L) of regressors and values, to G (8, 10, L)."""
    for i in range(8):
        for j in range(i, 10):
            for l in range(LANES):
                G[i, j, l] += sign * row[i, l] * row[j, l]


@jit
def fit(old, new, pull, anchor, M, good, c):
    """Pulled least squares by LDL' on M (8, 10, L); c (8, 2, L) stays where it cannot be used."""
    for i in range(8):
        for j in range(i, 10):
            for l in range(LANES):
                M[i, j, l] = old[i, j, l] + new[i, j, l]
        for l in range(LANES):
            M[i, i, l] += pull
            M[i, 8, l] += pull * anchor[i, 0]
            M[i, 9, l] += pull * anchor[i, 1]
    for l in range(LANES):
        good[l] = 1.0
    for j in range(8):
        for l in range(LANES):
            enough = M[j, j, l] >= 1e-14 * (old[j, j, l] + new[j, j, l] + pull)
            good[l] = good[l] if enough else 0.0
            M[j, j, l] = 1.0 / M[j, j, l]
        for i in range(j + 1, 8):
            for k in range(i, 10):
                for l in range(LANES):
                    M[i, k, l] -= M[j, i, l] * M[j, j, l] * M[j, k, l]
    for j in range(7, -1, -1):
        for s in range(2):
            for i in range(j + 1, 8):
                for l in range(LANES):
                    M[j, 8 + s, l] -= M[j, i, l] * M[i, 8 + s, l]
            for l in range(LANES):
                M[j, 8 + s, l] *= M[j, j, l]
                c[j, s, l] = M[j, 8 + s, l] if good[l] > 0.5 else c[j, s, l]


@jit
def interface_of(x_hat, arm, sin_a, cos_a, q):
    """Interface motion q (2, L) of the strokes; the angle by two half-angle steps and a series."""
    for l in range(LANES):
        sine = (x_hat[0, l] - x_hat[1, l]) / (2e3 * arm * sin_a)
        half = sine / (1.0 + np.sqrt(1.0 - sine * sine))
        q[0, l] = (x_hat[0, l] + x_hat[1, l]) / 2e3 + arm * cos_a * sine * half
        quarter = half / (1.0 + np.sqrt(1.0 + half * half))
        square, series = quarter * quarter, 0.0
        for n in range(14, 0, -1):
            series = square * (1.0 / (2 * n + 1) - series)
        q[1, l] = 4.0 * quarter * (1.0 - series)


@jit
def strokes_of(num, arm, sin_a, cos_a, x_a):
    """Strokes x_a (2, L) [mm] that put the interface to num[:2]."""
    for l in range(LANES):
        square, series = 0.25 * num[1, l] * num[1, l], 1.0
        for n in range(8, 0, -1):
            series = 1.0 - square / (2 * n * (2 * n + 1)) * series
        half = 0.5 * num[1, l] * series
        common = num[0, l] - 2 * arm * cos_a * half * half
        skew = 2 * arm * sin_a * half * np.sqrt(1.0 - half * half)
        x_a[0, l], x_a[1, l] = 1e3 * (common + skew), 1e3 * (common - skew)


@jit
def advance(a, b, x, B, u, x_next):
    """x_next = A x + B u of a shared modal system, x (n, L), u (m, L)."""
    for s in range(a.size):
        for l in range(LANES):
            x_next[s, l] = a[s] * x[s, l] + b[s] * x[s ^ 1, l]
        for i in range(u.shape[0]):
            for l in range(LANES):
                x_next[s, l] += B[s, i] * u[i, l]


@jit
def advance_own(a, b, x, B, u, x_next):
    """The same of each trial's own system, a and b (n, L), B (n, m, L)."""
    for s in range(a.shape[0]):
        for l in range(LANES):
            x_next[s, l] = a[s, l] * x[s, l] + b[s, l] * x[s ^ 1, l]
        combine_own(x_next[s], B[s], u)


@jit
def book(value, target, pairs):
    """Add a sample of one pair, (L,) each, to its sums (4, L)."""
    for l in range(LANES):
        error = value[l] - target[l]
        size, goal = abs(error), abs(target[l])
        pairs[0, l] += error * error
        pairs[1, l] += target[l] * target[l]
        pairs[2, l] = size if size > pairs[2, l] else pairs[2, l]
        pairs[3, l] = goal if goal > pairs[3, l] else pairs[3, l]


@jit
def watch(k, u, x_m, per_mm, offset, seen):
    """First samples out of range and beyond the volts, largest volts: seen (3, L)."""
    now = float(k)
    for i in range(2):
        for l in range(LANES):
            volts = abs(u[i, l] * per_mm[i] + offset[i])
            inside = abs(u[i, l]) <= RUNAWAY_MM and abs(x_m[i, l]) <= RUNAWAY_MM
            bad = NEVER if inside else now
            hot = now if volts > VOLT_LIMIT else NEVER
            seen[0, l] = bad if bad < seen[0, l] else seen[0, l]
            seen[1, l] = hot if hot < seen[1, l] else seen[1, l]
            seen[2, l] = volts if volts > seen[2, l] else seen[2, l]


@jit
def correlate(strokes, first, last, correlation):
    """Add samples first ... last - 1 of strokes (N + margins, 6, L) to correlation (4, LAGS, L)."""
    for i in range(4):
        for k in range(first, last):
            for n in range(LAGS):
                x, y = strokes[k + LEAD - n, i % 2], strokes[k, 2 + i]
                for l in range(LANES):
                    correlation[i, n, l] += x[l] * y[l]


@jit
def one_block(shared, plant, ground, reference, noise, pairs, correlation, seen):
    """The whole run of a block of trials; writes pairs, correlation and seen."""
    (num_a, num_b, num_B, num_C, num_D, kal_a, kal_b, kal_B, kal_C, kal_L, restoring, anchor,
     start, per_mm, offset, scalars) = shared  # fmt: skip
    p_a, p_b, p_B, p_C = plant
    arm, alpha, pull, nb = scalars[0], scalars[1], scalars[2], int(scalars[3])
    N, n, L = ground.size, num_a.size, LANES
    sin_a, cos_a = np.sin(alpha), np.cos(alpha)
    x, x_next, z, z_next = np.zeros((n, L)), np.zeros((n, L)), np.zeros((8, L)), np.zeros((8, L))
    filtered, zc, y = np.zeros((8, L)), np.zeros((8, L)), np.zeros((2, L))
    # q(k), q(k-1), q(k-2) and the load; a sample's strokes x_a, x_m, x_hat.
    past, load, num, u = np.zeros((6, L)), np.zeros((4, L)), np.zeros((6, L)), np.zeros((2, L))
    goal, direct = np.zeros(L), np.zeros(L)
    differences = np.zeros((3, 2, 4, L))
    row, row_left, phi = np.zeros((10, L)), np.zeros((10, L)), np.zeros((8, L))
    old, new, M = np.zeros((8, 10, L)), np.zeros((8, 10, L)), np.zeros((8, 10, L))
    c, good, ring = np.zeros((8, 2, L)), np.zeros(L), np.zeros((nb, 4, L))
    for j in range(8):
        for s in range(2):
            c[j, s] = start[j, s]
    margin = LAGS
    strokes = np.zeros((margin + nb + margin, 6, L))
    taps = restoring.transpose(1, 0, 2).copy().reshape(3, 6)
    for k in range(N):
        now = strokes[margin + k % nb]
        x_a, x_m, x_hat = now[:2], now[2:4], now[4:]
        for i in range(2):
            x_m[i] = noise[k]
            combine_own(x_m[i], p_C[i], z)
            combine(y[i], kal_C[i], filtered)
            for l in range(L):
                y[i, l] = x_m[i, l] - y[i, l]
        for s in range(8):
            for l in range(L):
                zc[s, l] = filtered[s, l] + kal_L[s, 0] * y[0, l] + kal_L[s, 1] * y[1, l]
        for i in range(2):
            combine(x_hat[i], kal_C[i], zc)
        for i in range(2):
            for l in range(L):
                past[4 + i, l] = past[2 + i, l]
                past[2 + i, l] = past[i, l]
        interface_of(x_hat, arm, sin_a, cos_a, past[:2])
        if k == 0:
            past[2:4], past[4:] = past[:2], past[:2]
        load[0] = ground[k]
        for f in range(3):
            combine(load[f + 1], taps[f], past)
            for l in range(L):
                load[f + 1, l] = -load[f + 1, l]
        for o in range(6):
            combine(num[o], num_C[o], x)
            combine(direct, num_D[o], load)
            for l in range(L):
                num[o, l] += direct[l]
        strokes_of(num, arm, sin_a, cos_a, x_a)

        slot = ring[k % nb]
        regress(differences[0], x_hat, row[:8])
        regress(differences[1], slot[:2], row_left[:8])
        regress(differences[2], x_a, phi)
        for i in range(2):
            for l in range(L):
                row[8 + i, l], row_left[8 + i, l] = u[i, l], slot[2 + i, l]
                slot[i, l], slot[2 + i, l] = x_hat[i, l], u[i, l]
        add_row(new, row, 1.0)
        add_row(old, row_left, -1.0)
        if k >= nb + 4:
            fit(old, new, pull, anchor, M, good, c)
        for i in range(2):
            u[i] = 0.0
            for j in range(8):
                for l in range(L):
                    u[i, l] += c[j, i, l] * phi[j, l]

        for i in range(2):
            book(x_m[i], x_a[i], pairs[i])
            book(past[i], num[i], pairs[2 + i])
        for i in range(6):
            goal[:] = reference[k, i]
            book(past[i] if i < 2 else num[i], goal, pairs[4 + i])
        watch(k, u, x_m, per_mm, offset, seen)
        advance(num_a, num_b, x, num_B, load, x_next)
        advance_own(p_a, p_b, z, p_B, u, z_next)
        advance(kal_a, kal_b, zc, kal_B, u, filtered)
        x, x_next = x_next, x
        z, z_next = z_next, z

        if (k + 1) % nb == 0 or k == N - 1:
            # The last LEAD samples of a window wait for the targets that follow them.
            end = margin + k % nb + 1
            strokes[end : end + LEAD] = 0.0
            correlate(strokes, margin - LEAD, end if k == N - 1 else end - LEAD, correlation)
            strokes[:margin] = strokes[end - margin : end].copy()
            old[:] = new
            new[:] = 0.0


@numba.njit(parallel=True, fastmath=FASTMATH)
def all_blocks(shared, a, b, B, C, ground, reference, noise, pairs, correlation, seen):
    for t in numba.prange(a.shape[0]):
        plant = (a[t], b[t], B[t], C[t])
        one_block(shared, plant, ground, reference, noise[t], pairs[t], correlation[t], seen[t])


def prepare(job: Job):
    """A function without arguments that runs the job."""
    T = job.trials
    lanes = np.minimum(np.arange(-(-T // LANES) * LANES), T - 1).reshape(-1, LANES)
    last = lambda x: np.ascontiguousarray(np.moveaxis(x[lanes], 1, -1))  # noqa: E731
    plants = [last(x) for x in (job.plant_a, job.plant_b, job.plant_B, job.plant_C)]
    shared = tuple(np.ascontiguousarray(getattr(job, name)) for name in SHARED)
    noise = np.empty((len(lanes), job.samples, LANES))
    for b, which in enumerate(lanes):
        noise[b] = job.noise[:, which]

    def run() -> Sums:
        pairs = np.zeros((len(lanes), 10, 4, LANES))
        correlation = np.zeros((len(lanes), 4, LAGS, LANES))
        seen = np.zeros((len(lanes), 3, LANES))
        seen[:, :2] = NEVER
        outcome = (pairs, correlation, seen)
        all_blocks(shared, *plants, job.ground, job.reference, noise, *outcome)
        trial = [np.moveaxis(x, -1, 1).reshape(-1, *x.shape[1:-1])[:T] for x in outcome]
        return Sums(trial[0], trial[1], *trial[2].T)

    return run
