"""Whatever a file holds, reading it gives a motion or an `InputError`, and nothing else."""

import io
import tempfile
from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from martths_jax.errors import InputError
from martths_jax.motions import Motion, load_motion

FEW = settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))

HEADER = b"PEER\nEvent\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS=  6, DT=   .0050 SEC,\n"
AT2 = HEADER + b"  .1000000E-02  .2000000E-02 -.3000000E-02  .1000000E-02  .0000000E+00\n  .5E-03\n"
CSV = b"time [s],acceleration [m/s^2]\n0,0\n0.01,1.5\n0.02,-2\n0.03,0\n"


def mat_bytes():
    buffer = io.BytesIO()
    wave = np.sin(np.arange(9.0))
    savemat(buffer, {"M": np.stack([np.arange(9) * 0.01, wave]), "s": {"a": wave, "dt": 0.01}})
    return buffer.getvalue()


MAT = mat_bytes()


def hdf5_bytes():
    import h5py

    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file["M"] = np.stack([np.arange(9) * 0.01, np.sin(np.arange(9.0))], axis=1)
    return buffer.getvalue()


HDF5 = hdf5_bytes()


def read(content: bytes, ending: str, **options):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"x{ending}"
        path.write_bytes(content)
        try:
            motion = load_motion(path, **options)
        except InputError as error:
            assert len(str(error)) > 20
            return
    assert isinstance(motion, Motion)
    assert motion.acceleration.ndim == 1 and motion.acceleration.size >= 1
    assert np.all(np.isfinite(motion.acceleration))


def damaged(base: bytes):
    """`base` with a few bytes replaced, cut out or inserted."""
    edit = st.tuples(st.integers(0, len(base)), st.integers(0, 8), st.binary(max_size=8))

    def apply(edits):
        content = base
        for place, cut, new in edits:
            content = content[:place] + new + content[place + cut :]
        return content

    return st.lists(edit, min_size=1, max_size=4).map(apply)


options = st.fixed_dictionaries(
    {
        "units": st.sampled_from([None, "g", "m/s2", "cm/s2"]),
        "dt": st.sampled_from([None, 0.01, 1e-300, 1e300, float("nan"), -1.0]),
        "resample": st.sampled_from(["linear", "bandlimited"]),
    }
)
endings = st.sampled_from([".csv", ".AT2", ".mat", ".txt", ".dat", ".zip", ""])


@FEW
@given(st.binary(max_size=300), endings, options)
def test_any_bytes(content, ending, chosen):
    read(content, ending, **chosen)


@FEW
@given(damaged(CSV), options)
def test_damaged_csv(content, chosen):
    read(content, ".csv", **chosen)


@FEW
@given(damaged(AT2), options)
def test_damaged_at2(content, chosen):
    read(content, ".AT2", **chosen)


@FEW
@given(damaged(MAT), options, st.sampled_from([None, "M", "s.a", "nothing"]))
def test_damaged_mat(content, chosen, variable):
    read(content, ".mat", variable=variable, **chosen)


@FEW
@given(damaged(HDF5), options)
def test_damaged_hdf5(content, chosen):
    read(content, ".mat", **chosen)


NUMBERS = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True).map(repr),
    st.integers(-(10**30), 10**30).map(str),
    st.sampled_from(["", "1e999", "-0", "1d5", "1,5", "0x1", "--1", "1e-320"]),
)


@FEW
@given(
    st.lists(st.lists(NUMBERS, min_size=1, max_size=3), max_size=8),
    st.sampled_from(",; \t"),
    options,
)
def test_tables_of_odd_numbers(rows, separator, chosen):
    read("\n".join(separator.join(row) for row in rows).encode(), ".csv", **chosen)


@FEW
@given(st.text(max_size=40), st.text(max_size=20))
@example("~\0", "")
@example("~nobody-is-called-this/motion.mat", "")
def test_any_name(name, quantity):
    for arguments in ({}, {"pga": quantity}, {"sa": quantity}, {"units": quantity}):
        try:
            load_motion(name, **arguments)
        except InputError:
            continue
