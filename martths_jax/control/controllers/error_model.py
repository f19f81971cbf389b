"""Nominal inverse plus an error model that a Kalman filter identifies on line.

    u(k) = (C_0 + C_e(k))' phi(x_a(k))

C_0 is the inverse of the nominal plant over a band, C_e what the plant differs from it by.  Since
F[u - C_0' phi] = C_e' F[phi], a filter of C_e that starts at zero is the filter of C = C_0 + C_e
that starts at C_0, which is what runs here: coefficients on a random walk,

    g = P phi / (R + phi' P phi),  C += g (F[u](k-1) - C' phi(k))',  P = P - g phi' P + Q

with phi value and derivatives of F[x_m], both strokes; F is a low-pass on both sides.  It does not
learn from the Kalman filter's strokes, which lean towards the nominal plant and so does a fit to
them.  Neither a start nor a wait is needed.
After the family of compensators with a nominal and an identified error model whose abstracts were
at hand; equations and start values are those of the design notes.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.differences import BackwardDifferences
from martths_jax.control.adaptive.guards import MotionThreshold
from martths_jax.control.adaptive.inverse import nominal_inverse
from martths_jax.control.adaptive.lowpass import butterworth
from martths_jax.control.adaptive.recursive import RandomWalk
from martths_jax.control.controllers.ats import check_cutoff
from martths_jax.control.controllers.feedforward import AdaptiveFeedforward
from martths_jax.control.entry import Entry, Parameter
from martths_jax.errors import argument_error

#: Third derivatives make the loop unstable by themselves (design notes), second ones do not.
ORDERS = (1, 2)
#: Where the structure moves: commands are taken as evenly strong up to here [Hz].
BAND_HZ = 3.0
#: Poles of the low-pass.
POLES = 6


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class ErrorModel(AdaptiveFeedforward):
    """Pieces of ``AdaptiveFeedforward`` as the error model takes them; see ``design``."""

    name = "error-model"

    @classmethod
    def design(
        cls,
        benchmark,
        *,
        order: int = 2,
        band: float = BAND_HZ,
        spread: float = 0.1,
        walk: float = 3e-4,
        error: float = 0.03,
        threshold: float = 0.02,
        cutoff: float = 20.0,
        q: float = 3e-5,
    ) -> ErrorModel:
        """The controller around the benchmark's own inverse.

        P_0 = diag (spread c_j)^2 and Q = diag (walk c_j)^2 dt, c_j the root mean square over the
        two commands of row j of C_0, so that both share one P.

        Args:
            benchmark: gives the sampling rate, the nominal plant and the sensor noise.
            order: highest derivative, 1 or 2.
            band: of the nominal inverse [Hz].
            spread: standard deviation of the coefficients at first, relative to the nominal ones.
            walk: by which they walk, relative and a root second [1/sqrt(s)].
            error: standard deviation of what the model does not say of a command, root of R [mm].
            threshold: no correction while both |F[x_m](k)| are smaller [mm].
            cutoff: of the low-pass on both sides, Butterworth of order 6 [Hz].
            q: process noise of the Kalman filter that the force is made from [mm^2].

        Raises:
            InputError: an order that is neither, or a band or cutoff at or beyond half the
                sampling rate.
        """
        if order not in ORDERS:
            raise argument_error("order", f"be one of {ORDERS}", order)
        fs = benchmark.fs
        check_cutoff(fs, cutoff)
        if not 0 < band < fs / 2:
            wanted = f"lie between 0 and {fs / 2:g} Hz, half the sampling rate"
            raise argument_error("band", wanted, f"{band:g}")
        regressor = BackwardDifferences(order=order, accuracy=2)
        C_0 = nominal_inverse(benchmark.plant_model, fs, regressor.matrix, band_hz=band)
        size = np.sqrt(np.mean(C_0**2, axis=1))
        return cls(
            regressor=regressor,
            fit=RandomWalk(
                prior=(jnp.asarray(spread) * size) ** 2,
                walk=(jnp.asarray(walk) * size) ** 2 / fs,
                r=jnp.asarray(error) ** 2,
            ),
            guards=(MotionThreshold(threshold),),
            start=C_0,
            joint=True,
            learns_from="measurement",
            low_pass=butterworth(POLES, cutoff, fs),
            q=q,
        )


ENTRY = Entry(
    name="error-model",
    controller=ErrorModel,
    make=ErrorModel.design,
    label="error model",
    paper="nominal inverse and an error model by a Kalman filter, after Ning et al.",
    parameters=(
        Parameter("order", "m", "highest derivative", 2, "1", 1, 2, whole=True, kind="static"),
        Parameter("band", "f_b", "band of the nominal inverse", BAND_HZ, "Hz", 0.0, above=True,
                  kind="static"),
        Parameter("spread", "", "relative spread of the coefficients at first", 0.1, "1", 0.0,
                  above=True, kind="tunable"),
        Parameter("walk", "", "relative random walk of the coefficients", 3e-4, "1/sqrt(s)", 0.0,
                  above=True, kind="tunable"),
        Parameter("error", "", "error of the model of a command", 0.03, "mm", 0.0, above=True,
                  kind="tunable"),
        Parameter("threshold", "x_min", "stroke below which it holds", 0.02, "mm", 0.0),
        Parameter("cutoff", "f_c", "cutoff of the low-pass", 20.0, "Hz", 0.0, above=True,
                  kind="static"),
        Parameter("q", "q", "process noise", 3e-5, "mm^2", 0.0, above=True),
    ),
)  # fmt: skip
