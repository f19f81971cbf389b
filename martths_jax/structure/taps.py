"""Matrices of second order as taps on the last three samples of a motion."""

from __future__ import annotations

import numpy as np


def backward_taps(M, C, K, dt: float) -> np.ndarray:
    """(3, f, d) maps R_0, R_1, R_2 of f(k) = R_0 q(k) + R_1 q(k-1) + R_2 q(k-2).

    Velocity and acceleration by backward differences, so that K q + C dq/dt + M d2q/dt2 becomes

        R_0 = K + C / dt + M / dt^2,  R_1 = -C / dt - 2 M / dt^2,  R_2 = M / dt^2

    Args:
        M, C, K: (f, d) mass, damping and stiffness from a motion to a force [SI].
        dt: sample period [s].
    """
    return np.stack([K + C / dt + M / dt**2, -C / dt - 2 * M / dt**2, M / dt**2])
