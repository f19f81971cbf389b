"""The benchmark's own records, where a copy of them is at hand."""

import numpy as np
import pytest
from scipy.io import loadmat

from martths_jax.motions import load_motion

from .places import need_records

FACTS = {
    "elcentro": ("ElCentroAccelNoScaling.mat", "ElCentroAccel", 41.18, 3.1349),
    "kobe": ("KobeAccelNoScaling.mat", "KobeAccel", 50.94, 6.3298),
    "morganhill": ("MorganAccelNoScaling.mat", "MorganAccel", 39.97, 2.3892),
}


@pytest.mark.parametrize("name", FACTS)
def test_record_by_name_is_the_benchmarks_motion(name):
    folder = need_records()
    file, array, duration, pga = FACTS[name]
    time, acceleration = loadmat(folder / file)[array]
    assert time[-1] == pytest.approx(duration)
    assert np.abs(acceleration).max() == pytest.approx(pga, rel=1e-4)
    motion = load_motion(name, records=folder)
    assert motion.name == name
    assert motion.scale == 0.40
    samples = np.arange(int(np.floor(duration * 1024)) + 1) / 1024
    assert motion.acceleration.size == samples.size
    # Interpolating between the file's own time stamps differs from the uniform grid by rounding.
    expected = 0.4 * np.interp(samples, time, acceleration)
    np.testing.assert_allclose(motion.acceleration, expected, atol=1e-10)


def test_name_file_name_and_path_give_the_same_motion(monkeypatch):
    folder = need_records()
    monkeypatch.setenv("MARTHS_RECORDS", str(folder))
    by_name = load_motion("kobe", scale=1.0)
    for other in ("KobeAccelNoScaling.mat", "KobeAccelNoScaling", folder / FACTS["kobe"][0]):
        same = load_motion(other, scale=1.0)
        assert (same.name, same.sha256) == (by_name.name, by_name.sha256)
        np.testing.assert_array_equal(same.acceleration, by_name.acceleration)
