"""The recursive time series beside the textbook's recursion, sample by sample."""

import numpy as np
import pytest

from martths_jax import InputError
from martths_jax.control.adaptive import Pair
from martths_jax.control.controllers import ats_rls
from martths_jax.control.controllers.ats import PRESETS
from tests.control.pieces_oracle import engine, textbook
from tests.control.test_ats import DELAY, FS, MATRIX, both, limited

SECONDS = 0.02 ** np.arange(3.0)  # columns x, 0.02 s x', 4e-4 s^2 x''
ROWS = MATRIX * (0.02 * FS) ** np.arange(3.0)[:, None]
START = np.array([[1.0, 1.0], DELAY, np.square(DELAY) / 2]) / SECONDS[:, None]


def recursion(mu, spread, threshold, seen):
    """``learn``: P and a correct each other, and stay where a sample cannot be trusted."""
    published = PRESETS["chae2013"]
    low, high = (np.array(published[n]) / SECONDS for n in ("low", "high"))
    P_0 = np.diag((spread * np.array([0.05, 2e-3, 2e-5]) / SECONDS / 0.01) ** 2)
    kept = {}

    def learn(k, phi, u, last, part):
        if k == 0:
            kept[part] = P_0
        if k < 3:
            return last, 0
        P, row = kept[part], phi[-1]
        g = P @ row / (mu + row @ P @ row)
        C = last + np.outer(g, u[-1] - row @ last)
        P = (P - np.outer(g, row @ P)) / mu
        P = P * min(1.0, np.trace(P_0) / np.trace(P))
        inside = np.all((low <= C[:, 0]) & (C[:, 0] <= high))
        seen["outside"] += not inside
        seen["still"] += abs(row[0]) <= threshold
        if not inside or abs(row[0]) <= threshold:
            return last, 1
        kept[part] = P
        return limited(C, last, published, 1 / SECONDS), 0

    return learn


@pytest.mark.parametrize("spread", [1.0, 0.003])
def test_it_is_conditional_recursive_least_squares(benchmark, spread):
    made = ats_rls.ENTRY.build(
        benchmark, forgetting=0.95, spread=spread, threshold=0.3, cutoff=150.0, delay=DELAY
    )
    seen = {"outside": 0, "still": 0}
    learn = recursion(0.95, spread, 0.3, seen)
    expected = textbook(ROWS, False, learn, start=START, both=both)
    found = engine(made, benchmark)
    for name, a, b in zip(("C", "u", "held"), found, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-11 * np.abs(b).max(), err_msg=name)
    # Both conditions were met and missed.
    assert seen["outside"] > 0 and seen["still"] > 0 and expected[2].max() < 2 * 60
    assert np.ptp(expected[0][-1], axis=-1).max() > 1e-3


def test_equations_that_hold_are_found(benchmark):
    """Without noise a plant x(k) = u(k-1) / 1.1 is found by the filtered pairs."""
    made = ats_rls.ENTRY.build(benchmark, cutoff=150.0, delay=(0.0, 0.0), spread=3.0)
    ready = made.prepare(benchmark)
    part, rng = ready.parts[0], np.random.default_rng(2)
    last, P = part.columns(ready.start[..., None]), ready.fit.init(part, 1)
    for k in range(40):
        phi = list(rng.standard_normal((3, 1)))
        truth = 1.1 * phi[0] + 0.02 * phi[1] + 0.01 * phi[2]
        P, fitted = ready.fit.step(P, part, Pair(k, 1 / FS, phi, [truth]), last, None)
        last = fitted.coefficients
    # What is left is the prior, of weight (0.01 mm / 0.15)^2 beside 40 rows.
    np.testing.assert_allclose(np.ravel(last), [1.1, 0.02, 0.01], atol=2e-5)


def test_settings_that_cannot_be_used(benchmark):
    for settings, message in (
        ({"cutoff": 600.0}, "`cutoff` must lie between 0 and 512 Hz"),
        ({"forgetting": 1.01}, "`forgetting` must be a number from 0.9 to 1"),
    ):
        with pytest.raises(InputError, match=message):
            ats_rls.ENTRY.build(benchmark, **settings)
