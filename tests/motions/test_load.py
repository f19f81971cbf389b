"""Scaling, sampling, the quiet tail, and what there is to load."""

import numpy as np
import pytest

from martths_jax.errors import InputError
from martths_jax.motions import (
    available_motions,
    load_motion,
    load_record,
    response_spectrum,
)
from martths_jax.motions.resampling import resample
from martths_jax.motions.units import G

DT = 0.02
TIME = np.arange(1000) * DT
WAVE = 3 * np.sin(2 * np.pi * 1.3 * TIME) * np.hanning(TIME.size)


@pytest.fixture
def folder(tmp_path):
    rows = "\n".join(f"{t:.9g},{a:.9g}" for t, a in zip(TIME, WAVE, strict=True))
    (tmp_path / "Wave One.csv").write_text("t [s],a [m/s2]\n" + rows)
    return tmp_path


def test_scaling(folder):
    base = load_record("waveone", records=folder)
    assert load_motion("waveone", records=folder).scale == 0.4
    by_pga = load_motion("waveone", records=folder, pga="0.4g")
    assert by_pga.scale == pytest.approx(0.4 * G / base.pga)
    assert np.abs(by_pga.acceleration).max() == pytest.approx(0.4 * G, rel=1e-3)
    assert load_motion("waveone", records=folder, pga=0.4 * G).scale == by_pga.scale
    for sa in ("0.3g@2.29Hz", f"0.3g@{1 / 2.29!r}s", (0.3 * G, 2.29)):
        by_sa = load_motion("waveone", records=folder, sa=sa)
        reached = response_spectrum(base.acceleration * by_sa.scale, DT, 1 / 2.29)[0]
        assert reached == pytest.approx(0.3 * G, rel=1e-9)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"pga": "0.4"}, ["pga", "0.4g"]),
        ({"pga": "0.4lb"}, ["pga", "lb", "g, m/s2"]),
        ({"pga": -1.0}, ["pga", "positive"]),
        ({"sa": "0.3g"}, ["sa", "0.3g@2.29Hz"]),
        ({"sa": "0.3g@2"}, ["sa", "0.3g@2.29Hz"]),
        ({"sa": (1.0,)}, ["sa"]),
        ({"sa": "0.3g@2Hz", "pga": "1g"}, ["`pga` and `sa`", "exclude"]),
        ({"scale": 1.0, "pga": "1g"}, ["`scale` and `pga`", "exclude"]),
        ({"scale": float("nan")}, ["scale"]),
        ({"fs": 0}, ["fs"]),
        ({"resample": "cubic"}, ["resample", "linear, bandlimited"]),
        ({"tail": -1}, ["tail"]),
    ],
)
def test_senseless_arguments_are_refused(folder, arguments, words):
    with pytest.raises(InputError) as caught:
        load_motion("waveone", records=folder, **arguments)
    for word in words:
        assert word in str(caught.value)


def test_linear_sampling_is_the_benchmarks(folder):
    motion = load_motion("waveone", records=folder, scale=1.0, tail=0.0)
    assert motion.acceleration.size == int(TIME[-1] * 1024) + 1
    np.testing.assert_allclose(motion.acceleration, np.interp(motion.time, TIME, WAVE), atol=1e-8)


def test_band_limited_sampling_follows_the_wave_between_samples():
    time = np.arange(20000) / 1024
    exact = 3 * np.sin(2 * np.pi * 1.3 * time)
    wave = 3 * np.sin(2 * np.pi * 1.3 * TIME)
    inner = slice(1500, 18000)
    good = resample(wave, DT, 1024, "bandlimited")[inner] - exact[inner]
    line = resample(wave, DT, 1024, "linear")[inner] - exact[inner]
    assert np.abs(good).max() < 2e-3 < np.abs(line).max()
    # At its own samples it gives them back.
    same = resample(wave, DT, 1 / DT, "bandlimited")
    np.testing.assert_allclose(same, wave[: same.size], atol=1e-12)


def test_band_limited_sampling_to_a_lower_rate_does_not_fold_over():
    tone = np.sin(2 * np.pi * 20 * TIME)  # above the 16 Hz that 32 Hz can hold
    inner = slice(100, 500)
    assert np.abs(resample(tone, DT, 32, "linear")[inner]).max() > 0.5
    assert np.abs(resample(tone, DT, 32, "bandlimited")[inner]).max() < 1e-3


def test_quiet_tail_is_appended_with_a_notice_and_only_once(folder, tmp_path):
    motion = load_motion("waveone", records=folder)
    quiet = motion.time > motion.duration - 4.9
    assert np.abs(motion.acceleration[quiet]).max() <= 1e-3 * np.abs(motion.acceleration).max()
    assert any("zeros were appended" in notice for notice in motion.notices)
    text = "\n".join(f"{k * DT:.9g},{a:.9g}" for k, a in enumerate(np.append(WAVE, np.zeros(250))))
    (tmp_path / "quiet.csv").write_text(text)
    assert load_motion(tmp_path / "quiet.csv", units="m/s2").notices == ()
    assert load_motion("waveone", records=folder, tail=0.0).notices == ()


def test_available_motions_lists_files_and_their_problems(folder):
    (folder / "no unit.csv").write_text("0,0\n0.01,1\n0.02,0\n")
    found = {info.name: info for info in available_motions(folder)}
    assert list(found)[:3] == ["elcentro-like", "kobe-like", "morganhill-like"]
    assert found["Wave One"].measures["PGA"] == pytest.approx(np.abs(WAVE).max())
    assert "--units" in found["no unit"].problem
