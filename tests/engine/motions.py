"""Short synthetic ground motions for the engine's tests."""

from __future__ import annotations

import numpy as np

from martths_jax import Motion


def burst(seconds: float = 0.7, fs: float = 1024, peak: float = 1.0, seed: int = 0) -> Motion:
    """A band-limited burst that starts at rest, rises at once and dies away."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * fs)) / fs
    waves = sum(
        rng.standard_normal() * np.sin(2 * np.pi * f * t + rng.uniform(0, 2 * np.pi))
        for f in np.linspace(0.8, 12.0, 25)
    )
    envelope = (1 - np.exp(-8 * t)) * np.exp(-1.0 * t / seconds)
    a = waves * envelope
    return Motion("burst", peak * a / np.abs(a).max(), float(fs))
