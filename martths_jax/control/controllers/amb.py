"""Adaptive model-based compensation (after Galmez & Fermandois 2022): a normalised gradient.

    u(k) = a_0 x_a(k) + a_1 x_a'(k) + ... + a_m x_a^(m)(k)
    a   += dt Gamma phi e / (1 + phi' phi),   e = F[u](k-1) - phi' a,   a_j >= 0
    phi  = (F[x_m], s F[x_m]', s^2 F[x_m]'', ...)(k),   s = 0.02 s

one set an actuator, with first-order backward differences and F a Butterworth low-pass of fourth
order.  They take order 3, signals in metres and one gain a coefficient, found by a particle swarm
for a rig of one axis; here columns are scaled to be equally large for a motion near 2 Hz, so that
one gain serves all, signals are in millimetres, and the order is 2: third derivatives make this
hybrid loop unstable by themselves.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.differences import BackwardDifferences
from martths_jax.control.adaptive.gradient import NormalisedGradient
from martths_jax.control.adaptive.guards import Bounds
from martths_jax.control.adaptive.lowpass import butterworth
from martths_jax.control.adaptive.taps import TapMap
from martths_jax.control.controllers.ats import COLUMN_S, DELAY_S, check_cutoff, start_from
from martths_jax.control.controllers.feedforward import AdaptiveFeedforward
from martths_jax.control.entry import Entry, Parameter

#: Highest derivative, by first-order differences.
ORDER = 2
#: Gamma of all coefficients in scaled columns [1/s].  On 64 drawn plants a tenth of it is too slow
#: for the built-in motion, and twice as much tracks hardly better; 2 / dt would be unstable.
RATE = 100.0
#: Poles of the low-pass.
POLES = 4


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class AMB(AdaptiveFeedforward):
    """Pieces of ``AdaptiveFeedforward`` as the adaptive model-based one takes them; see ``design``.

    Its coefficients are those of x, s x', s^2 x'' with s = 0.02 s.
    """

    actuators_needed = 2
    name = "amb"
    first_lag_range = 1

    @classmethod
    def design(
        cls,
        benchmark,
        *,
        rate: float = RATE,
        cutoff: float = 20.0,
        delay: tuple[float, float] = DELAY_S,
        q: float = 3e-5,
    ) -> AMB:
        """The controller.

        The published start is the inverse of the loading system's model; here it is that of a
        delay, (1, delay, delay^2 / 2), as the adaptive time series has it.

        Args:
            benchmark: gives the sampling rate, the nominal plant and the sensor noise.
            rate: Gamma in scaled columns [1/s].
            cutoff: of the low-pass on both sides [Hz].
            delay: of the two actuators, which the coefficients start from [s].
            q: process noise of the Kalman filter that the force is made from [mm^2].

        Raises:
            InputError: a cutoff at or beyond half the sampling rate, or no two delays.
        """
        fs = benchmark.fs
        check_cutoff(fs, cutoff)
        scale = (COLUMN_S * fs) ** np.arange(ORDER + 1.0)  # of dt^j x^(j), in the columns
        rows = BackwardDifferences(order=ORDER, accuracy=1).matrix * scale[:, None]
        return cls(
            regressor=TapMap(tuple(map(tuple, rows.tolist()))),
            fit=NormalisedGradient(rate),
            guards=(Bounds(low=0.0),),
            start=start_from(fs, delay) / jnp.asarray(scale)[:, None],
            joint=False,
            learns_from="measurement",
            low_pass=butterworth(POLES, cutoff, fs),
            q=q,
        )


ENTRY = Entry(
    name="amb",
    controller=AMB,
    make=AMB.design,
    label="AMB",
    paper="after Galmez & Fermandois 2022, adaptive model-based compensation",
    parameters=(
        Parameter("rate", "Gamma", "gain of the adaptation", RATE, "1/s", 0.0, above=True,
                  kind="tunable"),
        Parameter("cutoff", "f_c", "cutoff of the low-pass", 20.0, "Hz", 0.0, above=True,
                  kind="static"),
        Parameter("delay", "a_1", "delays that it starts from", DELAY_S, "s", 0.0, 0.08, size=2),
        Parameter("q", "q", "process noise", 3e-5, "mm^2", 0.0, above=True),
    ),
)  # fmt: skip
