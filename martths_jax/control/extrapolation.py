"""The polynomial through past samples of a stroke, and its value some time ahead.

With s = t / span, t counted from the newest sample and span = (N - 1) h, the polynomial of degree n

    p(s) = c_0 + c_1 s + ... + c_n s^n,   c = (V' V)^-1 V' y,   y_j = x(k - j h),

is the least-squares fit to N points h apart, row j of V being (1, s_j, ..., s_j^n), s_j = -j/(N-1).
With N = n + 1 it goes through the points, and p at tau = h is the extrapolation of Horiuchi et al.
1999: u(k) = sum_j (-1)^j C(n+1, j+1) x(k - j h).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.base import weighted
from martths_jax.control.uncoupled import whole_samples
from martths_jax.errors import argument_error

#: Highest degree: beyond, the weights of a sample reach into the thousands.
MOST_ORDER = 4
#: Longest spacing of the points [s]; motion above 1 / (2 h) = 10 Hz aliases with it.
MOST_SPACING = 0.05
#: Longest span of the points [s], some fifths of the period of the structure's first mode.
MOST_SPAN = 0.5


@dataclass(frozen=True)
class Extrapolation:
    """A polynomial through past samples.

    Attributes:
        order: degree n.
        points: N of them, the newest sample among them; at least n + 1.
        spacing: h in samples.
    """

    order: int
    points: int
    spacing: int

    @classmethod
    def of(cls, order: int, points: int | None, spacing: float, fs: float) -> Extrapolation:
        """From a spacing [s] at a sampling rate [Hz]; as many points as needed if left out."""
        points = order + 1 if points is None else points
        return cls(order, points, whole_samples(spacing, fs))

    @property
    def reach(self) -> int:
        """Samples before k that it looks back to: (N - 1) h."""
        return (self.points - 1) * self.spacing

    @property
    def span(self) -> int:
        """Samples that s counts in; one where there is one point only."""
        return max(self.reach, 1)

    @cached_property
    def matrix(self) -> np.ndarray:
        """(n + 1, N): c from the points."""
        s = -np.arange(self.points) * self.spacing / self.span
        return np.linalg.pinv(np.vander(s, self.order + 1, increasing=True))

    def init(self, trials: int) -> jax.Array:
        """(reach, T): x(k-1), x(k-2), ..., at rest before the first sample."""
        return jnp.zeros((self.reach, trials))

    def step(self, past: jax.Array, newest: jax.Array) -> tuple[jax.Array, tuple]:
        """What to remember, and c_0 ... c_n (T,), with a sample's stroke (T,)."""
        # A shift, and no ring that k counts round: so the step is the same map at every sample,
        # and can be linearised (``stability``).
        whole = jnp.concatenate([newest[None], past])
        points = [whole[j * self.spacing] for j in range(self.points)]
        return whole[: self.reach], tuple(weighted(row, points) for row in self.matrix.tolist())

    def value(self, c, ahead) -> jax.Array:
        """p (T,) a time `ahead` of now, in samples: a number or (T,)."""
        s = ahead / self.span
        found = c[-1]
        for one in c[-2::-1]:
            found = found * s + one
        return found

    def slope(self, c) -> jax.Array:
        """dp/dt (T,) now, a sample; zero for degree 0."""
        return c[1] / self.span if self.order else jnp.zeros_like(c[0])

    def weights(self, ahead) -> jax.Array:
        """(N,) or (N, T) weights w_j of x(k - j h) in p a time `ahead` of now, in samples."""
        rows = jnp.asarray(self.matrix)
        s = jnp.asarray(ahead, float) / self.span
        each = [self.value(tuple(rows[:, j]), s * self.span) for j in range(self.points)]
        return jnp.stack(each)


def unusable(which: str, order, points, spacing, fs: float) -> list[str]:
    """Sentences about numbers, each in its own range, that together make no polynomial.

    Args:
        which: ending of the arguments' names.
        order, points, spacing, fs: see ``Extrapolation.of``.
    """
    points = order + 1 if points is None else points
    samples = whole_samples(spacing, fs)
    if points <= order:
        wanted = f"be at least {order + 1}, as many as a polynomial of order {order} has unknowns"
        return [str(argument_error(f"points{which}", wanted, points))]
    if samples < 1:
        wanted = f"be at least half a sample ({0.5 / fs:g} s), to be one"
        return [str(argument_error(f"spacing{which}", wanted, spacing))]
    if (points - 1) * samples / fs > MOST_SPAN:
        wanted = f"keep the points within {MOST_SPAN:g} s"
        got = f"{points} points {spacing:g} s apart"
        return [str(argument_error(f"points{which}", wanted, got))]
    return []
