"""The facts of a record that a built-in motion is made from: measured once, no samples kept."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from ...errors import InputError
from ..measures import (
    arias_intensity,
    crossing_times,
    ground_velocity,
    husid,
    peak_ground_acceleration,
    significant_duration,
)
from ..record import Record
from ..spectra import oscillators, response_spectrum

FACTS_FILE = Path(__file__).with_name("facts.json")

#: Periods of the target spectrum [s]: 121 from 0.02 to 5 s, equally spaced in their logarithm.
PERIODS = np.geomspace(0.02, 5.0, 121)

#: Records that facts can be measured on: shortest duration and longest time step [s].
SHORTEST, COARSEST = 4.0, 0.05

#: Damping ratio of every oscillator here.
DAMPING = 0.05

#: Fractions of the Arias intensity at which its build-up is kept (27): every 5 %, closer at the
#: ends, and the first faint movement, in which a controller that identifies its plant gets ready.
FRACTIONS = np.array(
    [1e-6, 1e-5, 1e-4, 1e-3, 0.005, 0.02, *(round(0.05 * i, 2) for i in range(1, 20)), 0.98, 0.995]
)

#: Fractions of a band's energy at which its build-up is kept (17).  Those below `ONSET` are told by
#: the velocity of a 25 %-damped oscillator, which cannot answer before the ground has moved; the
#: zero-phase filters of the others can, and would tell nothing of the first faint movement.
BAND_FRACTIONS = np.array(
    [1e-5, 1e-4, 1e-3, 5e-3, 0.02, 0.05, *(round(0.1 * i, 1) for i in range(1, 10)), 0.95, 0.98]
)
ONSET, ONSET_DAMPING = 0.05, 0.25

#: Energy by frequency: bands 10 % apart.  Energy by time: bands 30 % apart, short in time.
LOWEST, HIGHEST = 0.15, 45.0
LINE_RATIO, BAND_RATIO = 1.10, 1.30


@dataclass(frozen=True)
class Facts:
    """What is kept of a record.  Times count from its first sample.

    Attributes:
        dt, samples: time step [s] and number of samples, quiet parts included.
        lead, tail: quiet time before the first and after the last sample that is not zero [s].
        pga, pgv: peak ground acceleration [m/s^2] and velocity [m/s].
        end_velocity: ground velocity after the last sample [m/s].
        arias: Arias intensity [m/s].
        d5_95: significant duration [s].
        spectrum: (121,) 5 %-damped pseudo-acceleration at `PERIODS` [m/s^2].
        husid_times: (27,) times at which the Arias intensity reaches `FRACTIONS` [s].
        line_energy: (L,) integral of the squared acceleration in every `line_bands` [m^2/s^3].
        band_energy: (B,) the same in every `time_bands`.
        band_times: (B, 17) times at which that integral reaches `BAND_FRACTIONS` [s].
    """

    dt: float
    samples: int
    lead: float
    tail: float
    pga: float
    pgv: float
    end_velocity: float
    arias: float
    d5_95: float
    spectrum: np.ndarray
    husid_times: np.ndarray
    line_energy: np.ndarray
    band_energy: np.ndarray
    band_times: np.ndarray

    @property
    def active(self) -> slice:
        """Samples between the quiet lead and the quiet tail."""
        last = self.samples - round(self.tail / self.dt)
        return slice(round(self.lead / self.dt), last)


@dataclass(frozen=True)
class Bands:
    """Zero-phase band-pass filters, Gaussian in the logarithm of frequency.

    Attributes:
        frequencies: (L,) centres [Hz].
        weights: (L, F) gain at the frequencies of the padded discrete Fourier transform.
        length: padded length.
    """

    frequencies: np.ndarray
    weights: np.ndarray
    length: int

    def split(self, acceleration: np.ndarray) -> np.ndarray:
        """(L, n) motion in every band; `acceleration` is (n,), or (L, n) with one for each."""
        spectrum = rfft(acceleration, self.length)
        return irfft(self.weights * spectrum, self.length)[:, : acceleration.shape[-1]]


def _bands(samples: int, dt: float, ratio: float) -> Bands:
    """Bands from `LOWEST` on by `ratio`, up to 0.9 of the Nyquist frequency."""
    highest = min(HIGHEST, 0.45 / dt)
    count = max(2, int(np.log(highest / LOWEST) / np.log(ratio)) + 1)
    centres = LOWEST * ratio ** np.arange(count)
    length = next_fast_len(samples + int(10 / dt), real=True)
    frequency = np.maximum(rfftfreq(length, dt), 1e-9)
    # Neighbours cross at exp(-1/4) of their squared peaks' sum: together they cover all of it.
    place = np.log(frequency / centres[:, None]) / np.log(ratio)
    return Bands(centres, np.exp(-(place**2)), length)


def line_bands(samples: int, dt: float) -> Bands:
    """The narrow bands, for energy by frequency."""
    return _bands(samples, dt, LINE_RATIO)


def time_bands(samples: int, dt: float) -> Bands:
    """The wide bands, for energy by time."""
    return _bands(samples, dt, BAND_RATIO)


def energies(acceleration: np.ndarray, dt: float, bands: Bands) -> np.ndarray:
    """(L,) integral of the squared acceleration in every band [m^2/s^3]."""
    return dt * np.sum(bands.split(acceleration) ** 2, axis=1)


def measure(record: Record) -> Facts:
    """The facts of any record.

    Raises:
        InputError: a record too short or too coarse for a spectrum from 0.02 to 5 s.
    """
    acceleration, dt = record.acceleration, record.dt
    if record.duration < SHORTEST or dt > COARSEST:
        raise InputError(
            f"Motion `{record.name}` lasts {record.duration:.3g} s at a step of {dt:.3g} s, but "
            f"its facts need at least {SHORTEST:g} s and a step of at most {COARSEST:g} s."
        )
    moving = np.flatnonzero(acceleration)
    bands = time_bands(acceleration.size, dt)
    buildup = np.cumsum(bands.split(acceleration) ** 2, axis=1) * dt
    first = oscillators(1 / bands.frequencies, ONSET_DAMPING, dt)
    onset = np.cumsum([one.run(acceleration, "velocity") ** 2 for one in first], axis=1)
    late = BAND_FRACTIONS >= ONSET
    band_times = np.column_stack(
        [
            [crossing_times(energy, dt, BAND_FRACTIONS[~late]) for energy in onset],
            [crossing_times(energy, dt, BAND_FRACTIONS[late]) for energy in buildup],
        ]
    )
    return Facts(
        dt=dt,
        samples=acceleration.size,
        lead=float(moving[0] * dt),
        tail=float((acceleration.size - 1 - moving[-1]) * dt),
        pga=peak_ground_acceleration(acceleration),
        pgv=float(np.max(np.abs(ground_velocity(acceleration, dt)))),
        end_velocity=float(ground_velocity(acceleration, dt)[-1]),
        arias=arias_intensity(acceleration, dt),
        d5_95=significant_duration(acceleration, dt),
        spectrum=response_spectrum(acceleration, dt, PERIODS, DAMPING),
        husid_times=crossing_times(husid(acceleration, dt), dt, FRACTIONS),
        line_energy=energies(acceleration, dt, line_bands(acceleration.size, dt)),
        band_energy=buildup[:, -1],
        band_times=band_times,
    )


def to_plain(facts: Facts) -> dict:
    """`facts` as JSON takes them: five significant digits, times to the millisecond."""

    def plain(name: str, value):
        if isinstance(value, int):
            return value
        if np.ndim(value):
            return [plain(name, v) for v in value]
        value = float(value)
        timelike = name.endswith("times") or name in ("lead", "tail")
        return round(value, 3) if timelike else float(f"{value:.5g}")

    return {name: plain(name, value) for name, value in asdict(facts).items()}


def from_plain(plain: dict) -> Facts:
    """The inverse of `to_plain`."""
    arrays = {k: np.array(v) if isinstance(v, list) else v for k, v in plain.items()}
    return Facts(**arrays)


@cache
def _stored() -> dict:
    return json.loads(FACTS_FILE.read_text(encoding="utf-8"))


@cache
def stored_facts() -> dict[str, Facts]:
    """Facts of the package's data file, by name of the real record."""
    return {name: from_plain(plain) for name, plain in _stored()["records"].items()}


def stored_seeds() -> dict[str, int]:
    """Seed of each built-in motion, by name of the real record."""
    return _stored()["seeds"]
