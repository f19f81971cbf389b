"""An adaptive discrete model in series with something that does most of the work.

    r(k) = theta_0 x(k) + theta_1 s D x(k) + theta_2 s^2 D^2 x(k)

D is the backward difference over dt, s = 0.02 s: three taps written as columns that are equally
large for a motion near 2 Hz, as neighbouring samples are almost collinear.  theta walks at random
and is tracked by a Kalman filter, one an actuator,

    F[r](k-1) = theta' (F[y], s D F[y], s^2 D^2 F[y])(k) + error,

from the strokes y that r has caused; F is a Butterworth low-pass of order 6 on both sides.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.arguments import complaint
from martths_jax.control.adaptive.base import ACTUATORS
from martths_jax.control.adaptive.differences import BackwardDifferences
from martths_jax.control.adaptive.guards import MotionThreshold
from martths_jax.control.adaptive.lowpass import butterworth
from martths_jax.control.adaptive.recursive import RandomWalk
from martths_jax.control.adaptive.taps import TapMap
from martths_jax.control.controllers.ats import COLUMN_S
from martths_jax.control.controllers.feedforward import AdaptiveFeedforward
from martths_jax.control.entry import Parameter

#: Highest difference, and poles of the low-pass.
ORDER, POLES = 2, 6
#: Fields of a controller with such a model, all of which but the last may be one a trial; see
#: ``discrete_model``.
FIELDS = ("spread", "walk", "error", "threshold", "cutoff")
SPREAD, WALK, ERROR_MM, THRESHOLD_MM, CUTOFF_HZ = 0.3, 1e-3, 0.03, 0.02, 20.0
PARAMETERS = (
    Parameter("spread", "", "spread of theta at first", SPREAD, "1", 0.0, above=True,
              kind="tunable"),
    Parameter("walk", "", "random walk of theta", WALK, "1/sqrt(s)", 0.0, above=True,
              kind="tunable"),
    Parameter("error", "", "error of the discrete model", ERROR_MM, "mm", 0.0, above=True,
              kind="tunable"),
    Parameter("threshold", "x_min", "stroke below which it holds", THRESHOLD_MM, "mm", 0.0),
    Parameter("cutoff", "f_c", "cutoff of the low-pass", CUTOFF_HZ, "Hz", 0.0, above=True,
              kind="static"),
)  # fmt: skip


def discrete_model(controller, benchmark, start: jax.Array) -> AdaptiveFeedforward:
    """The model as a feedforward, prepared, of which a command is r.

    Args:
        controller: prepared but for this, with its estimator and the fields `spread`, standard
            deviation of each theta at first [-]; `walk`, by which each walks, a root second
            [1/sqrt(s)]; `error`, standard deviation of what the model does not say of r [mm];
            `threshold`, no correction while |F[y](k)| is smaller [mm]; `cutoff` of F [Hz].
        benchmark: gives the sampling rate.
        start: (3, 2) theta at first.
    """
    fs = benchmark.fs
    spread, walk, error, threshold = (jnp.asarray(getattr(controller, n)) for n in FIELDS[:-1])
    return AdaptiveFeedforward(
        regressor=columns(fs),
        fit=RandomWalk(_diagonals(spread**2), _diagonals(walk**2 / fs), error**2),
        guards=(MotionThreshold(threshold),),
        start=start,
        joint=False,
        learns_from="measurement",
        low_pass=butterworth(POLES, controller.cutoff, fs),
        estimator=controller.estimator,
    ).prepare(benchmark)


def check_low_pass(controller, benchmark) -> list[str]:
    """A sentence about a cutoff that the sampling rate cannot hold."""
    wanted = f"lie below {benchmark.fs / 2:g} Hz, half the sampling rate"
    good = controller.cutoff < benchmark.fs / 2
    return complaint(good, "cutoff", wanted, f"{controller.cutoff:g}")


def columns(fs: float) -> TapMap:
    """x, s D x, s^2 D^2 x of a stroke, s = 0.02 s."""
    scale = (COLUMN_S * fs) ** np.arange(ORDER + 1.0)
    rows = BackwardDifferences(order=ORDER, accuracy=1).matrix * scale[:, None]
    return TapMap(tuple(map(tuple, rows.tolist())))


def _diagonals(value: jax.Array) -> jax.Array:
    """(2, n, n) or (2, n, n, T): for each actuator the same number on a diagonal."""
    n = ORDER + 1
    one = jnp.eye(n).reshape(n, n, *(1,) * value.ndim) * value
    return jnp.broadcast_to(one, (ACTUATORS, *one.shape))
