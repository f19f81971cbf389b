"""Newmark's average acceleration (gamma 1/2, beta 1/4), the benchmark's integrator."""

from __future__ import annotations

import numpy as np

from martths_jax.structure.integrators.base import Integrator


class Newmark(Integrator):
    """Average acceleration: implicit, the displacement at k answers the force at k.

    For d and v as states it is the trapezoidal rule,

        x(k+1) = P [(I + h A) x(k) + h B (u(k) + u(k+1))],   h = dt/2, P = (I - h A)^-1,

    which becomes a system in s(k) = x(k) - h P B u(k):

        s(k+1) = A_d s(k) + (A_d + I) h P B u(k),   y(k) = C s(k) + C h P B u(k),

    with A_d = P (I + h A).  Starting from s = 0 is starting from rest and no force at k = -1.
    """

    def discretise(self, A, B, C, dt):
        h = dt / 2
        identity = np.eye(A.shape[0])
        A_d = np.linalg.solve(identity - h * A, identity + h * A)
        hPB = np.linalg.solve(identity - h * A, h * B)
        return A_d, (A_d + identity) @ hPB, C, C @ hPB
