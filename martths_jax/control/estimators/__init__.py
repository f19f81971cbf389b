"""Estimators of the actuators' strokes, one file each."""

from martths_jax.control.estimators.adaptive import AdaptiveKalmanFilter, design_adaptive
from martths_jax.control.estimators.direct import DirectMeasurement
from martths_jax.control.estimators.kalman import KalmanFilter, design_kalman

__all__ = [
    "AdaptiveKalmanFilter",
    "DirectMeasurement",
    "KalmanFilter",
    "design_adaptive",
    "design_kalman",
]
