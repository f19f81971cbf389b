"""The LQG loop in the frequency domain: all 24 indices of a record in a fraction of a second.

With LQG the whole loop is linear but for the coupler, whose second-order terms are of the order of
the joint's rotation (a few mrad).  So a candidate's signals follow from 2 x 2 transfer functions on
a grid of z and one inverse FFT a signal.  The grid lies on |z| = rho > 1, slightly outside the unit
circle: the record's end then does not wrap around into its beginning, and a slowly unstable loop
shows as what it is, growth.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import numpy as np

from martths_jax import Benchmark, SensorNoise, build_benchmark
from martths_jax.benchmark import LAYOUT
from martths_jax.coupler import actuator_to_frame
from martths_jax.indices import DELAYS, NAMES, PAIRS
from martths_jax.simulation import reference_response
from martths_jax.structure.modal import to_dense

LENGTH = 65536
DAMPING = 8.0  # rho^LENGTH = exp(DAMPING)
BAND, SKIP = LENGTH // 8, 64  # every bin up to 128 Hz, every 64th of the smooth rest


def transfer(system, z):
    """(F, outputs, inputs) of a discrete modal system at z (F,)."""
    A, B, C, D = to_dense(system)
    return dense_transfer(A, B, C, z) + D


def dense_transfer(A, B, C, z):
    poles, V = np.linalg.eig(A)
    left, right = C @ V, np.linalg.solve(V, B.astype(complex))
    residues = left.T[:, :, None] * right[:, None, :]
    return ((1 / (z[:, None] - poles)) @ residues.reshape(poles.size, -1)).reshape(
        z.size, *residues.shape[1:]
    )


def inverse(M):
    """Inverse of (F, 2, 2)."""
    a, b, c, d = M[:, 0, 0], M[:, 0, 1], M[:, 1, 0], M[:, 1, 1]
    adjugate = np.stack([np.stack([d, -b], -1), np.stack([-c, a], -1)], 1)
    return adjugate / (a * d - b * c)[:, None, None]


@dataclass(frozen=True)
class DenseNominal:
    """The part of ``LinearLoop`` that a design needs: benchmark and dense plant (A, B, C)."""

    benchmark: Benchmark
    plant_dense: tuple


def dense_nominal(benchmark: Benchmark) -> DenseNominal:
    """``DenseNominal`` of a benchmark."""
    return DenseNominal(benchmark, to_dense(benchmark.plant_model)[:3])


class LinearLoop:
    """Everything that does not depend on the candidate.

    Args:
        motions: records at the benchmark's rate, at most LENGTH samples each.
    """

    def __init__(self, motions):
        self.benchmark = b = build_benchmark()
        rho = np.exp(DAMPING / LENGTH)
        bins = np.concatenate([np.arange(BAND), np.arange(BAND, LENGTH // 2 + 1, SKIP)])
        self.z = rho * np.exp(2j * np.pi * bins / LENGTH)
        self.growth = rho ** np.arange(LENGTH)[:, None]
        z = self.z
        self.plant = transfer(b.plant_model, z)
        self.plant_dense = to_dense(b.plant_model)[:3]
        N = transfer(b.numerical, z)
        J = np.asarray(
            jax.jacobian(lambda x: actuator_to_frame(b.coupler, x[:, None])[:, 0])(np.zeros(2))
        )
        taps = np.asarray(b.specimen.taps)
        F = taps[0] + taps[1] / z[:, None, None] + taps[2] / z[:, None, None] ** 2
        self.J, self.J_inverse = J, np.linalg.inv(J)
        self.ground_to_num, self.force_to_num = N[:, :, :1], -N[:, :, 1:] @ F @ J
        self.integrator = b.dt / (1 - 1 / z)[:, None, None]
        self.records = []
        for motion in motions:
            ag = np.asarray(motion.acceleration)
            noise = np.asarray(SensorNoise().draw(np.array([0]), ag.size, b.fs))[:, 0, 0]
            self.records.append(
                (
                    ag.size,
                    self.spectrum(ag),
                    self.spectrum(noise),
                    np.asarray(reference_response(b, ag)),
                )
            )

    def spectrum(self, x):
        return np.fft.rfft(x / self.growth[: x.size, 0], LENGTH)

    def signal(self, X):
        """(LENGTH, ...) signals whose spectrum is given."""
        return np.fft.irfft(X, LENGTH, axis=0) * self.growth

    def every_bin(self, H):
        """H (z, n) on the grid, between its points on a straight line."""
        low, high = H[:BAND], H[BAND:]
        part = (np.arange(SKIP) / SKIP)[:, None]
        between = high[:-1, None] * (1 - part) + high[1:, None] * part
        return np.concatenate([low, between.reshape(-1, H.shape[1]), high[-1:]])

    def indices(self, K, L, error="measured"):
        """Mean indices over the records, and the interpolated delays of each.

        Args:
            K: (2, 10) gain on (z_hat, e), states slot by slot.
            L: (8, 2) filter gain.
            error: which one is integrated, as ``LQG`` has it.

        Returns:
            mapping of the 24 (delays in whole samples, as printed), (records, 4) delays in samples,
            (records, 2) largest valve commands [V].
        """
        A, B, C = self.plant_dense
        K_z, K_e = K[:, :8], K[:, 8:]
        keep = np.eye(8) - L @ C
        # Filter: [K_z; C] z_hat = of measurement and command.
        both = dense_transfer(A @ keep, np.hstack([A @ L, B]), np.vstack([K_z, C]) @ keep, self.z)
        direct = np.vstack([K_z, C]) @ L
        Kz_m, Kz_u = both[:, :2, :2] + direct[:2], both[:, :2, 2:]
        C_m, C_u = both[:, 2:, :2] + direct[2:], both[:, 2:, 2:]
        I = np.eye(2)
        KE = K_e * self.integrator
        # The integral answers the measurement itself, or what the filter makes of it.
        KE_m, KE_u = (KE, 0 * KE) if error == "measured" else (KE @ C_m, KE @ C_u)
        front = inverse(I + Kz_u - KE_u)
        U_m, U_a = front @ (KE_m - Kz_m), -front @ KE
        S = inverse(I - self.plant @ U_m)
        T = S @ self.plant @ U_a
        hat_a, hat_w = C_m @ T + C_u @ (U_m @ T + U_a), (C_m + C_u @ U_m) @ S
        ones = np.ones((2, 1))
        back = self.J_inverse @ self.force_to_num[:, :2]
        loop = inverse(I - back @ hat_a)
        a_g = loop @ (self.J_inverse @ self.ground_to_num[:, :2])
        a_w = loop @ (back @ (hat_w @ ones))
        U = U_m, U_a
        all_g = self.every_bin(self._outputs(a_g, 0.0, T, S, hat_a, hat_w, U, 1.0))
        all_w = self.every_bin(self._outputs(a_w, ones, T, S, hat_a, hat_w, U, 0.0))
        rows, delays, volts = [], [], []
        for samples, ground, noise, reference in self.records:
            X = all_g * ground[:, None] + all_w * noise[:, None]
            x = self.signal(X)[:samples]
            row, delay = evaluate(self.J, x[:, :12], reference, self.benchmark.fs)
            rows.append(row)
            delays.append(delay)
            volts.append(np.abs(np.asarray(LAYOUT.valves.volts(x[:, 12:].T))).max(axis=1))
        mean = dict(zip(NAMES, np.mean(rows, axis=0), strict=True))
        return mean, np.array(delays), np.array(volts)

    def _outputs(self, x_a, w, T, S, hat_a, hat_w, U, ground):
        """(F, 14): x_a, x_m, x_hat, num, u as transfer functions of one scalar input."""
        x_m, hat = T @ x_a, hat_a @ x_a
        if np.ndim(w):
            x_m, hat = x_m + S @ w, hat + hat_w @ w
        num = self.force_to_num @ hat
        if ground:
            num = num + self.ground_to_num
        command = U[0] @ x_m + U[1] @ x_a
        return np.concatenate([x_a, x_m, hat, num, command], axis=1)[:, :, 0]


def evaluate(J, x, reference, fs):
    """24 indices of one record, as ``martths_jax.indices`` has them, and delays between samples.

    Args:
        J: (2, 2) from strokes to interface motion.
        x: (N, 12) strokes x_a, x_m, x_hat [mm] and motion num [m, rad].
        reference: (N, 6) reference motion.
    """
    x_a, x_m, hat, num = x[:, :2], x[:, 2:4], x[:, 4:6], x[:, 6:]
    est = hat @ J.T
    found = {}
    values = np.hstack([x_m, est, est, num[:, 2:]])
    targets = np.hstack([x_a, num[:, :2], reference[:, :2], reference[:, 2:]])
    error = values - targets
    rms = 100 * np.sqrt((error**2).sum(0) / (targets**2).sum(0))
    peak = 100 * np.abs(error).max(0) / np.abs(targets).max(0)
    for (a, b), r, p in zip(PAIRS, rms, peak, strict=True):
        found[a], found[b] = r, p
    delays = []
    lags = np.arange(-1, 7)
    for name, y, t in zip(
        DELAYS,
        (x_m[:, 0], x_m[:, 1], hat[:, 0], hat[:, 1]),
        (x_a[:, 0], x_a[:, 1]) * 2,
        strict=True,
    ):
        n = y.size
        r = np.array([y[max(l, 0) : n + min(l, 0)] @ t[max(-l, 0) : n - max(l, 0)] for l in lags])
        best = int(np.argmax(r))
        inside = min(max(best, 1), lags.size - 2)
        bend = r[inside - 1] - 2 * r[inside] + r[inside + 1]
        delays.append(lags[inside] + (r[inside - 1] - r[inside + 1]) / (2 * bend))
        found[name] = lags[best] / fs * 1e3
    return np.array([found[name] for name in NAMES]), np.array(delays)
