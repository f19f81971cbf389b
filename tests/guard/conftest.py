"""What the tests of the guard share."""

import pytest

from martths_jax import ADFC


@pytest.fixture(autouse=True)
def one_lag_range(monkeypatch):
    """Look for delays in the widest range at once: one program to compile instead of three."""
    monkeypatch.setattr(ADFC, "first_lag_range", 2)
