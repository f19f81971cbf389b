"""J1 to J9 of the uniaxial benchmark, as its evaluation script has them and as its text has them.

    J2 = s(x_m - x_1) / s(x_1),   J3 = max |x_m - x_1| / max |x_1|,

x_m the measured stroke, x_1 the target; then the same against the reference structure: storey 1
with x_m, storeys 2 and 3 with the numerical substructure.  s is the standard deviation in the
script, the root mean square in the text.  J1 is the delay of largest correlation.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import correlate
from uniaxial_loop import DT

NAMES = tuple(f"J{i}" for i in range(1, 10))
LAGS = 50  # the script looks at delays of 0 to 49 samples


def peak_ratio(x, against):
    return abs(x - against).max() / abs(against).max()


def std_ratio(x, against):
    return np.std(x - against) / np.std(against)


def rms_ratio(x, against):
    return np.sqrt(np.mean((x - against) ** 2) / np.mean(against**2))


def script(x, measured, reference):
    """(9,) in ms and %: J4, J6, J7 the storeys' standard deviations, J5, J8, J9 their peaks."""
    target, n = x[:, 0], len(measured)
    fits = [np.corrcoef(measured[lag:], target[: n - lag])[0, 1] for lag in range(LAGS)]
    pairs = [(measured, target), *storeys(x, measured, reference)]
    (J2, J3), (J4, J5), (J6, J8), (J7, J9) = [(std_ratio(*p), peak_ratio(*p)) for p in pairs]
    rest = [J2, J3, J4, J5, J6, J7, J8, J9]
    return np.r_[1e3 * DT * np.argmax(fits), 100 * np.array(rest)]


def text(x, measured, reference):
    """(9,) in ms and %: J4 to J6 the storeys' root mean squares, J7 to J9 their peaks."""
    target, pairs = x[:, 0], storeys(x, measured, reference)
    lag = np.argmax(correlate(measured, target, "full", "fft")) - (len(target) - 1)
    rest = [rms_ratio(measured, target), peak_ratio(measured, target)]
    rest += [rms_ratio(*p) for p in pairs] + [peak_ratio(*p) for p in pairs]
    return np.r_[1e3 * DT * lag, 100 * np.array(rest)]


def storeys(x, measured, reference):
    """What is compared with the reference at storey 1, 2 and 3."""
    return list(zip((measured, x[:, 1], x[:, 2]), reference.T, strict=True))
