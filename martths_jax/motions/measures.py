"""Intensity measures of an accelerogram.

Definitions: Kramer, *Geotechnical Earthquake Engineering*, 1996, section 3.3; Arias (1970) for the
intensity, Husid (1969) for its build-up, Trifunac & Brady (1975) for the significant duration,
EPRI (1988) for the cumulative absolute velocity.
"""

from __future__ import annotations

import numpy as np

from .spectra import response_spectrum
from .units import G


def _running_integral(values: np.ndarray, dt: float) -> np.ndarray:
    """(n,) integral from the first sample on, by the trapezoidal rule."""
    return np.concatenate([[0.0], np.cumsum(0.5 * dt * (values[1:] + values[:-1]))])


def peak_ground_acceleration(acceleration: np.ndarray) -> float:
    """PGA: max|a| [m/s^2]."""
    return float(np.max(np.abs(acceleration)))


def ground_velocity(acceleration: np.ndarray, dt: float) -> np.ndarray:
    """(n,) ground velocity [m/s], integrated as it stands: no baseline is taken off."""
    return _running_integral(np.asarray(acceleration), dt)


def peak_ground_velocity(acceleration: np.ndarray, dt: float) -> float:
    """PGV: max of `ground_velocity` [m/s]."""
    return float(np.max(np.abs(ground_velocity(acceleration, dt))))


def husid(acceleration: np.ndarray, dt: float) -> np.ndarray:
    """(n,) Arias intensity up to each sample [m/s]: pi/(2 g) times the integral of a^2."""
    return np.pi / (2 * G) * _running_integral(np.asarray(acceleration) ** 2, dt)


def arias_intensity(acceleration: np.ndarray, dt: float) -> float:
    """Arias intensity [m/s]."""
    return float(husid(acceleration, dt)[-1])


def cumulative_absolute_velocity(acceleration: np.ndarray, dt: float) -> float:
    """CAV: integral of |a| [m/s]."""
    return float(_running_integral(np.abs(acceleration), dt)[-1])


def crossing_times(buildup: np.ndarray, dt: float, fractions: np.ndarray) -> np.ndarray:
    """(F,) first times [s] at which a non-decreasing (n,) curve reaches fractions of its end."""
    levels = np.atleast_1d(fractions) * buildup[-1]
    after = np.clip(np.searchsorted(buildup, levels), 1, buildup.size - 1)
    low, high = buildup[after - 1], buildup[after]
    rise = np.where(high > low, high - low, 1.0)
    return dt * (after - 1 + np.clip((levels - low) / rise, 0.0, 1.0))


def significant_duration(
    acceleration: np.ndarray, dt: float, start: float = 0.05, end: float = 0.95
) -> float:
    """Time between two fractions of the Arias intensity [s]; D5-95 by default."""
    first, last = crossing_times(husid(acceleration, dt), dt, np.array([start, end]))
    return float(last - first)


def spectral_acceleration(
    acceleration: np.ndarray, dt: float, frequency: float, damping: float = 0.05
) -> float:
    """Pseudo-acceleration [m/s^2] of one oscillator of natural `frequency` [Hz]."""
    return float(response_spectrum(acceleration, dt, 1.0 / frequency, damping)[0])


def intensity_measures(
    acceleration: np.ndarray, dt: float, frequency: float, damping: float = 0.05
) -> dict[str, float]:
    """The measures that ``martths motions`` lists, by name; `frequency` [Hz] is that of ``Sa``."""
    return {
        "PGA": peak_ground_acceleration(acceleration),
        "PGV": peak_ground_velocity(acceleration, dt),
        "Arias": arias_intensity(acceleration, dt),
        "CAV": cumulative_absolute_velocity(acceleration, dt),
        "D5-95": significant_duration(acceleration, dt),
        "Sa": spectral_acceleration(acceleration, dt, frequency, damping),
    }
