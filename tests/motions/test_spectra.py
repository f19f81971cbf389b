"""Oscillator recurrence, spectra and intensity measures against closed forms and eqsig."""

import eqsig
import numpy as np
import pytest

from martths_jax.errors import InputError
from martths_jax.motions import (
    arias_intensity,
    cumulative_absolute_velocity,
    husid,
    peak_ground_velocity,
    response_spectrum,
    sdof_response,
    significant_duration,
    spectral_acceleration,
)
from martths_jax.motions.units import G

DT = 0.01
RNG = np.random.default_rng(3)
NOISE = np.cumsum(RNG.standard_normal(1500)) * np.hanning(1500)


def test_step_of_acceleration_has_the_textbook_response():
    # x = -(1/w^2) (1 - exp(-zeta w t) (cos wd t + zeta/sqrt(1 - zeta^2) sin wd t))
    period, zeta = 0.5, 0.05
    w = 2 * np.pi / period
    wd = w * np.sqrt(1 - zeta**2)
    t = np.arange(300) * DT
    decay = np.exp(-zeta * w * t)
    exact = -(1 - decay * (np.cos(wd * t) + zeta * w / wd * np.sin(wd * t))) / w**2
    x, v = sdof_response(np.ones(300), DT, period, zeta)
    np.testing.assert_allclose(x, exact, atol=1e-14)
    np.testing.assert_allclose(v, -decay * np.sin(wd * t) / wd, atol=1e-13)
    peak = 1 + np.exp(-zeta * w * np.pi / wd)
    assert response_spectrum(np.ones(300), DT, period, zeta)[0] == pytest.approx(peak, rel=3e-3)


def test_ramp_without_damping():
    # a = t: x = -(t - sin(w t)/w)/w^2
    w = 7.0
    t = np.arange(200) * DT
    x, _ = sdof_response(t, DT, 2 * np.pi / w, 0.0)
    np.testing.assert_allclose(x, -(t - np.sin(w * t) / w) / w**2, atol=1e-12)


def test_response_does_not_depend_on_how_the_lines_are_cut():
    fine = np.interp(np.arange(1499 * 8 + 1) / 8, np.arange(1500), NOISE)
    for period in (0.02, 0.3, 5.0):
        coarse = sdof_response(NOISE, DT, period)
        finer = sdof_response(fine, DT / 8, period)
        for one, two in zip(coarse, finer, strict=True):
            np.testing.assert_allclose(one, two[::8], atol=1e-9 * np.abs(one).max())


@pytest.mark.parametrize("dt", [0.005, 0.02])
def test_spectrum_agrees_with_eqsig_on_a_fine_grid(dt):
    periods = np.array([0.02, 0.05, 0.1, 0.5, 2.0, 5.0])
    parts = 64
    fine = np.interp(np.arange(1499 * parts + 1) / parts, np.arange(1500), NOISE)
    signal = eqsig.AccSignal(fine, dt / parts)
    signal.generate_response_spectrum(response_times=periods, xi=0.05)
    np.testing.assert_allclose(response_spectrum(NOISE, dt, periods), signal.s_a, rtol=4e-3)


def test_short_periods_on_a_coarse_record_need_the_finer_grid():
    # One hat-shaped pulse a step of 0.02 s wide, and oscillators of 0.02 to 0.06 s: at the record's
    # own samples most of their responses have long passed their peak.
    dt = 0.02
    pulse = np.zeros(20)
    pulse[5] = 1.0
    periods = np.linspace(0.02, 0.06, 9)
    true = response_spectrum(pulse, dt, periods)
    finest = response_spectrum(pulse, dt, periods, points_per_period=1280)
    np.testing.assert_allclose(true, finest, rtol=3.2e-3)
    sampled = [(2 * np.pi / p) ** 2 * np.abs(sdof_response(pulse, dt, p)[0]).max() for p in periods]
    assert np.max(1 - sampled / true) > 0.10


def test_limits_of_the_spectrum():
    rigid = response_spectrum(NOISE, DT, 1e-4)[0]
    assert rigid == pytest.approx(np.abs(NOISE).max(), rel=1e-3)
    # A very soft oscillator's mass stays where it is: x is minus the ground displacement.
    velocity = np.concatenate([[0], np.cumsum(0.5 * DT * (NOISE[1:] + NOISE[:-1]))])
    _, v = sdof_response(NOISE, DT, 1e5, 0.0)
    np.testing.assert_allclose(v, -velocity, atol=1e-6 * np.abs(velocity).max())


@pytest.mark.parametrize(
    "arguments",
    [(NOISE, DT, 0.0), (NOISE, DT, [1.0, np.nan]), (NOISE, -DT, 1.0), (NOISE, DT, 1.0, 1.0),
     (NOISE[:1], DT, 1.0)],
)  # fmt: skip
def test_senseless_arguments_are_refused(arguments):
    with pytest.raises(InputError):
        response_spectrum(*arguments)


def test_measures_of_a_sine():
    t = np.arange(0, 20 + DT / 2, DT)
    a = 2.0 * np.sin(2 * np.pi * t)
    assert arias_intensity(a, DT) == pytest.approx(np.pi / (2 * G) * 4 * 10, rel=1e-9)
    assert cumulative_absolute_velocity(a, DT) == pytest.approx(2 * 20 * 2 / np.pi, rel=1e-3)
    assert peak_ground_velocity(a, DT) == pytest.approx(2 * 2 / (2 * np.pi), rel=1e-3)
    assert significant_duration(a, DT) == pytest.approx(18, abs=0.05)
    assert np.all(np.diff(husid(a, DT)) >= 0)


def test_measures_agree_with_eqsig():
    signal = eqsig.AccSignal(NOISE, DT)
    assert arias_intensity(NOISE, DT) == pytest.approx(
        eqsig.im.calc_arias_intensity(signal)[-1], rel=2e-3
    )
    assert cumulative_absolute_velocity(NOISE, DT) == pytest.approx(
        eqsig.im.calc_cav(signal)[-1], rel=2e-3
    )
    assert significant_duration(NOISE, DT) == pytest.approx(
        eqsig.im.calc_sig_dur(signal), abs=2 * DT
    )
    assert peak_ground_velocity(NOISE, DT) == pytest.approx(signal.pgv, rel=1e-3)
    assert spectral_acceleration(NOISE, DT, 2.0) == response_spectrum(NOISE, DT, 0.5)[0]
