"""Steady-state Kalman filter on the nominal plant, in its current-estimate form.

Each sample first corrects the prediction with the measurement of the same sample, then predicts
the next one with the command:

    x_hat(k) = x_pred(k) + L (y(k) - C x_pred(k)),   x_pred(k+1) = A x_hat(k) + B u(k)

L is the *filter gain* P C' (C P C' + R)^-1; the *predictor gain* of the one-step form is A L.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

import jax
import jax.numpy as jnp
import numpy as np
from scipy import linalg

from martths_jax.algebra.riccati import dense_kalman_gain
from martths_jax.control.base import Estimator
from martths_jax.errors import argument_error, as_numbers
from martths_jax.runtime import check_precision
from martths_jax.structure.modal import ModalSystem, advance, output, spread, to_dense


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class KalmanFilter(Estimator):
    """Filter of the actuator strokes.

    Attributes:
        model: nominal plant, m slots.
        filter_gain: (2, m, 2) or (2, m, 2, T), L above, slot by slot.
    """

    model: ModalSystem
    filter_gain: jax.Array

    #: Axes when all trials share the gain; one more counts them (see ``Controller``).
    shared_axes = MappingProxyType({"filter_gain": 3})

    def init(self, trials: int) -> jax.Array:
        """Prediction for k = 0: the plant at rest, (2, m, T)."""
        return jnp.zeros(self.model.a.shape[:2] + (trials,))

    def correct(self, predicted: jax.Array, x_m: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Corrected state (2, m, T) and estimated strokes (2, T) [mm]."""
        innovation = x_m - output(self.model, predicted)
        state = predicted + spread(self.filter_gain, innovation)
        return state, output(self.model, state)

    def predict(self, state: jax.Array, u: jax.Array) -> jax.Array:
        """Prediction for the next sample from the corrected state and the command (2, T)."""
        return advance(self.model, state, u)


def steady_state_gains(A, B, C, q: float, r: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Steady-state Kalman gains of x(k+1) = A x + B (u + w), y = C x + v.

    Args:
        A, B, C: (n, n), (n, i), (o, n) discrete plant.
        q: variance of the process noise w on each input [mm^2]; Q = q B B'.
        r: variance of the measurement noise v on each output [mm^2].

    Returns:
        filter gain L (n, o), predictor gain A L (n, o), prediction covariance P (n, n).
    """
    P = linalg.solve_discrete_are(A.T, C.T, q * B @ B.T, r * np.eye(C.shape[0]))
    L = linalg.solve(C @ P @ C.T + r * np.eye(C.shape[0]), C @ P, assume_a="pos").T
    return L, A @ L, P


def design_kalman(model: ModalSystem, q, r: float) -> KalmanFilter:
    """Kalman filter of a plant.

    Args:
        model: nominal plant (T = 1).
        q: process noise through the plant's input [mm^2], one for all trials or one a trial (T,);
            may be traced.
        r: measurement noise a sample [mm^2].

    Raises:
        InputError: if q or r is not positive and finite, or no filter can be found.
    """
    check_precision()
    A, B, C, _ = to_dense(model)
    if isinstance(q, jax.core.Tracer):
        gain = lambda one: dense_kalman_gain(A, B, C, one, r)  # noqa: E731
        return KalmanFilter(model, jax.vmap(gain, out_axes=-1)(q) if q.ndim else gain(q))
    for name, value, most_axes in (("q", q, 1), ("r", r, 0)):
        number = as_numbers(value)
        if number.ndim > most_axes or not np.all(np.isfinite(number) & (number > 0)):
            raise argument_error(name, "be positive and finite (mm^2)", repr(value)[:80])
    gains = {one: _slots(A, B, C, one, r) for one in np.unique(np.asarray(q, dtype=float))}
    if np.ndim(q):
        return KalmanFilter(model, jnp.asarray(np.stack([gains[one] for one in q], axis=-1)))
    return KalmanFilter(model, jnp.asarray(gains[float(q)]))


def _slots(A, B, C, q: float, r: float) -> np.ndarray:
    """Filter gain (2, m, 2), slot by slot."""
    try:
        L, _, _ = steady_state_gains(A, B, C, q, r)
    except (np.linalg.LinAlgError, ValueError) as error:
        wanted = f"give a filter's Riccati equation that can be solved, with r = {r:g} mm^2"
        raise argument_error("q", wanted, f"{q:g} ({error})") from None
    return np.transpose(L.reshape(len(A) // 2, 2, -1), (1, 0, 2))
