"""The uniaxial benchmark's plant against its printed numbers, SciPy and block algebra."""

import numpy as np
import pytest
from scipy import signal

from martths_jax.problem.uniaxial.plant import PUBLISHED, Loop, plant_model, uncertainty
from martths_jax.rig.plants import draw, nominal
from martths_jax.structure.modal import to_dense

FS = 4096
HZ = 2 * np.pi


def blocks(values, s):
    """G(s) of the stroke, block by block as the loop is drawn."""
    a3, b1, b2, k = values
    specimen = 1 / (29.1 * s**2 + 114.6 * s + k)
    valve, actuator = 2.13e13 / (s**2 + b1 * s + b2), 1 / (s + a3)
    inner = actuator * specimen / (1 + 4.23e6 * s * actuator * specimen)
    return valve * inner / (1 + valve * inner)


def printed(values):
    """Numerator and denominator as the benchmark prints its coefficients."""
    a3, b1, b2, k = values
    m, c, a2, a1b0 = 29.1, 114.6, 4.23e6, 2.13e13
    A = [
        m,
        c + m * a3 + m * b1,
        (k + c * a3 + a2) + (c + m * a3) * b1 + m * b2,
        k * a3 + (k + c * a3 + a2) * b1 + (c + m * a3) * b2,
        k * a3 * b1 + (k + c * a3 + a2) * b2,
        k * a3 * b2 + a1b0,
    ]
    return [a1b0], A, np.array([m, c, k]) * a1b0 / 1e3


def test_poles_gains_and_delays_are_those_of_the_benchmark():
    plant = nominal(plant_model())
    A = plant.continuous()[0]
    poles = np.linalg.eigvals(A) / HZ
    for expected in (-7.68, -29.3 + 36.6j, -1.28 + 67.2j):
        distance = np.abs(poles.real - np.real(expected)) + np.abs(poles.imag - np.imag(expected))
        assert np.min(distance) < 0.06
    f = np.array([1.0, 10.0])
    H = np.asarray(plant.frequency_response(f))[:, 0, 0, 0]
    np.testing.assert_allclose(-np.angle(H) / (HZ * f) * 1e3, [24.9, 19.0], atol=0.06)
    assert round(abs(H[1]), 2) == 0.62
    static = np.asarray(plant.frequency_response([0.0]))[0, :, 0, 0].real
    assert round(float(static[0]), 2) == 0.98
    # At rest the specimen's spring alone carries the force.
    np.testing.assert_allclose(static[1], static[0] * 1.19e6 / 1e3, rtol=1e-12)


def test_response_is_that_of_the_drawn_blocks():
    plants, f = draw(plant_model(), 6, 2), np.array([0.3, 2.0, 30.0, 400.0])
    s = 2j * np.pi * f
    H = np.asarray(plants.frequency_response(f))
    for t, values in enumerate(np.asarray(plants.values)):
        stroke = blocks(values, s)
        np.testing.assert_allclose(H[:, 0, 0, t], stroke, rtol=1e-11)
        force = (29.1 * s**2 + 114.6 * s + values[3]) * stroke / 1e3
        np.testing.assert_allclose(H[:, 1, 0, t], force, rtol=1e-11)


@pytest.mark.parametrize("trial", [0, 1, 2])
def test_discrete_plant_is_the_zero_order_hold_of_the_printed_coefficients(trial):
    plants = nominal(plant_model()) if trial == 0 else draw(plant_model(), 1, 5, first=trial)
    A, B, C, _ = to_dense(plants.discretise(1 / FS))
    numerator, denominator, force = printed(np.asarray(plants.values)[0])
    system = signal.tf2ss([[0.0, 0.0, *numerator], force], denominator)
    theirs = signal.cont2discrete(system, 1 / FS)
    # Responses to an impulse: states may be others.
    x, z = B[:, 0], theirs[1][:, 0]
    ours, expected = [], []
    for _ in range(400):
        ours.append(C @ x)
        expected.append(theirs[2] @ z)
        x, z = A @ x, theirs[0] @ z
    scale = np.max(np.abs(expected), axis=0)
    np.testing.assert_allclose(ours / scale, expected / scale, atol=1e-10)


def test_uncertain_are_four_by_the_benchmarks_standard_deviations():
    values = np.asarray(draw(plant_model(), 3000, 1).values)
    np.testing.assert_allclose(np.std(values, axis=0), [1.3, 3.3, 3.31e3, 5e4], rtol=0.05)
    assert uncertainty(PUBLISHED).names == ("a3", "b1", "b2", "k_e")


def test_a_loop_of_ones_own():
    heavier = nominal(plant_model(Loop(mass=40.0)))
    H = np.asarray(heavier.frequency_response([5.0]))[0, :, 0, 0]
    s = 10j * np.pi
    np.testing.assert_allclose(H[1], H[0] * (40 * s**2 + 114.6 * s + 1.19e6) / 1e3, rtol=1e-12)
    assert plant_model(Loop()) == plant_model()  # JAX knows it again
