"""How near an accelerogram is to the facts it was made from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..measures import arias_intensity, peak_ground_acceleration, significant_duration
from ..spectra import response_spectrum
from .facts import DAMPING, PERIODS, Facts

#: Periods [s] between which the spectrum is judged.
JUDGED = (0.03, 2.0)

#: Largest relative misfits that are accepted.
SPECTRUM_MEAN, SPECTRUM_MAX, OTHERS = 0.05, 0.15, 0.10


@dataclass(frozen=True)
class Fit:
    """Relative misfits [-].

    Attributes:
        spectrum_mean, spectrum_max: mean and largest magnitude of the spectrum's, 0.03 to 2 s.
        pga, arias, d5_95: of the peak, the Arias intensity and the significant duration, signed.
    """

    spectrum_mean: float
    spectrum_max: float
    pga: float
    arias: float
    d5_95: float

    @property
    def accepted(self) -> bool:
        """Whether all of them are within the limits of this module."""
        others = max(abs(self.pga), abs(self.arias), abs(self.d5_95))
        return (
            self.spectrum_mean <= SPECTRUM_MEAN
            and self.spectrum_max <= SPECTRUM_MAX
            and others <= OTHERS
        )


def fit_of(acceleration: np.ndarray, facts: Facts) -> Fit:
    """The `Fit` of (n,) samples [m/s^2] at the facts' time step."""
    judged = (PERIODS >= JUDGED[0]) & (PERIODS <= JUDGED[1])
    spectrum = response_spectrum(acceleration, facts.dt, PERIODS[judged], DAMPING)
    misfit = np.abs(spectrum / facts.spectrum[judged] - 1)
    return Fit(
        spectrum_mean=float(np.mean(misfit)),
        spectrum_max=float(np.max(misfit)),
        pga=peak_ground_acceleration(acceleration) / facts.pga - 1,
        arias=arias_intensity(acceleration, facts.dt) / facts.arias - 1,
        d5_95=significant_duration(acceleration, facts.dt) / facts.d5_95 - 1,
    )
