"""Value and derivatives of strokes by backward differences: regressors of feedforward models."""

from __future__ import annotations

import jax
import numpy as np

from martths_jax.once import once

#: Backward differences of second order for value and dt^j times the j-th derivative, from
#: samples k, k-1, ..., k-4 (the paper's C_D, scaled so that the columns stay comparable).
BACKWARD_DIFFERENCES = np.array(
    [
        [1.0, 0.0, 0.0, 0.0, 0.0],
        [1.5, -2.0, 0.5, 0.0, 0.0],
        [2.0, -5.0, 4.0, -1.0, 0.0],
        [2.5, -9.0, 12.0, -7.0, 1.5],
    ]
)
TAPS = BACKWARD_DIFFERENCES.shape[1]


@once
def regress(before, newest: jax.Array):
    """Regressor phi = [C_D x_1, C_D x_2] and the differences to remember for the next one.

    The rows of ``BACKWARD_DIFFERENCES`` are x, D + D^2/2, D^2 + D^3 and D^3 + 3/2 D^4 in powers of
    the backward difference D; D^n at a sample is D^(n-1) less D^(n-1) of the sample before.

    Args:
        before: for each actuator, x, D x, D^2 x and D^3 x (T,) of the sample before.
        newest: (2, T) this sample.

    Returns:
        for each actuator, its newest x ... D^3 x; phi as eight arrays (T,).
    """
    phi, kept = [], []
    for actuator in range(2):
        differences = [newest[actuator]]
        for earlier in before[actuator]:
            differences.append(differences[-1] - earlier)
        x, d1, d2, d3, d4 = differences
        phi += [x, d1 + 0.5 * d2, d2 + d3, d3 + 1.5 * d4]
        kept.append((x, d1, d2, d3))
    return tuple(kept), phi
