"""Adaptive time series by recursive least squares, taught only by samples that can be trusted.

    u(k) = a_0 x_a(k) + a_1 x_a'(k) + a_2 x_a''(k)
    g = P phi / (mu + phi' P phi),  a += g (F[u](k-1) - phi' a),  P = (P - g phi' P) / mu
    phi = (F[x_m], F[x_m]', F[x_m]'')(k)

one fit an actuator.  A sample counts where |F[x_m](k)| exceeds a threshold and the new coefficients
stay within their bounds; otherwise a and P both stay.  Palacio-Betancur & Gutierrez Soto (2019)
make the adaptive time series conditional in this way; their paper was not at hand, so the condition
and the numbers are those of the design notes.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.guards import Bounds, MotionThreshold, RateLimit
from martths_jax.control.adaptive.lowpass import butterworth
from martths_jax.control.adaptive.recursive import Recursive
from martths_jax.control.adaptive.taps import TapMap
from martths_jax.control.controllers.ats import (
    COLUMN_S,
    DELAY_S,
    ORDER,
    PRESETS,
    REGRESSOR,
    check_cutoff,
    start_from,
)
from martths_jax.control.controllers.feedforward import AdaptiveFeedforward
from martths_jax.control.entry import Entry, Parameter

#: Standard deviations of a_0 [-], a_1 [s], a_2 [s^2] at first, and of the fit's error [mm].
SPREAD, ERROR_MM = (0.05, 2e-3, 2e-5), 0.01
#: Memory of 1 / (1 - mu) samples is 2 s at 1024 Hz.
FORGETTING = 0.9995
#: Three standard deviations of the benchmark's sensor noise after a low-pass of 20 Hz [mm].
THRESHOLD_MM = 7.5e-3


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class RecursiveATS(AdaptiveFeedforward):
    """Pieces of ``AdaptiveFeedforward`` as the recursive time series takes them; see ``design``.

    Its regressors are x, s x', s^2 x'' with s = 0.02 s, equally large for a motion near 2 Hz, so
    that a limit of the trace of P limits the spread of all three coefficients.
    """

    name = "ats-rls"
    actuators_needed = 2
    first_lag_range = 1

    @classmethod
    def design(
        cls,
        benchmark,
        *,
        forgetting: float = FORGETTING,
        threshold: float = THRESHOLD_MM,
        spread: float = 1.0,
        cutoff: float = 20.0,
        delay: tuple[float, float] = DELAY_S,
        q: float = 3e-5,
    ) -> RecursiveATS:
        """The controller.

        The bounds and the largest change a second are ``ats.PRESETS["chae2013"]``; the trace of P
        never exceeds that of P_0, as it would grow without end where mu < 1 and a sine of one
        frequency says nothing of the third coefficient.

        Args:
            benchmark: gives the sampling rate, the nominal plant and the sensor noise.
            forgetting: mu a sample.
            threshold: no correction while |F[x_m](k)| is smaller [mm].
            spread: factor of the standard deviations (0.05, 2e-3 s, 2e-5 s^2) in P_0.
            cutoff: of the low-pass on both sides, Butterworth of order 6 [Hz].
            delay: of the two actuators, from which the coefficients (1, delay, delay^2 / 2) start
                [s].
            q: process noise of the Kalman filter that the force is made from [mm^2].

        Raises:
            InputError: a cutoff at or beyond half the sampling rate, or no two delays.
        """
        check_cutoff(benchmark.fs, cutoff)
        column = COLUMN_S * benchmark.fs  # of dt x', in the regressor's columns
        start = start_from(benchmark.fs, delay) / column ** jnp.arange(ORDER + 1.0)[:, None]
        seconds = COLUMN_S ** np.arange(ORDER + 1.0)  # a_j -> its coefficient
        prior = (jnp.asarray(spread) * np.array(SPREAD) / seconds / ERROR_MM) ** 2
        published = PRESETS["chae2013"]
        low, high, rate = (np.array(published[n]) / seconds for n in ("low", "high", "rate"))
        return cls(
            regressor=columns(column),
            fit=Recursive(prior, forgetting, most=jnp.sum(prior)),
            guards=(
                MotionThreshold(threshold),
                Bounds(low, high, refuse=True),
                RateLimit(rate / benchmark.fs),
            ),
            start=start,
            joint=False,
            learns_from="measurement",
            low_pass=butterworth(published["poles"], cutoff, benchmark.fs),
            q=q,
        )


def columns(column: float) -> TapMap:
    """The time series' regressors x, s x', s^2 x'', s = `column` samples."""
    rows = REGRESSOR.matrix * column ** np.arange(ORDER + 1.0)[:, None]
    return TapMap(tuple(map(tuple, rows.tolist())))


ENTRY = Entry(
    name="ats-rls",
    controller=RecursiveATS,
    make=RecursiveATS.design,
    label="ATS-RLS",
    paper="after Palacio-Betancur & Gutierrez Soto 2019, conditional adaptive time series",
    parameters=(
        Parameter("forgetting", "mu", "forgetting factor a sample", FORGETTING, "1", 0.9, 1.0,
                  above=True),
        Parameter("threshold", "x_min", "stroke below which it holds", THRESHOLD_MM, "mm", 0.0),
        Parameter("spread", "", "factor of the coefficients' first spread", 1.0, "1", 0.0,
                  above=True, kind="tunable"),
        Parameter("cutoff", "f_c", "cutoff of the low-pass", 20.0, "Hz", 0.0, above=True,
                  kind="static"),
        Parameter("delay", "a_1", "delays that it starts from", DELAY_S, "s", 0.0, 0.08, size=2),
        Parameter("q", "q", "process noise", 3e-5, "mm^2", 0.0, above=True),
    ),
)  # fmt: skip
