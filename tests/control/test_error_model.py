"""The error model beside a filter of the error alone, as it is published."""

import numpy as np
import pytest
from scipy import signal

from martths_jax import InputError
from martths_jax.control.adaptive.inverse import nominal_inverse
from martths_jax.control.controllers import error_model
from tests.control.pieces_oracle import TARGET, engine, textbook

FS = 1024.0
MATRICES = {
    1: np.array([[1, 0, 0], [1.5, -2, 0.5]]),
    2: np.array([[1, 0, 0, 0], [1.5, -2, 0.5, 0], [2, -5, 4, -1]]),
}


@pytest.mark.parametrize(("order", "least"), [(1, 2.0), (2, 8.0)])
def test_it_is_a_filter_of_the_error_that_starts_at_zero(benchmark, order, least):
    """theta_e of F[u] - C_0' F[phi], whole matrices and Joseph's form; u = (C_0 + theta_e)' phi."""
    matrix, spread, walk, error = MATRICES[order], 0.3, 0.5, 0.4
    made = error_model.ENTRY.build(
        benchmark, order=order, spread=spread, walk=walk, error=error, cutoff=150.0,
        threshold=least,
    )  # fmt: skip
    C_0 = nominal_inverse(benchmark.plant_model, FS, matrix, band_hz=3.0)
    size = np.sqrt((C_0**2).mean(axis=1))
    b, a = signal.butter(6, 150.0, fs=FS)
    kept = {}

    def learn(k, phi, u, last, part):
        if k == 0:
            kept["P"], kept["theta"] = np.diag((spread * size) ** 2), np.zeros_like(C_0)
        n = len(matrix)
        if k < matrix.shape[1] - 1:
            return last, 0
        row = phi[-1]
        if max(abs(row[0]), abs(row[n])) <= least:
            return last, 1
        P, theta = kept["P"], kept["theta"]
        gain = P @ row / (error**2 + row @ P @ row)
        rest = np.eye(2 * n) - np.outer(gain, row)
        theta = theta + np.outer(gain, u[-1] - row @ C_0 - row @ theta)
        P = rest @ P @ rest.T + error**2 * np.outer(gain, gain)
        kept["P"], kept["theta"] = P + np.diag((walk * size) ** 2) / FS, theta
        return C_0 + theta, 0

    expected = textbook(
        matrix, True, learn, start=C_0, both=lambda x: signal.lfilter(b, a, x, axis=0)
    )
    found = engine(made, benchmark)
    for name, one, other in zip(("C", "u", "held"), found, expected, strict=True):
        scale = np.abs(other).max()
        np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-9 * scale, err_msg=name)
    held = expected[2][-1]
    assert 0 < held.min() and held.max() < len(TARGET) - 10
    assert np.abs(found[0][-1] / C_0[..., None] - 1).max() > 0.05


def test_it_starts_at_the_inverse(benchmark):
    """Without a wait the first commands are those of the nominal inverse."""
    made = error_model.ENTRY.build(benchmark)
    matrix = MATRICES[2]
    C_0 = nominal_inverse(benchmark.plant_model, FS, matrix, band_hz=3.0)
    found = engine(made, benchmark)[1][0]  # x_a before is zero: phi = (1, 1.5, 2) x_a
    phi = np.einsum("j,it->ijt", matrix[:, 0], TARGET[0]).reshape(6, -1)
    np.testing.assert_allclose(found, C_0.T @ phi, rtol=1e-10)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"order": 3}, "`order` must be a whole number from 1 to 2, but got 3"),
        ({"band": 512.0}, "`band` must lie between 0 and 512 Hz, half the sampling rate"),
        ({"cutoff": 512.0}, "`cutoff` must lie between 0 and 512 Hz"),
        ({"error": 0.0}, r"`error` must be a number above 0 \(mm\)"),
    ],
)
def test_settings_that_cannot_be_used(benchmark, settings, message):
    with pytest.raises(InputError, match=message):
        error_model.ENTRY.build(benchmark, **settings)
