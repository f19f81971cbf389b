"""Classical fourth-order Runge-Kutta with the input held over the step (the paper's text)."""

from __future__ import annotations

import numpy as np

from martths_jax.structure.integrators.base import Integrator


class RungeKutta4(Integrator):
    """x(k+1) = sum_{j<=4} (dt A)^j / j! x(k) + dt sum_{j<=3} (dt A)^j / (j+1)! B u(k)."""

    def discretise(self, A, B, C, dt):
        n = A.shape[0]
        A_d, S = np.eye(n), np.eye(n)
        term = np.eye(n)
        for j in range(1, 5):
            term = term @ (dt * A) / j
            A_d = A_d + term
            if j < 4:
                S = S + term / (j + 1)
        radius = np.abs(np.linalg.eigvals(A_d)).max()
        if radius > 1:
            raise ValueError(
                f"Runge-Kutta 4 is unstable for this structure at fs = {1 / dt:g} Hz (spectral "
                f"radius {radius:.3g}); raise fs or choose newmark or zoh."
            )
        return A_d, dt * S @ B, C, np.zeros((C.shape[0], B.shape[1]))
