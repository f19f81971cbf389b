"""Sobol' indices of functions whose indices are known in closed form."""

import numpy as np
import pytest
from scipy.stats import norm

from martths_jax.plant import PARAMETERS
from martths_jax.sensitivity.design import make_design, saltelli
from martths_jax.sensitivity.estimators import sobol, verdicts


def ishigami(unit: np.ndarray, a: float = 7.0, b: float = 0.1) -> np.ndarray:
    """sin x1 + a sin^2 x2 + b x3^4 sin x1, x uniform on (-pi, pi)."""
    x = np.pi * (2 * unit - 1)
    return np.sin(x[..., 0]) + a * np.sin(x[..., 1]) ** 2 + b * x[..., 2] ** 4 * np.sin(x[..., 0])


def ishigami_indices(a: float = 7.0, b: float = 0.1):
    """First-order and total indices (Ishigami and Homma 1990)."""
    V1 = 0.5 * (1 + b * np.pi**4 / 5) ** 2
    V2 = a**2 / 8
    V13 = b**2 * np.pi**8 * (1 / 18 - 1 / 50)
    return np.array([V1, V2, 0]) / (V1 + V2 + V13), np.array([V1 + V13, V2, V13]) / (V1 + V2 + V13)


def test_saltelli_rows_mix_a_and_b():
    unit = saltelli(64, 3, seed=4)
    A, B = unit[:, 0], unit[:, 1]
    assert unit.shape == (64, 5, 3) and not np.any(A == B)
    for i in range(3):
        others = [j for j in range(3) if j != i]
        assert np.array_equal(unit[:, 2 + i, i], B[:, i])
        assert np.array_equal(unit[:, 2 + i, others], A[:, others])
    # Balanced: every eighth of every axis holds an eighth of the points.
    for points in (A, B):
        assert all(np.all(np.bincount((8 * c).astype(int)) == 8) for c in points.T)
    assert np.array_equal(unit, saltelli(64, 3, seed=4))
    assert not np.array_equal(unit, saltelli(64, 3, seed=5))


def test_ishigami():
    unit = saltelli(4096, 3, seed=1)
    found = sobol(ishigami(unit)[..., None])
    first, total = ishigami_indices()
    assert found.first[0] == pytest.approx(first, abs=0.02)
    assert found.total[0] == pytest.approx(total, abs=0.02)
    assert np.all((found.first_low[0] <= first) & (first <= found.first_high[0]))
    assert np.all((found.total_low[0] <= total) & (total <= found.total_high[0]))
    assert found.width[0] < 0.15
    # Offset and unit of the output do not matter.
    moved = sobol(1e3 * ishigami(unit)[..., None] + 1e6)
    assert moved.first == pytest.approx(found.first, abs=1e-6)
    assert moved.total_high == pytest.approx(found.total_high, abs=1e-6)


def test_linear_function_of_normal_variables():
    """f = sum c_i x_i has S_i = ST_i = c_i^2 / sum c^2; several outputs stay apart."""
    design = make_design(2048, motions=3, seed=2)
    x = norm.ppf(design.unit)
    c = np.array([np.arange(1.0, 12.0), np.arange(11.0, 0.0, -1.0)])
    found = sobol(np.einsum("nrd,md->nrm", x, c))
    known = c**2 / np.sum(c**2, axis=1, keepdims=True)
    assert found.first == pytest.approx(known, abs=0.03)
    assert found.total == pytest.approx(known, abs=0.03)
    inside = (found.total_low <= known) & (known <= found.total_high)
    assert inside.mean() > 0.8
    assert design.factors == (*PARAMETERS, "noise", "motion")


def test_intervals_cover_as_often_as_they_say():
    """Over many independent designs 95 % intervals hold the truth in about 95 % of the cases."""
    c = np.array([3.0, 2.0, 1.0])
    known = c**2 / np.sum(c**2)
    hits = []
    for seed in range(120):
        rng = np.random.default_rng(seed)
        A, B = rng.random((2, 128, 3))
        unit = np.stack([A, B, *(np.where(np.arange(3) == i, B, A) for i in range(3))], axis=1)
        found = sobol((norm.ppf(unit) @ c)[..., None], resamples=300, seed=seed)
        hits.append((found.total_low[0] <= known) & (known <= found.total_high[0]))
    assert np.mean(hits) == pytest.approx(0.95, abs=0.05)


def test_what_means_nothing_is_said():
    unit = saltelli(128, 3, seed=3)
    steady = np.full(unit.shape[:2], 0.9765625)
    noisy = np.random.default_rng(0).standard_normal(unit.shape[:2]) ** 5
    values = np.stack([ishigami(unit), steady, noisy], axis=-1)
    found = sobol(values)
    assert np.all(np.isnan(found.first[1])) and np.all(np.isfinite(found.first[[0, 2]]))
    told = verdicts(("a", "b", "c"), found, 128)
    assert "does not vary: it is 0.976562" in told["b"]
    assert "too small" in told["c"]
    few = verdicts(("a", "b", "c"), sobol(values[:8]), 8)
    assert "N = 8 is too small" in few["a"]
    assert verdicts(("a",), sobol(ishigami(saltelli(4096, 3, 1))[..., None]), 4096) == {"a": ""}


@pytest.mark.parametrize("width", [1e306, np.inf])
def test_an_interval_without_end_is_said(width):
    """Of two base samples a resample can be one twice, with next to no variance."""
    found = sobol(ishigami(saltelli(8, 3, 1))[..., None])
    found.first_high[...] = width
    told = verdicts(("a",), found, 8)["a"]
    assert "N = 8 is too small" in told and "too wide to say how many would do" in told


def test_a_lost_run_takes_its_base_sample_along():
    unit = saltelli(256, 3, seed=3)
    values = ishigami(unit)[..., None]
    lost = values.copy()
    lost[5, 3], lost[9, 0] = np.nan, np.inf
    found = sobol(lost, seed=1)
    kept = np.delete(np.arange(256), [5, 9])
    assert found.used == 254
    assert np.array_equal(found.first, sobol(values[kept], seed=1).first)
    gone = sobol(np.full((4, 5, 1), np.nan))
    assert gone.used == 0 and np.all(np.isnan(gone.total))
    assert "only 0 of 4 base samples" in verdicts(("a",), gone, 4)["a"]


def test_factors_of_the_design():
    one = make_design(8, motions=1, seed=0)
    assert one.factors[-1] == "noise" and one.rows == 8 * 12
    assert np.all(one.motions(1) == 0)
    three = make_design(64, motions=3, seed=0)
    picked = three.motions(3)
    assert set(picked) == {0, 1, 2}
    assert np.allclose(np.bincount(picked) / picked.size, 1 / 3, atol=0.02)
    draws = three.draws()
    assert draws.shape == (64 * 13, 9) and np.all(np.isfinite(draws))
    assert np.std(draws) == pytest.approx(1, abs=0.05)
    # Only AB of the noise, and B, leave A's noise: two realisations a base sample.
    streams = three.streams().reshape(64, 13)
    own = np.ones(13, bool)
    own[[1, 2 + 9]] = False
    assert np.all(streams[:, own] == streams[:, :1])
    assert np.all(streams[:, 2 + 9] == streams[:, 1])
    assert np.unique(streams).size == 128
