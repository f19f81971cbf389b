"""Estimators of the actuators' strokes, one file each."""

from martths_jax.control.estimators.direct import DirectMeasurement
from martths_jax.control.estimators.kalman import KalmanFilter, design_kalman

__all__ = ["DirectMeasurement", "KalmanFilter", "design_kalman"]
