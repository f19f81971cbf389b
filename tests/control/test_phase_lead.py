"""The discrete lead against SciPy's bilinear transform, its phase, and what it tracks."""

import numpy as np
import pytest
from scipy import signal

from martths_jax import InputError, nominal_plant, simulate
from martths_jax.control.controllers import PhaseLead
from martths_jax.stability import spectral_radius
from tests.control.driven import driven, strokes, tracking
from tests.engine.motions import burst


def transfer(gain, tau, lag, fs):
    return signal.bilinear([gain * (tau + lag), gain], [lag, 1.0], fs)


def test_it_is_the_bilinear_transform_of_a_lead(benchmark):
    x_a, taus = strokes(), (0.01, 0.02, 0.05)
    own = PhaseLead(0.9, 1.1, 0.04, np.array(taus), 0.004).prepare(benchmark)
    u, _ = driven(own, benchmark, x_a)
    for trial, tau in enumerate(taus):
        for i, (gain, lead) in enumerate(((0.9, 0.04), (1.1, tau))):
            expected = signal.lfilter(*transfer(gain, lead, 0.004, 1024.0), x_a[:, i, trial])
            np.testing.assert_allclose(u[:, i, trial], expected, rtol=0, atol=1e-11)


def test_slow_motion_is_led_by_tau_and_scaled_by_the_gain(benchmark):
    """A ramp of slope 1 comes out as g (t + tau), once the pole of 1 ms has died away."""
    t = np.arange(600) / benchmark.fs
    ramp = np.broadcast_to(t[:, None, None], (600, 2, 1))
    u, _ = driven(PhaseLead().prepare(benchmark), benchmark, ramp)
    expected = np.array([0.872, 1.054]) * (t[:, None] + [0.0537, 0.0219])
    np.testing.assert_allclose(u[300:, :, 0], expected[300:], rtol=1e-12)


def test_the_loop_of_the_nominal_plant_is_stable(benchmark):
    assert spectral_radius(benchmark, PhaseLead().prepare(benchmark), nominal_plant())[0] < 1


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"lag": 0.0004}, r"`lag` must be at least half a sample \(0.00048828"),
        ({"gain_2": 0.0}, "`gain_2` must be a number above 0"),
        ({"tau_1": -0.01}, r"`tau_1` must be a number from 0 to 0.2 \(s\)"),
    ],
)
def test_what_cannot_be_used_is_refused(benchmark, given, message):
    with pytest.raises(InputError, match=message):
        simulate(benchmark, PhaseLead(**given), nominal_plant(), burst(0.3))


@pytest.mark.slow
def test_it_tracks_better_than_no_compensation(benchmark):
    none, own = tracking(benchmark, PhaseLead())
    assert np.all(own < none / 4)
