"""A filter that both sides of a regression pass through, which takes noise out and no lag in."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp

from martths_jax.control.adaptive.arguments import complaint
from martths_jax.control.adaptive.base import Piece


@dataclass(frozen=True)
class LowPass(Piece):
    """y = b(z)/a(z) x, at rest before the first sample; a[0] = 1.

    Since strokes and commands are filtered alike, the coefficients between them stay what they are.

    Attributes:
        b, a: numerator and denominator in powers of 1/z, equally many numbers.
    """

    b: tuple[float, ...]
    a: tuple[float, ...]

    def problems(self, controller):
        good = len(self.b) == len(self.a) > 1 and self.a[0] == 1
        return complaint(good, "a", "have as many numbers as `b`, the first 1", self.a)

    def init(self, shape: tuple[int, ...]):
        """Memory for signals of a shape."""
        return (jnp.zeros(shape),) * (len(self.a) - 1)

    def step(self, memory, x):
        """Memory after a sample, and the filtered sample: transposed direct form II."""
        y = self.b[0] * x + memory[0]
        later = (*memory[1:], jnp.zeros_like(x))
        pairs = zip(later, self.b[1:], self.a[1:], strict=True)
        return tuple(m + b * x - a * y for m, b, a in pairs), y


def butterworth(order: int, cutoff_hz: float, fs: float) -> LowPass:
    """Butterworth low-pass.

    Args:
        order: number of poles.
        cutoff_hz: where it lets 0.71 pass [Hz].
        fs: sampling rate [Hz].
    """
    from scipy import signal

    b, a = signal.butter(order, cutoff_hz, fs=fs)
    return LowPass(tuple(b.tolist()), tuple(a.tolist()))
