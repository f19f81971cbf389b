"""Inverse of the nominal plant in the adaptive controller's own coefficients (on the host).

Where the motion says nothing about a coefficient, an identification needs something to fall back
on.  "Do nothing" (u = x_a) is far from every plant; the inverse of the nominal plant, which the
Kalman filter knows anyway, is near all of them.
"""

from __future__ import annotations

import numpy as np

from martths_jax.structure.modal import ModalSystem, to_dense

#: Commands are taken as evenly strong up to here, just above the structure's second mode [Hz].
BAND_HZ = 15.0
#: Strength of white noise on the strokes relative to those commands [-].  Without any, the best
#: fit leans on third derivatives that amplify the highest frequencies ten-thousandfold, and the
#: loop with these coefficients is unstable by itself; 1e-9 to 1e-6 all serve.
NOISE_SHARE = 1e-9


def nominal_inverse(
    model: ModalSystem,
    fs: float,
    differences: np.ndarray,
    *,
    band_hz: float = BAND_HZ,
    noise_share: float = NOISE_SHARE,
    points: int = 400,
) -> np.ndarray:
    """Coefficients C that minimise the mean square of u(k-1) - C' phi(k) for white commands.

        C = (mean Re Phi H H* Phi* + s D)^-1 mean Re Phi H z,   |f| <= band

    with the plant's frequency response H, the regressor Phi of unit strokes, and the covariance
    D of the regressor under white noise of share s.

    Args:
        model: plant, shared by all trials.
        fs: sampling rate [Hz].
        differences: (d, taps) backward differences of one stroke, phi = differences @ samples.
        band_hz: band of the commands; half the sampling rate if that is less [Hz].
        noise_share: s above.
        points: frequencies of the mean.

    Returns:
        (n d, n) coefficients of n actuators.
    """
    A, B, C, _ = to_dense(model)
    return dense_inverse(
        (A, B, C), fs, differences, band_hz=band_hz, noise_share=noise_share, points=points
    )


def dense_inverse(
    plant: tuple[np.ndarray, np.ndarray, np.ndarray],
    fs: float,
    differences: np.ndarray,
    *,
    band_hz: float = BAND_HZ,
    noise_share: float = NOISE_SHARE,
    points: int = 400,
) -> np.ndarray:
    """``nominal_inverse`` of any system (A, B, C) with as many strokes as commands."""
    A, B, C = plant
    d, taps = differences.shape
    n = len(C)
    z = np.exp(2j * np.pi * np.linspace(0, min(band_hz, fs / 2), points + 1)[1:] / fs)
    H = C @ np.linalg.solve(z[:, None, None] * np.eye(len(A)) - A, B)  # (points, stroke, command)
    of_unit = z[:, None] ** -np.arange(taps) @ differences.T  # (points, d)
    phi = (H[:, :, None, :] * of_unit[:, None, :, None]).reshape(points, n * d, n)
    G = np.mean(phi @ phi.conj().swapaxes(1, 2), axis=0).real
    h = np.mean(phi * z[:, None, None], axis=0).real  # u(k-1) is u(k) / z
    noise = np.kron(np.eye(n), differences @ differences.T)
    return np.linalg.solve(G + noise_share * noise, h)
