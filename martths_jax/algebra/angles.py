"""Sines and angles by their series, to the last digit, for the rotations of a frame.

The library functions are a scalar call per element on CPUs and took a third of the whole loop.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp


def sine(x: jax.Array) -> jax.Array:
    """sin(x), to the last digit for |x| <= 1/2 (half a rotation of one radian)."""
    square, series = x * x, 1.0
    for n in range(8, 0, -1):
        series = 1.0 - square * (1 / (2 * n * (2 * n + 1))) * series
    return x * series


def angle(half: jax.Array) -> jax.Array:
    """Angle in [-1, 1] rad with the given tangent of its half, to the last digit.

    A second half-angle step tan(a/2) = tan(a) / (1 + sqrt(1 + tan(a)^2)) brings the argument under
    0.26, where the series of the arc tangent is short.
    """
    quarter = half / (1 + jnp.sqrt(1 + half * half))
    square, series = quarter * quarter, 0.0
    for n in range(14, 0, -1):
        series = square * (1 / (2 * n + 1) - series)
    return 4 * quarter * (1 - series)
