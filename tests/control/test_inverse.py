"""Inverse compensation: it undoes the actuator that it is the inverse of."""

import numpy as np
import pytest

from martths_jax import InputError, nominal_plant, simulate
from martths_jax.control.controllers import Inverse
from martths_jax.stability import spectral_radius
from tests.control.driven import driven, strokes, tracking
from tests.engine.motions import burst


def test_the_actuator_of_the_paper_reaches_the_target(benchmark):
    """x(k) = x(k-1) + (u(k) / g - x(k-1)) / alpha on its commands gives x_a back."""
    x_a, alphas = strokes(), ((30.0,) * 3, (1.0, 20.0, 50.0))
    delays = (np.array(alphas[1]) - 1) / benchmark.fs
    own = Inverse(0.9, 1.1, 29 / benchmark.fs, delays).prepare(benchmark)
    u, _ = driven(own, benchmark, x_a)
    x, gains = np.zeros((2, 3)), np.array([[0.9], [1.1]])
    for command, target in zip(u, x_a, strict=True):
        x = x + (command / gains - x) / np.array(alphas)
        np.testing.assert_allclose(x, target, rtol=0, atol=1e-11)


def test_commands_are_the_papers_equation(benchmark):
    x_a = strokes()
    u, _ = driven(Inverse().prepare(benchmark), benchmark, x_a)
    alpha = np.array([[49.0], [27.0]])
    expected = alpha * x_a[1:] - (alpha - 1) * x_a[:-1]
    np.testing.assert_allclose(u[1:], expected, rtol=0, atol=1e-11)


def test_the_loop_of_the_nominal_plant_is_stable(benchmark):
    assert spectral_radius(benchmark, Inverse().prepare(benchmark), nominal_plant())[0] < 1


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"delay_1": -0.001}, r"`delay_1` must be a number from 0 to 0.2 \(s\)"),
        ({"gain_2": np.array([1.0, 0.0])}, "`gain_2` must be a number above 0"),
        ({"q": 0.0}, r"`q` must be a number above 0 \(mm\^2\)"),
    ],
)
def test_what_cannot_be_used_is_refused(benchmark, given, message):
    with pytest.raises(InputError, match=message):
        simulate(benchmark, Inverse(**given), nominal_plant(), burst(0.3))


@pytest.mark.slow
def test_it_tracks_better_than_no_compensation(benchmark):
    none, own = tracking(benchmark, Inverse())
    assert np.all(own < none / 4)
