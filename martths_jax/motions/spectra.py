"""Response of linear oscillators to a piecewise-linear ground acceleration, and its spectra.

Between two samples the ground acceleration is a straight line, for which the oscillator

    x'' + 2 zeta w x' + w^2 x = -a(t)

has an exact solution: (x, v) at k + 1 is a linear map of (x, v) at k and of a(k), a(k + 1)
(Nigam & Jennings, Bull. Seism. Soc. Am. 59(2), 1969, eqs. 2-8).  Eliminating v, or x, leaves one
second-order difference equation for each, which a recursive filter runs at compiled speed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from ..errors import argument_error
from .checks import check_memory

#: Evaluated points in one period of the oscillator: a peak between two points is then missed by
#: at most 1 - cos(pi/40) = 0.3 %.
POINTS_PER_PERIOD = 40


@dataclass(frozen=True)
class Oscillator:
    """Difference equations of one oscillator at one time step.

    Attributes:
        displacement: (3,) weights of a(k), a(k-1), a(k-2) in the equation of x(k) [s^2].
        velocity: (3,) the same in that of v(k) [s].
        recursion: (3,) 1, -trace, determinant of the free-vibration map [-].
        first: (2,) weight of a(0) in x(1) and v(1), for a start from rest.
    """

    displacement: np.ndarray
    velocity: np.ndarray
    recursion: np.ndarray
    first: np.ndarray

    def run(self, acceleration: np.ndarray, quantity: str = "displacement") -> np.ndarray:
        """(n,) displacement [m] or velocity [m/s] under (n,) ground acceleration, from rest."""
        # A second that only who asks for a spectrum has to wait for.
        from scipy.signal import lfilter

        weights = getattr(self, quantity)
        start = self.first[0 if quantity == "displacement" else 1]
        # Filter memory that makes the response at k = 0 zero and at k = 1 that of the step's map.
        memory = acceleration[0] * np.array([-weights[0], start - weights[1]])
        return lfilter(weights, self.recursion, acceleration, zi=memory)[0]


def oscillators(periods: np.ndarray, damping: float, dt: np.ndarray | float) -> list[Oscillator]:
    """`Oscillator` of every period (P,) [s] at step `dt` (scalar or (P,)) [s]."""
    periods = np.atleast_1d(np.asarray(periods, dtype=np.float64))
    omega = 2 * np.pi / periods
    step = np.broadcast_to(dt, periods.shape)
    # Augmented state (x, v, a, slope): its exponential holds the exact map of a linear segment.
    system = np.zeros((periods.size, 4, 4))
    system[:, 0, 1] = 1.0
    system[:, 1, 0] = -(omega**2)
    system[:, 1, 1] = -2 * damping * omega
    system[:, 1, 2] = -1.0
    system[:, 2, 3] = 1.0
    maps = expm(system * step[:, None, None])
    return [_eliminate(m[:2, :2], m[:2, 2], m[:2, 3] / h) for m, h in zip(maps, step, strict=True)]


def _eliminate(a: np.ndarray, constant: np.ndarray, slope: np.ndarray) -> Oscillator:
    """Difference equations of x and v from (x, v)(k+1) = A (x, v)(k) + b0 a(k) + b1 a(k+1)."""
    b1 = slope
    b0 = constant - slope
    x = [b1[0], b0[0] + a[0, 1] * b1[1] - a[1, 1] * b1[0], a[0, 1] * b0[1] - a[1, 1] * b0[0]]
    v = [b1[1], b0[1] + a[1, 0] * b1[0] - a[0, 0] * b1[1], a[1, 0] * b0[0] - a[0, 0] * b0[1]]
    recursion = [1.0, -(a[0, 0] + a[1, 1]), a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]]
    return Oscillator(np.array(x), np.array(v), np.array(recursion), b0)


def subdivision(periods: np.ndarray, dt: float, points: int = POINTS_PER_PERIOD) -> np.ndarray:
    """(P,) power of two by which `dt` is divided to have `points` in every period."""
    ratio = np.maximum(points * dt / np.asarray(periods, dtype=np.float64), 1.0)
    return 2 ** np.ceil(np.log2(ratio) - 1e-12).astype(int)


def subdivide(acceleration: np.ndarray, parts: int) -> np.ndarray:
    """((n - 1) parts + 1,) values of the piecewise-linear function on a finer grid."""
    if parts == 1:
        return acceleration
    steps = np.arange(parts) / parts
    inner = acceleration[:-1, None] + np.diff(acceleration)[:, None] * steps
    return np.append(inner.ravel(), acceleration[-1])


def response_spectrum(
    acceleration: np.ndarray,
    dt: float,
    periods: np.ndarray | float,
    damping: float = 0.05,
    points_per_period: int = POINTS_PER_PERIOD,
) -> np.ndarray:
    """(P,) pseudo-acceleration w^2 max|x| [m/s^2] while the motion lasts.

    The response is evaluated at `points_per_period` points or more in every period, on the exact
    solution: sampling it at the record's own step misses the peaks of short periods.

    Args:
        acceleration: (n,) ground acceleration [m/s^2], linear between samples.
        dt: its time step [s].
        periods: natural periods (P,) [s].
        damping: damping ratio, in [0, 1).
        points_per_period: see above.

    Raises:
        InputError: non-positive periods or step, damping outside [0, 1), or too little memory.
    """
    acceleration, periods = _checked(acceleration, dt, periods, damping)
    parts = subdivision(periods, dt, points_per_period)
    check_memory(float(acceleration.size) * parts.max(), "The response spectrum")
    spectrum = np.empty(periods.size)
    for count in np.unique(parts):
        chosen = np.flatnonzero(parts == count)
        fine = subdivide(acceleration, int(count))
        for i, one in zip(chosen, oscillators(periods[chosen], damping, dt / count), strict=True):
            spectrum[i] = np.max(np.abs(one.run(fine)))
    return (2 * np.pi / periods) ** 2 * spectrum


def sdof_response(
    acceleration: np.ndarray, dt: float, period: float, damping: float = 0.05
) -> tuple[np.ndarray, np.ndarray]:
    """(n,) displacement [m] and (n,) velocity [m/s] of one oscillator, at the motion's samples."""
    acceleration, periods = _checked(acceleration, dt, period, damping)
    one = oscillators(periods, damping, dt)[0]
    return one.run(acceleration), one.run(acceleration, "velocity")


def _checked(acceleration, dt, periods, damping):
    acceleration = np.asarray(acceleration, dtype=np.float64)
    periods = np.atleast_1d(np.asarray(periods, dtype=np.float64))
    if acceleration.ndim != 1 or acceleration.size < 2:
        raise argument_error("acceleration", "be (n,) with n >= 2", f"shape {acceleration.shape}")
    if not (np.isfinite(dt) and dt > 0):
        raise argument_error("dt", "be a positive time step [s]", repr(dt))
    if periods.size == 0 or not np.all(np.isfinite(periods) & (periods > 0)):
        raise argument_error("periods", "be positive and finite [s]", repr(periods)[:80])
    if not 0 <= damping < 1:
        raise argument_error("damping", "be in [0, 1)", repr(damping))
    return acceleration, periods
