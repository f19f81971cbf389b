"""A first, random accelerogram with a record's energy in every band and at every time.

A sum over frequency bands of band-passed white noise, each modulated in time so that the band
builds its energy up as the record does: an evolutionary process (Priestley 1965) whose modulating
functions come from the facts alone.
"""

from __future__ import annotations

import numpy as np
from scipy.fft import next_fast_len
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter1d
from scipy.signal import hilbert

from ..units import G
from .facts import (
    BAND_FRACTIONS,
    FRACTIONS,
    Facts,
    energies,
    line_bands,
    time_bands,
)

#: Rounds of correcting the start's levels.
ROUNDS = 6


def intensity(times: np.ndarray, fractions: np.ndarray, facts: Facts) -> np.ndarray:
    """(n,) rate of a build-up curve [1/s], from the times at which it reaches `fractions`.

    A monotone curve through the points, from 0 at the end of the lead to 1 at the start of the
    tail; constant where the facts leave no room between two points.
    """
    # Points at the very first sample, and points that coincide, say nothing.
    told = times > facts.lead + facts.dt
    knots, levels = np.maximum.accumulate(times[told]), fractions[told]
    told = np.diff(knots, prepend=facts.lead) > 1e-6
    end = max((facts.samples - 1) * facts.dt - facts.tail, times[-1] + facts.dt)
    knots = np.concatenate([[facts.lead], knots[told], [end]])
    levels = np.concatenate([[0.0], levels[told], [1.0]])
    curve = PchipInterpolator(knots, levels)
    grid = np.arange(facts.samples) * facts.dt
    rate = np.where((grid >= knots[0]) & (grid <= knots[-1]), curve.derivative()(grid), 0.0)
    return np.maximum(rate, 0.0)


def active_window(facts: Facts) -> np.ndarray:
    """(n,) zero in the quiet parts, rising as the record's first movement does, one, and down.

    The rise follows the Arias build-up to 2 % and never falls; the end is a short cosine.
    """
    rate = intensity(facts.husid_times, FRACTIONS, facts)
    strong = facts.husid_times[np.searchsorted(FRACTIONS, 0.02)]
    time = np.arange(facts.samples) * facts.dt
    level = facts.dt * np.sum(rate[time <= strong]) / (strong - facts.lead)
    rising = gaussian_filter1d(np.maximum.accumulate(rate), 0.05 / facts.dt)
    window = np.where(time < strong, np.sqrt(np.minimum(rising / level, 1.0)), 1.0)
    return window * quiet_gate(facts)


def quiet_gate(facts: Facts) -> np.ndarray:
    """(n,) zero in the quiet parts and one between them, with a short cosine at the end."""
    gate = np.zeros(facts.samples)
    inside = facts.active
    gate[inside] = 1.0
    ramp = max(2, min(round(0.25 / facts.dt), (inside.stop - inside.start) // 4))
    gate[inside.stop - ramp : inside.stop] = _cosine(ramp)[::-1]
    return gate


def _cosine(count: int) -> np.ndarray:
    """(count,) rise from zero to one."""
    return np.sin(0.5 * np.pi * (np.arange(count) + 0.5) / count) ** 2


def envelope(facts: Facts) -> np.ndarray:
    """(n,) r.m.s. acceleration with time [m/s^2], from the Arias build-up."""
    rate = intensity(facts.husid_times, FRACTIONS, facts)
    return np.sqrt(2 * G / np.pi * facts.arias * rate)


def random_start(facts: Facts, seed: int | tuple[int, ...]) -> np.ndarray:
    """(n,) accelerogram [m/s^2]: band-wise modulated noise; the same for the same `seed`."""
    noise = np.random.Generator(np.random.PCG64(seed)).standard_normal(facts.samples)
    narrow, wide = line_bands(facts.samples, facts.dt), time_bands(facts.samples, facts.dt)
    lines = _even(narrow.split(noise))
    rates = [
        _smooth(intensity(times, BAND_FRACTIONS, facts), 0.2 / (f * facts.dt))
        for f, times in zip(wide.frequencies, facts.band_times, strict=True)
    ]
    distance = np.abs(np.log(narrow.frequencies[:, None] / wide.frequencies))
    lines *= np.sqrt(np.array(rates)[np.argmin(distance, axis=1)]) * quiet_gate(facts)
    # Neighbours leak into each other, hence a few rounds for the levels.
    level = np.sqrt(facts.line_energy / narrow.frequencies)
    for _ in range(ROUNDS):
        level *= np.sqrt(facts.line_energy / energies(level @ lines, facts.dt, narrow))
    return level @ lines


def _smooth(rate: np.ndarray, width: float) -> np.ndarray:
    """(n,) smoothed rate; in its logarithm, so that strong motion does not spread into faint."""
    return np.exp(gaussian_filter1d(np.log(np.maximum(rate, 1e-9 * rate.max())), width))


def _even(lines: np.ndarray) -> np.ndarray:
    """(L, n) narrow-band noise brought to a constant amplitude: only its phase stays random.

    A strong phase of a few seconds holds only one or two independent amplitudes of a narrow band;
    left random, they would decide how much of the band's energy falls into it.
    """
    samples = lines.shape[1]
    analytic = hilbert(lines, next_fast_len(samples), axis=1)[:, :samples]
    return lines / np.abs(analytic)
