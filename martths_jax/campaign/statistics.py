"""Percentiles over trials, their bootstrap confidence intervals, and paired comparisons.

The bootstrap distribution of an order statistic needs no resampling: the k-th smallest of n draws
with replacement from a sample is that sample's value at rank floor(n B), B ~ Beta(k, n + 1 - k).
So the intervals below are what the percentile bootstrap tends to with infinitely many resamples,
without noise of their own (Efron & Tibshirani 1993, chapter 13).  The same holds for a proportion,
whose bootstrap distribution is binomial.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

#: Confidence of the intervals.
LEVEL = 0.95
PERCENTS = (5, 50, 95)


@dataclass(frozen=True)
class Estimate:
    """A statistic with its confidence interval.

    Attributes:
        value, low, high: NaN if there are no trials behind it.
        trials: number of trials behind it.
    """

    value: float
    low: float
    high: float
    trials: int


def percentile(sample: np.ndarray, percent: float, level: float = LEVEL) -> Estimate:
    """A percentile of the finite values of `sample`, interpolated as NumPy does.

    The interval is that of the order statistic at the percentile's rank.
    """
    # Half a second, at the end of a study and not at the start of every command.
    from scipy import stats

    x = np.sort(sample[np.isfinite(sample)])
    n = x.size
    if n == 0:
        return Estimate(np.nan, np.nan, np.nan, 0)
    rank = min(max(int(np.ceil(n * percent / 100)), 1), n)
    tails = stats.beta.ppf([(1 - level) / 2, (1 + level) / 2], rank, n + 1 - rank)
    low, high = x[np.minimum((n * tails).astype(int), n - 1)]
    return Estimate(float(np.percentile(x, percent)), float(low), float(high), n)


def proportion(successes: int, trials: int, level: float = LEVEL) -> Estimate:
    """A proportion with its bootstrap interval."""
    from scipy import stats

    if trials == 0:
        return Estimate(np.nan, np.nan, np.nan, 0)
    share = successes / trials
    low, high = stats.binom.ppf([(1 - level) / 2, (1 + level) / 2], trials, share) / trials
    return Estimate(share, float(low), float(high), trials)


@dataclass(frozen=True)
class Paired:
    """One controller against another, trial by trial (common plants and noise).

    Attributes:
        difference: median of |first| - |second| over the pairs; negative = the first is better.
        wins: share of the pairs in which the first is better.
        ties: number of pairs in which both are equal.
    """

    difference: Estimate
    wins: Estimate
    ties: int


def compare(first: np.ndarray, second: np.ndarray) -> Paired:
    """Compare the magnitudes of an index under two controllers, over trials both finished."""
    both = np.isfinite(first) & np.isfinite(second)
    difference = np.abs(first[both]) - np.abs(second[both])
    return Paired(
        percentile(difference, 50),
        proportion(int(np.sum(difference < 0)), difference.size),
        int(np.sum(difference == 0)),
    )
