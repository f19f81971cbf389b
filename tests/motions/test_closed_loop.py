"""Hybrid simulations behave on a built-in motion as on the record it was made from."""

import sys
from pathlib import Path

import numpy as np
import pytest

from martths_jax.motions import BUILTIN_NAMES, load_record

from .places import need_records

EXPERIMENT = Path(__file__).resolve().parents[2] / "experiments" / "builtin_motions"


@pytest.fixture(scope="module")
def judge():
    sys.path.insert(0, str(EXPERIMENT))
    try:
        from closed_loop import Judge
    finally:
        sys.path.remove(str(EXPERIMENT))
    return Judge()


@pytest.mark.slow
@pytest.mark.usefixtures("optimised")
@pytest.mark.parametrize("name", BUILTIN_NAMES)
def test_indices_are_within_a_tenth_of_the_records(name, judge, tmp_path_factory, monkeypatch):
    monkeypatch.setenv("MARTHS_CACHE", str(tmp_path_factory.getbasetemp() / "cache"))
    real = judge(load_record(BUILTIN_NAMES[name], records=need_records()))
    made = judge(load_record(name))
    departure = np.abs(made / real - 1)
    assert np.all(departure <= 0.10), departure.round(3)
