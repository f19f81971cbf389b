"""What every integrator offers."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np


class Integrator(ABC):
    """One-step method for a linear system with inputs known at the samples."""

    @abstractmethod
    def discretise(
        self, A: np.ndarray, B: np.ndarray, C: np.ndarray, dt: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Discrete (A, B, C, D) of x' = A x + B u, y = C x.

        y(k) may depend on u(k) (D not zero) where the method is implicit.

        Args:
            A, B, C: (n, n), (n, i), (o, n) continuous matrices.
            dt: time step [s].
        """
