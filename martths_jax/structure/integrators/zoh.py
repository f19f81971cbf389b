"""Exact integration with the input held over the step."""

from __future__ import annotations

import numpy as np
from scipy import linalg

from martths_jax.structure.integrators.base import Integrator


class ZeroOrderHold(Integrator):
    """x(k+1) = exp(A dt) x(k) + int_0^dt exp(A s) ds B u(k), both from one exponential:

    exp([[A, B], [0, 0]] dt) = [[A_d, B_d], [0, I]].
    """

    def discretise(self, A, B, C, dt):
        # scipy.signal has this as cont2discrete and takes a second to import.
        n, m = B.shape
        both = np.vstack([np.hstack([A, B]), np.zeros((m, n + m))])
        upper = linalg.expm(dt * both)[:n]
        return upper[:, :n], upper[:, n:], C, np.zeros((C.shape[0], m))
