"""Spectral radius and delay margin against what simulations of the frozen loop do."""

from dataclasses import replace

import numpy as np
import pytest

from martths_jax import (
    ADFC,
    LQG,
    InputError,
    Motion,
    Passthrough,
    SensorNoise,
    build_benchmark,
    draw_plants,
    nominal_plant,
    plant_from_draws,
    simulate,
)
from martths_jax.control.adaptive.differences import BACKWARD_DIFFERENCES
from martths_jax.control.adaptive.inverse import nominal_inverse
from martths_jax.stability import (
    delay_margin,
    linear_loop,
    radius_along,
    response,
    spectral_radius,
)
from tests.conformity.broken import Sound

IMPULSE = Motion("impulse", np.eye(1, 3000)[0] * 1e-2, 1024.0)
QUIET = SensorNoise(noise_power=0.0)


def inverse(benchmark, **options):
    return nominal_inverse(benchmark.plant_model, benchmark.fs, BACKWARD_DIFFERENCES, **options)


def test_radius_is_the_growth_or_decay_of_a_simulation(benchmark):
    """Coefficients on the way from a stable set to an unstable one, frozen and struck once."""
    stable, unstable = inverse(benchmark), inverse(benchmark, noise_share=0.0)
    parts = np.array([0.0, 0.35, 0.45, 0.5])
    C = np.stack([(1 - p) * stable + p * unstable for p in parts], axis=-1)
    plants = plant_from_draws(np.zeros((parts.size, 9)))
    frozen = ADFC().frozen(benchmark, C)
    radius = spectral_radius(benchmark, frozen, plants)
    assert np.all(radius[:2] < 1) and np.all(radius[2:] > 1.01)

    each = [replace(frozen, coefficients=C[..., i]) for i in range(parts.size)]
    u = simulate(benchmark, each, plants, IMPULSE, QUIET, keep=True).signals["u"][..., 0]
    for i in (0, 1):
        # The last second and a half, when all but the two slowest modes are gone.
        assert growth(u[i, -1500::30]) ** (1 / 30) == pytest.approx(radius[i], abs=1e-7)
    for i in (2, 3):
        # Until strokes reach a tenth of a millimetre, where the coupler is still linear.
        before = u[i, : np.argmax(~(np.abs(u[i]) < 0.1))]
        assert growth(before[-30:]) == pytest.approx(radius[i], rel=1e-4)


def growth(x):
    """Largest pole of x(k) = sum_j c_j x(k-j), four terms, fitted to a signal (Prony)."""
    rows = np.stack([x[3 - j : len(x) - 1 - j] for j in range(4)], axis=1)
    c = np.linalg.lstsq(rows, x[4:], rcond=1e-14)[0]
    return np.abs(np.roots(np.append(1.0, -c))).max()


def test_radius_along_a_run(benchmark):
    plants = draw_plants(2, seed=1)
    anchor = inverse(benchmark)
    history = np.broadcast_to(anchor, (2, 50, 8, 2)).copy()
    history[1, 30:] = inverse(benchmark, noise_share=0.0)
    radius = radius_along(benchmark, ADFC(), plants, history, [0, 29, 30, 49])
    assert radius.shape == (2, 4)
    assert np.all(radius[0] < 1) and np.all(radius[1, :2] < 1) and np.all(radius[1, 2:] > 1.1)
    alone = spectral_radius(benchmark, ADFC().frozen(benchmark, anchor), plants)
    np.testing.assert_allclose(radius[:, 0], alone, rtol=1e-9)


@pytest.mark.parametrize("fs", [512, 1024, 4096])
def test_what_the_fit_is_pulled_to_is_a_stable_loop_by_itself(fs):
    benchmark = build_benchmark(fs)
    plants = draw_plants(40, seed=5, spread=2.0)
    frozen = ADFC().frozen(benchmark, inverse(benchmark))
    assert np.all(spectral_radius(benchmark, frozen, plants) < 1)


@pytest.mark.slow
def test_delay_margin_against_whole_samples_of_delay(benchmark):
    """The LQG loop bears some samples; commands that are delayed by whole ones say the same."""
    lqg, plants = LQG.design(benchmark, error="measured"), draw_plants(3, seed=2)
    margin = delay_margin(benchmark, lqg, plants)
    softer = replace(lqg, K_e=0.3 * lqg.K_e)
    for controller, ms in ((lqg, margin), (softer, delay_margin(benchmark, softer, plants))):
        for i, matrices in enumerate(zip(*linear_loop(benchmark, controller, plants, opened=True),
                                         strict=True)):  # fmt: skip
            samples = ms[i] * 1.024
            assert delayed_radius(*matrices, int(np.floor(samples))) < 1
            assert delayed_radius(*matrices, int(np.ceil(samples))) > 1
    assert np.all((margin > 1) & (margin < 5))
    # What the default was chosen for, beside its nearness to print.
    assert np.all(delay_margin(benchmark, LQG.design(benchmark), plants) > 1.5 * margin)


def test_without_feedback_of_the_error_no_delay_is_too_long(benchmark):
    """The frame carries a small share of the storey's stiffness: the force alone cannot tip it."""
    for controller in (
        Passthrough(q=3e-5).prepare(benchmark),
        ADFC().frozen(benchmark, inverse(benchmark)),
    ):
        assert delay_margin(benchmark, controller, nominal_plant()) == [np.inf]
        A, B, C = (m[0] for m in linear_loop(benchmark, controller, nominal_plant(), opened=True))
        assert all(delayed_radius(A, B, C, d) < 1 for d in (0, 1, 7, 40))


def test_the_response_of_a_chain_of_past_samples():
    """n samples of delay are z^-n, though all n poles share one eigenvector; and a full system."""
    z = np.exp(1j * np.array([0.01, 0.7, 3.0]))
    chain = np.eye(5, k=-1)
    found = response(chain, np.eye(5, 1), np.eye(1, 5, k=4), z)
    np.testing.assert_allclose(found[:, 0, 0], z**-5.0, rtol=1e-12)
    rng = np.random.default_rng(3)
    A, B, C = (rng.standard_normal(shape) for shape in ((6, 6), (6, 2), (3, 6)))
    direct = [C @ np.linalg.solve(x * np.eye(6) - A, B) for x in z]
    np.testing.assert_allclose(response(A, B, C, z), direct, rtol=1e-10)


def test_a_controller_with_a_memory_has_a_margin(benchmark):
    """Its past samples make the open loop defective, which eigenvectors cannot be inverted for."""
    sound = Sound(0.3).prepare(benchmark)
    samples = delay_margin(benchmark, sound, nominal_plant())[0] * 1.024
    matrices = [m[0] for m in linear_loop(benchmark, sound, nominal_plant(), opened=True)]
    assert 50 < samples < 200
    assert delayed_radius(*matrices, int(np.floor(samples))) < 1
    assert delayed_radius(*matrices, int(np.ceil(samples))) > 1


def delayed_radius(A, B, C, samples: int) -> float:
    """Spectral radius of the loop closed through a chain of whole samples of delay."""
    A, B, C = map(np.asarray, (A, B, C))
    n = len(A)
    if samples == 0:
        return np.abs(np.linalg.eigvals(A + B @ C)).max()
    chain = np.zeros((n + 2 * samples,) * 2)
    chain[:n, :n], chain[:n, -2:], chain[n : n + 2, :n] = A, B, C
    chain[n + 2 :, n:-2] = np.eye(2 * samples - 2)
    return np.abs(np.linalg.eigvals(chain)).max()


def test_an_adaptive_controller_has_to_be_frozen_first(benchmark):
    with pytest.raises(InputError, match=r"linear and time-invariant.*frozen"):
        spectral_radius(benchmark, ADFC(), nominal_plant())
