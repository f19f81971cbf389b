"""Percentiles, intervals and comparisons against resampling and known answers."""

import numpy as np
import pytest
import xarray as xr
from scipy import stats

from martths_jax import published
from martths_jax.campaign.statistics import compare, percentile, proportion
from martths_jax.indices import DELAYS, NAMES
from martths_jax.study.summary import number, summarise


@pytest.mark.parametrize("percent", [5, 50, 95])
def test_intervals_are_those_of_the_percentile_bootstrap(percent):
    sample = np.random.default_rng(1).gamma(2.0, size=400)
    found = percentile(sample, percent)
    assert found.value == np.percentile(sample, percent) and found.trials == 400
    resampled = stats.bootstrap(
        (sample,), lambda x, axis: np.percentile(x, percent, axis=axis, method="inverted_cdf"),
        n_resamples=20_000, method="percentile", rng=np.random.default_rng(2),
    ).confidence_interval  # fmt: skip
    # Resampling is noisy by about one rank in the sorted sample.
    ranks = np.searchsorted(np.sort(sample), [found.low, found.high, *resampled])
    assert abs(ranks[0] - ranks[2]) <= 1 and abs(ranks[1] - ranks[3]) <= 1


def test_lost_trials_are_not_counted():
    sample = np.array([3.0, np.nan, 1.0, 2.0, np.nan])
    assert percentile(sample, 50).value == 2.0 and percentile(sample, 50).trials == 3
    nothing = percentile(np.full(4, np.nan), 50)
    assert np.isnan([nothing.value, nothing.low, nothing.high]).all() and nothing.trials == 0


def test_one_trial_has_no_spread():
    found = percentile(np.array([7.0]), 95)
    assert (found.value, found.low, found.high) == (7.0, 7.0, 7.0)


def test_proportion_is_the_binomial_bootstrap():
    found = proportion(90, 100)
    resampled = np.random.default_rng(1).binomial(100, 0.9, 200_000) / 100
    assert (found.low, found.high) == tuple(np.quantile(resampled, [0.025, 0.975]))
    assert proportion(0, 0).trials == 0


def test_comparison_is_of_magnitudes_over_common_trials():
    adfc = np.array([-1.0, 1.0, 2.0, np.nan, 5.0])
    lqg = np.array([2.0, -3.0, -2.0, 1.0, np.nan])
    found = compare(adfc, lqg)
    assert found.wins.trials == 3 and found.wins.value == pytest.approx(2 / 3)
    assert found.ties == 1 and found.difference.value == -1.0


def dataset(trials: int = 50) -> xr.Dataset:
    """Results whose percentiles are known: index i of trial t is (i + 1) t, LQG twice ADFC."""
    t = np.arange(trials + 1.0)
    value = (np.arange(24) + 1.0) * t[:, None]
    value = np.stack([2 * value, value])[:, None]
    value[1, 0, 3] = np.nan
    status = np.zeros((2, 1, trials + 1), int)
    status[1, 0, 3] = 2
    cell = ("controller", "motion", "trial")
    return xr.Dataset(
        {
            "value": ((*cell, "index"), value),
            "status": (cell, status),
            "volt_peak": ((*cell, "actuator"), np.ones((2, 1, trials + 1, 2))),
            "unit": ("index", ["ms" if n in DELAYS else "percent" for n in NAMES]),
        },
        {"controller": ["lqg", "adfc"], "motion": ["m"], "trial": t, "index": list(NAMES)},
        {"seed": 1},
    )


def test_the_summary_says_what_it_should():
    summary = summarise(dataset())
    text = summary.markdown()
    tables = {t.title: t for t in summary.tables}
    assert "| adfc | m | 50 | 49 | 0 | 0 | 1 | 0 | 1.000 |" in text
    rows = tables["adfc on m: 49 of 50 trials"].rows
    values = np.delete(np.arange(1, 51), 2)
    for row, percent in zip(rows[0][1:4], (5, 50, 95), strict=True):
        assert row.startswith(number(np.percentile(values, percent)))
    assert rows[1][2].startswith(number(2 * np.percentile(values, 50)))
    pair = tables["adfc versus lqg on m"].rows[0]
    assert pair[1].startswith(number(-np.percentile(values, 50)))
    assert pair[2].startswith("100.0%") and pair[4] == "49"
    nominal = tables["Nominal plant beside Table 4 of the paper"]
    assert nominal.columns == ("index", "lqg, Table 4", "lqg, here", "adfc, Table 4", "adfc, here")
    assert float(nominal.rows[2][3]) == published.TABLE4["J2_1"][published.ADFC]


def test_numbers_keep_four_digits_and_gaps_show():
    assert [number(x) for x in (12.345, 0.12345, 1234.5, -2.0, np.nan)] == [
        "12.35", "0.123", "1234", "-2.000", "–"
    ]  # fmt: skip
