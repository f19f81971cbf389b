"""Adaptive model-based compensation beside its equations, and what they say of its gain."""

import numpy as np
import pytest
from scipy import signal

from martths_jax import InputError
from martths_jax.control.adaptive import Pair
from martths_jax.control.controllers import amb
from tests.control.pieces_oracle import N, engine, textbook

FS, DELAY = 1024.0, (0.002, 0.001)
SCALE = 0.02 * FS  # of dt x' in the columns
ROWS = np.array([[1, 0, 0], [1, -1, 0], [1, -2, 1]]) * SCALE ** np.arange(3.0)[:, None]
START = np.array([[1, 1], np.divide(DELAY, 0.02), np.divide(DELAY, 0.02) ** 2 / 2])


def test_it_is_the_normalised_gradient(benchmark):
    """a += dt Gamma phi e / (1 + phi' phi) on filtered pairs, none below zero."""
    rate, cutoff = 300.0, 150.0
    made = amb.ENTRY.build(benchmark, rate=rate, cutoff=cutoff, delay=DELAY)
    b, a = signal.butter(4, cutoff, fs=FS)
    cut = []

    def learn(k, phi, u, last, part):
        if k < 2:
            return last, 0
        row = phi[-1]
        step = rate / FS * np.outer(row, u[-1] - row @ last) / (1 + row @ row)
        cut.append(np.any(last + step < 0))
        return np.maximum(last + step, 0), 0

    expected = textbook(
        ROWS, False, learn, start=START, both=lambda x: signal.lfilter(b, a, x, axis=0)
    )
    for one, other in zip(engine(made, benchmark), expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-11 * np.abs(other).max())
    assert 0 < sum(cut) < 4 * N  # the bound was met, and was not all that there was


@pytest.mark.parametrize("rate", [100.0, 1500.0])
def test_a_repeated_pair_is_learnt_geometrically(benchmark, rate):
    """e falls by 1 - dt Gamma phi'phi / (1 + phi'phi) a sample, so it is stable below 2 / dt."""
    ready = amb.ENTRY.build(benchmark, rate=rate, delay=(0.0, 0.0)).prepare(benchmark)
    part, phi = ready.parts[0], [np.array([x]) for x in (0.6, 0.8, 0.5)]
    power = sum(float(x[0]) ** 2 for x in phi)
    last, errors = part.columns(ready.start[..., None]), []
    for k in range(6):
        errors.append(2.0 - float(sum(row[0] * x for row, x in zip(last, phi, strict=True))[0]))
        pair = Pair(k, 1 / FS, phi, [np.array([2.0])])
        last = ready.fit.step((), part, pair, last, None)[1].coefficients
    ratio = 1 - rate / FS * power / (1 + power)
    assert abs(ratio) < 1
    np.testing.assert_allclose(np.divide(errors[1:], errors[:-1]), ratio, rtol=1e-9)


def test_settings_that_cannot_be_used(benchmark):
    for settings, message in (
        ({"cutoff": 512.0}, "`cutoff` must lie between 0 and 512 Hz"),
        ({"rate": 0.0}, r"`rate` must be a number above 0 \(1/s\)"),
    ):
        with pytest.raises(InputError, match=message):
            amb.ENTRY.build(benchmark, **settings)
