"""Exact integration with the input held over the step."""

from __future__ import annotations

import numpy as np
from scipy import signal

from martths_jax.structure.integrators.base import Integrator


class ZeroOrderHold(Integrator):
    """x(k+1) = exp(A dt) x(k) + int_0^dt exp(A s) ds B u(k)."""

    def discretise(self, A, B, C, dt):
        D = np.zeros((C.shape[0], B.shape[1]))
        A_d, B_d, C_d, D_d, _ = signal.cont2discrete((A, B, C, D), dt, method="zoh")
        return A_d, B_d, C_d, D_d
