"""Sobol' indices from the values at a Saltelli design, with bootstrap confidence intervals.

    S_i  = E[f_B (f_ABi - f_A)] / Var f                first order (Saltelli et al. 2010, table 2 b)
    ST_i = E[(f_A - f_ABi)^2] / (2 Var f)              total (Jansen 1999)

Both are ratios of means over the base samples, so a bootstrap resample is a vector of weights on
them, and all resamples of all outputs are a few matrix products.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

LEVEL = 0.95
RESAMPLES = 1000
#: An interval wider than this says next to nothing of an index between 0 and 1.
TOO_WIDE = 0.5
#: An output whose standard deviation is this small against its mean does not vary.
NO_SPREAD = 1e-9


@dataclass(frozen=True)
class SobolIndices:
    """Indices of m outputs against d factors.

    Attributes:
        first, total: (m, d); NaN for an output that does not vary.
        first_low, first_high, total_low, total_high: (m, d) ends of the confidence intervals.
        mean, deviation: (m,) of the outputs over A and B.
        used: number of base samples behind them.
    """

    first: np.ndarray
    total: np.ndarray
    first_low: np.ndarray
    first_high: np.ndarray
    total_low: np.ndarray
    total_high: np.ndarray
    mean: np.ndarray
    deviation: np.ndarray
    used: int

    @property
    def varies(self) -> np.ndarray:
        """(m,) whether an output varies at all."""
        return np.isfinite(self.total[:, 0]) if self.total.size else np.zeros(0, bool)

    @property
    def width(self) -> np.ndarray:
        """(m,) widest interval of an output's indices."""
        ends = (self.first_high - self.first_low, self.total_high - self.total_low)
        return np.max(np.maximum(*ends), axis=1)


def sobol(values: np.ndarray, *, resamples: int = RESAMPLES, seed: int = 0, level: float = LEVEL):
    """First-order and total Sobol' indices with percentile bootstrap intervals.

    Args:
        values: (N, d + 2, m) outputs at A, B, AB_1 ... AB_d.  A base sample with any value that is
            not finite is left out whole, since all its rows belong together.
        resamples: bootstrap resamples of the base samples.
        seed: of the resampling.
        level: confidence of the intervals.

    Returns:
        ``SobolIndices``.
    """
    values = values[np.all(np.isfinite(values), axis=(1, 2))]
    N, rows, m = values.shape
    d = rows - 2
    blank = np.full((m, d), np.nan)
    if N < 2:
        none = np.full(m, np.nan)
        return SobolIndices(*(blank.copy() for _ in range(6)), none, none, N)
    both = values[:, :2].reshape(-1, m)
    mean, deviation = both.mean(axis=0), both.std(axis=0)
    varies = deviation > NO_SPREAD * np.maximum(np.abs(mean), np.finfo(float).tiny)
    # The estimators are better the smaller the mean; the indices do not depend on it, or on units.
    f = (values[..., varies] - mean[varies]) / deviation[varies]
    f_A, f_B, f_AB = f[:, 0], f[:, 1], f[:, 2:]  # (N, m), (N, m), (N, d, m)
    parts = (
        f_B[:, None] * (f_AB - f_A[:, None]),
        (f_A[:, None] - f_AB) ** 2 / 2,
        (f_A + f_B) / 2,
        (f_A**2 + f_B**2) / 2,
    )

    def ratios(weights):
        """(r, m, d) first and total indices under weights (r, N) that sum to one."""
        first, total, middle, square = (np.tensordot(weights, x, axes=1) for x in parts)
        # A resample whose A and B are all alike would divide by zero.
        variance = np.maximum(square - middle**2, np.finfo(float).tiny)[:, None]
        return [np.swapaxes(x / variance, 1, 2) for x in (first, total)]

    rng = np.random.default_rng(seed)
    tails = [(1 - level) / 2, (1 + level) / 2]
    weights = rng.multinomial(N, np.full(N, 1 / N), size=resamples) / N
    ends = [np.quantile(x, tails, axis=0) for x in ratios(weights)]
    columns = []
    for x in (*(x[0] for x in ratios(np.full((1, N), 1 / N))), *ends[0], *ends[1]):
        columns.append(blank.copy())
        columns[-1][varies] = x
    return SobolIndices(*columns, mean, deviation, N)


def verdicts(names, found: SobolIndices, samples: int) -> dict[str, str]:
    """For each output a sentence if its indices mean little, else ""."""
    told = {}
    for i, name in enumerate(names):
        if found.used < 2:
            told[name] = (
                f"no indices: only {found.used} of {samples} base samples finished every run."
            )
        elif not found.varies[i]:
            told[name] = f"does not vary: it is {found.mean[i]:.6g} in every run."
        elif found.width[i] > TOO_WIDE:
            told[name] = (
                f"N = {found.used} is too small: the widest confidence interval is "
                f"{found.width[i]:.2g} wide; {_enough(found.width[i], found.used)}."
            )
        elif np.all(found.first_low[i] <= 0) and np.max(found.first[i]) < 0.05:
            told[name] = (
                "no first-order index is distinguishable from zero: what moves it are "
                "interactions, or N is too small."
            )
        else:
            told[name] = ""
    return told


def _enough(width: float, used: int) -> str:
    """Power of two at which an interval shrinks to ``TOO_WIDE``, as one over the root of N."""
    powers = np.ceil(np.log2(used) + 2 * np.log2(width / TOO_WIDE))
    if powers > 30:  # resamples of few runs can have next to no variance
        return "too wide to say how many would do"
    return f"N = {2 ** int(powers)} should bring it to {TOO_WIDE:g}"
