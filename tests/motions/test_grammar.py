"""A record written in any way reads back right, or is refused; it is never another motion."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from martths_jax.errors import InputError
from martths_jax.motions import load_record
from martths_jax.motions.timeaxis import uniform_step
from martths_jax.motions.units import TO_SI

from .records import Written, running, tables

FEW = settings(max_examples=100, deadline=None, suppress_health_check=list(HealthCheck))


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


@FEW
@given(tables(foreign=True), st.sampled_from([None, *sorted(TO_SI)]))
def test_a_unit_of_another_quantity_is_refused_whatever_is_asked(one, unit):
    with pytest.raises(InputError):
        read(one, units=unit)


@FEW
@given(st.one_of(tables(), running()), st.data())
def test_a_damaged_row_is_never_another_motion(one, data):
    """A cell lost or broken, a row left out: the right motion, or a refusal."""
    text = one.content.decode(
        "utf-16" if one.content[:2] in (b"\xff\xfe", b"\xfe\xff") else "cp1252"
    )
    lines = text.splitlines()
    rows = [k for k, line in enumerate(lines) if line[:1].isdigit() or line[:1] in "-. "]
    row = data.draw(st.sampled_from(rows[1:-1]))
    broken = data.draw(st.sampled_from(["", "n/a", "1.2.3", "--", "0.1;0.2;0.3;0.4;0.5", "x"]))
    words = lines[row].split(";")
    lines[row] = ";".join([*words[:-1], broken])
    damaged = Written(
        "\n".join(lines).encode(), one.ending, one.options, one.acceleration, one.dt, one.told
    )
    try:
        record = read(damaged)
    except InputError:
        return
    # A line that is gone leaves no trace where there are no times.
    assert broken == "" and len(words) == 1, "a broken row was read"
    assert record.acceleration.size < one.acceleration.size


@FEW
@given(
    st.integers(20, 1100),
    st.integers(20, 600),
    st.integers(2, 5),
    st.floats(0, 5),
    st.sampled_from([np.round, lambda t, d: np.floor(t * 10**d) / 10**d]),
    st.data(),
)
def test_printed_times_say_their_step_or_are_refused(rate, samples, decimals, start, cut, data):
    time = cut(start + np.arange(samples) / rate, decimals)
    fine = 10.0**-decimals <= 0.489 / rate  # clear of the limit, which rounding may pass
    try:
        step, notices = uniform_step(time, "Times")
    except InputError:
        assert not fine
        return
    # Whole steps of the last digit are read as they stand, though a rate may round to them.
    doubt = 1.001 * 10.0**-decimals / (samples - 1)
    assert abs(step - 1 / rate) <= doubt
    assert doubt <= 1.01e-3 * step or step == 1 / rate or notices or np.ptp(np.diff(time)) < 1e-9
    gone = data.draw(st.integers(1, samples - 2))
    with pytest.raises(InputError):
        uniform_step(np.delete(time, gone), "Times")


def test_a_gap_in_coarsely_printed_times_is_found():
    time = np.round(1.43 + np.arange(58) / 339, 3)  # no time is further off the line than rounding
    with pytest.raises(InputError, match="uniform step"):
        uniform_step(np.delete(time, 29), "Times")
    assert uniform_step(time, "Times")[0] == pytest.approx(1 / 339, rel=1e-2)
