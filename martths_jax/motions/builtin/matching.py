"""Fit an accelerogram to facts: spectrum, peaks, and energy by frequency and time, all at once.

Each step linearises every misfit and adds the smallest change that reduces them: Gauss-Newton with
Levenberg's damping, in its minimum-norm form.  The gradient of one oscillator's peak with respect
to the ground acceleration is the oscillator's impulse response, reversed in time: the wavelet of
Lilhanand & Tseng (9th World Conf. Earthquake Eng., 1988), so for the spectrum alone this is their
method.  The energies are held at the same time, by the same algebra.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, rfft
from scipy.linalg import cho_factor, cho_solve

from ..measures import ground_velocity
from ..spectra import Oscillator, oscillators, subdivide, subdivision
from ..units import G
from .facts import (
    BAND_FRACTIONS,
    DAMPING,
    FRACTIONS,
    PERIODS,
    Bands,
    Facts,
    line_bands,
    time_bands,
)
from .start import active_window, envelope

#: Relative misfits (energies: of their square roots) that count as one: peaks, energy by
#: frequency, a band's energy in a piece of time, and the Arias intensity in a piece of time.
PEAK, LINE, PIECE, HUSID = 0.01, 0.01, 0.05, 0.004

#: Bands with less than this part of the strongest one's energy count as if they had it.
_FAINT = 1e-2

#: Standard deviation of a change before any misfit is known, as part of envelope and PGA.
_PRIOR_ENVELOPE, _PRIOR_PGA = 0.1, 0.05

#: Points in a period at which peaks are looked for while matching.
_POINTS = 24

#: Other peaks above the target that are pushed down together with the largest.
_MORE_PEAKS = 4

#: Stored fractions that cut the energies into pieces.
_BAND_CUTS = np.searchsorted(BAND_FRACTIONS, [0.05, 0.2, 0.5, 0.8, 0.95])
_HUSID_CUTS = np.flatnonzero(
    np.isin(FRACTIONS, [1e-5, 1e-4, 1e-3, 0.005, 0.02, 0.05, 0.95, 0.98])
    | np.isin(FRACTIONS, np.round(np.arange(0.1, 0.95, 0.1), 2))
)


def match(start: np.ndarray, facts: Facts, first: int = 6, then: int = 24) -> np.ndarray:
    """(n,) accelerogram [m/s^2] near `start` that meets `facts`; zero in their quiet parts.

    `first` steps fit the energies, which are smooth, and `then` steps everything.
    """
    # Squared: the first faint movement is left nearly as `start` has it.
    spread = active_window(facts) ** 2 * (
        _PRIOR_ENVELOPE * envelope(facts) + _PRIOR_PGA * facts.pga
    )
    energies = _energy_targets(facts)
    hats = _hat_responses(facts)

    def energy_misfit(a):
        return _stack([_energy_misfit(a, facts.dt, one) for one in energies])

    def whole_misfit(a):
        parts = [energy_misfit(a), _ground_misfit(a, facts), _spectrum_misfit(a, facts, hats)]
        return _stack(parts)

    a = _minimise(energy_misfit, start, spread, first)
    return _minimise(whole_misfit, a, spread, then)


def _stack(parts):
    misfits, rows = zip(*parts, strict=True)
    return np.concatenate(misfits), np.concatenate(rows)


def _minimise(misfit_of, a: np.ndarray, spread: np.ndarray, steps: int) -> np.ndarray:
    """Damped Gauss-Newton for the sum of squares; a step that does not lower it is not taken."""
    damping = 10.0
    free = np.flatnonzero(spread)
    misfit, rows = misfit_of(a)
    normal = None
    for _ in range(steps):
        if normal is None:
            scaled = rows[:, free] * spread[free]
            normal = scaled @ scaled.T
        damped = normal + damping * np.eye(misfit.size)
        trial = a.copy()
        trial[free] += spread[free] * (cho_solve(cho_factor(damped), misfit) @ scaled)
        found, gradient = misfit_of(trial)
        if np.sum(found**2) < np.sum(misfit**2):
            a, misfit, rows, normal = trial, found, gradient, None
            damping /= 4
        else:
            damping *= 4
    return a


@dataclass(frozen=True)
class _Hats:
    """Oscillators that share a subdivision of the time step.

    Attributes:
        parts: the subdivision.
        periods: (P,) natural periods [s].
        target: (P,) wanted peak displacement [m].
        bank: the oscillators on the fine grid.
        responses: of each, to a hat-shaped unit pulse of the coarse grid: a sample's gradient.
    """

    parts: int
    target: np.ndarray
    bank: list[Oscillator]
    responses: list[np.ndarray]


def _hat_responses(facts: Facts) -> list[_Hats]:
    all_parts = subdivision(PERIODS, facts.dt, _POINTS)
    groups = []
    for parts in np.unique(all_parts):
        periods = PERIODS[all_parts == parts]
        target = facts.spectrum[all_parts == parts] * (periods / (2 * np.pi)) ** 2
        bank = oscillators(periods, DAMPING, facts.dt / parts)
        hat = np.concatenate([np.arange(parts), np.arange(parts, 0, -1)]) / parts
        responses = []
        for period, one in zip(periods, bank, strict=True):
            # After 50 periods the free vibration has decayed by 1.5e-7.
            length = min(facts.samples, int(50 * period / facts.dt) + 3) * parts
            responses.append(one.run(np.pad(hat, (0, max(length - hat.size, 0)))))
        groups.append(_Hats(int(parts), target, bank, responses))
    return groups


def _spectrum_misfit(a: np.ndarray, facts: Facts, groups: list[_Hats]):
    """Misfit of the spectrum in units of its tolerance (R,), and gradient (R, n).

    Every oscillator gives its largest peak, and others that exceed the target as well: pushing
    down the largest alone would only let the next one take its place.
    """
    misfit, rows = [], []
    for group in groups:
        fine = subdivide(a, group.parts)
        # Sample j's hat starts one step before it.
        hat_starts = (np.arange(a.size) - 1) * group.parts
        for target, one, hat in zip(group.target, group.bank, group.responses, strict=True):
            response = one.run(fine)
            for at in _peaks_above(np.abs(response), target):
                misfit.append(np.log(target / abs(response[at])) / PEAK)
                since = at - hat_starts
                reached = (since >= 0) & (since < hat.size)
                row = np.zeros(a.size)
                row[reached] = hat[since[reached]] / (response[at] * PEAK)
                rows.append(row)
    return np.array(misfit), np.array(rows)


def _peaks_above(size: np.ndarray, level: float) -> list[int]:
    """Index of the largest value and of a few other local maxima above `level`."""
    largest = int(np.argmax(size))
    if size[largest] <= level:
        return [largest]
    middle = size[1:-1]
    local = 1 + np.flatnonzero((middle > level) & (middle >= size[:-2]) & (middle > size[2:]))
    order = local[np.argsort(-size[local], kind="stable")]
    return [largest, *[int(k) for k in order if k != largest][:_MORE_PEAKS]]


def _ground_misfit(a: np.ndarray, facts: Facts):
    """The same for PGA, PGV and the velocity left at the end."""
    dt = facts.dt
    misfit, rows = [], []
    for at in _peaks_above(np.abs(a), facts.pga):
        misfit.append(np.log(facts.pga / abs(a[at])) / PEAK)
        rows.append(np.zeros(a.size))
        rows[-1][at] = 1 / (a[at] * PEAK)
    velocity = ground_velocity(a, dt)
    at = int(np.argmax(np.abs(velocity)))
    misfit.append(np.log(facts.pgv / abs(velocity[at])) / PEAK)
    rows.append(np.where(np.arange(a.size) <= at, dt / (velocity[at] * PEAK), 0.0))
    misfit.append((facts.end_velocity - velocity[-1]) / (facts.pgv * PEAK))
    rows.append(np.full(a.size, dt / (facts.pgv * PEAK)))
    return np.array(misfit), np.array(rows)


@dataclass(frozen=True)
class _Energy:
    """Energy to be matched in pieces of time, for several bands at once.

    Attributes:
        bands: the filters, or None for the motion as it is.
        band: (S,) band of every piece.
        edges: (S, 2) its first and past-the-last sample.
        target: (S,) energy wanted in it [m^2/s^3].
        unit: (S,) misfit of its square root that counts as one.
    """

    bands: Bands | None
    band: np.ndarray
    edges: np.ndarray
    target: np.ndarray
    unit: np.ndarray


def _energy_targets(facts: Facts) -> list[_Energy]:
    n, dt = facts.samples, facts.dt
    uncut = np.zeros((facts.line_energy.size, 0))
    total = np.array([2 * G / np.pi * facts.arias])
    band_times, band_shares = facts.band_times[:, _BAND_CUTS], BAND_FRACTIONS[_BAND_CUTS]
    husid_times, husid_shares = facts.husid_times[None, _HUSID_CUTS], FRACTIONS[_HUSID_CUTS]
    return [
        _cut(facts, line_bands(n, dt), facts.line_energy, uncut, uncut[0], LINE),
        _cut(facts, time_bands(n, dt), facts.band_energy, band_times, band_shares, PIECE),
        _cut(facts, None, total, husid_times, husid_shares, HUSID),
    ]


def _cut(facts, bands, energy, times, fractions, tolerance) -> _Energy:
    """The pieces between the stored `times` (B, F) at which `energy` (B,) reaches `fractions`."""
    shares = np.diff(np.concatenate([[0.0], fractions, [1.0]]))
    count = energy.size
    inner = np.round(times / facts.dt).astype(int) + 1
    cuts = np.column_stack([np.zeros(count, int), inner, np.full(count, facts.samples)])
    edges = np.stack([cuts[:, :-1].ravel(), cuts[:, 1:].ravel()], axis=1)
    band = np.repeat(np.arange(count), shares.size)
    kept = edges[:, 1] > edges[:, 0]
    unit = tolerance * np.sqrt(np.maximum(energy, _FAINT * energy.max()))[band]
    target = np.outer(energy, shares).ravel()
    # The first faint movement is small, but not to be missed by as much as the strong motion.
    unit = np.minimum(unit, np.sqrt(target))
    return _Energy(bands, band[kept], edges[kept], target[kept], unit[kept])


def _energy_misfit(a: np.ndarray, dt: float, wanted: _Energy):
    """The same for energies, in amplitudes (square roots): a change acts linearly on those."""
    parts = a[None] if wanted.bands is None else wanted.bands.split(a)
    index = np.arange(a.size)
    inside = (index >= wanted.edges[:, :1]) & (index < wanted.edges[:, 1:])
    driven = np.where(inside, parts[wanted.band], 0.0)
    found = np.sqrt(np.maximum(dt * np.sum(driven**2, axis=1), 1e-4 * wanted.target))
    misfit = (np.sqrt(wanted.target) - found) / wanted.unit
    driven *= (dt / (found * wanted.unit))[:, None]
    if wanted.bands is not None:
        # The gradient of a filtered motion's energy: the same zero-phase filter once more.
        weights, length = wanted.bands.weights[wanted.band], wanted.bands.length
        driven = irfft(weights * rfft(driven, length), length)[:, : a.size]
    return misfit, driven
