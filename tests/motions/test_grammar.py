"""A record written in any way reads back right, or is refused; it is never another motion."""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from martths_jax.errors import InputError
from martths_jax.motions import load_record
from martths_jax.motions.units import TO_SI

from .records import FOREIGN, Written, running, tables

FEW = settings(max_examples=250, deadline=None, suppress_health_check=list(HealthCheck))


def read(one: Written, **changes):
    """The record of a file, None where it is refused."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"x{one.ending}"
        path.write_bytes(one.content)
        return load_record(path, **(one.options | changes))


def check_right(one: Written, record) -> None:
    assert record.acceleration.size == one.acceleration.size
    np.testing.assert_allclose(record.acceleration, one.acceleration, rtol=1e-9, atol=1e-9)
    marked = any("known to within" in notice for notice in record.notices)
    assert record.dt == pytest.approx(one.dt, rel=1e-2 if marked else 1e-3)


@FEW
@given(tables())
def test_table_reads_back_right(one):
    try:
        record = read(one)
    except InputError as error:
        # One column of decimal commas may as well be two of whole numbers.
        assert "decimal comma" in str(error), error
        assert not any(mark in one.content for mark in (b";", b"\t")), error
        return
    check_right(one, record)


@FEW
@given(running())
def test_running_series_reads_back_right(one):
    check_right(one, read(one))


@FEW
@given(st.one_of(tables(), running()), st.sampled_from(sorted(TO_SI)))
def test_another_unit_than_the_header_says_is_refused(one, unit):
    if one.told in (None, unit):
        return
    with pytest.raises(InputError, match="`units` \\(--units\\)"):
        read(one, units=unit)
