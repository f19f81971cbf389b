"""Model-based feedforward: the nominal plant's inverse in derivatives of both target strokes.

    u(k) = sum_{j = 0..m} A_j D^j x_a(k)

with D^j backward differences of second order and A_j (2, 2) [s^j], after Carrion & Spencer (2007)
and Phillips & Spencer.  They wrote the inverse as a transfer function with poles moved out; here,
as in later work, it is a polynomial in the derivatives, and A_j are fitted to the inverse of the
2x2 plant over a band, so that they hold both actuators and what they do to each other.  Nothing
adapts.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.arguments import check_positive, complaint
from martths_jax.control.adaptive.differences import BackwardDifferences
from martths_jax.control.adaptive.inverse import nominal_inverse
from martths_jax.control.base import Controller
from martths_jax.control.controllers.frozen import FrozenFeedforward
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.estimators import design_kalman
from martths_jax.errors import as_numbers

ORDERS = (1, 2, 3)
#: The strokes of this structure move at 1.9 to 2.3 Hz; what a wider band gains above it loses there
#: [Hz].
BAND_HZ = 3.0


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class MFF(Controller):
    """The equation above, A_j from ``nominal_inverse``.

    Attributes:
        order: m, 1 to 3.
        band_hz: A_j minimise the mean square of u(k-1) - sum A_j D^j x(k) for commands that are
            evenly strong up to here, one value or one a trial (T,) [Hz].
        q: process noise of the Kalman filter [mm^2].
        coefficients: (2 m + 2, 2) or (2 m + 2, 2, T), made by ``prepare``: of x_a,1 and its scaled
            derivatives dt^j x^(j), then of x_a,2 and its own; column i is that of command i.
        estimator: the Kalman filter, designed by ``prepare``; the feedforward does not use it.

    The fit counts on white noise of 1e-9 of the commands' power.  Without it A_3 of a narrow band
    is so large that the hybrid loop is unstable.
    """

    order: int = field(default=1, metadata={"static": True})
    band_hz: jax.Array | float = BAND_HZ
    q: jax.Array | float = 3e-5
    coefficients: jax.Array | None = None
    estimator: Any = None

    name = "mff"
    shared_axes = MappingProxyType({"band_hz": 0, "q": 0, "coefficients": 2})

    @property
    def regressor(self) -> BackwardDifferences:
        """Value and derivatives of a stroke."""
        return BackwardDifferences(self.order, 2)

    @property
    def feedforward(self) -> FrozenFeedforward:
        """The same once it is prepared, as a feedforward with coefficients that stay."""
        return FrozenFeedforward(self.coefficients, self.estimator, self.regressor)

    def problems(self, benchmark):
        return [
            *complaint(self.order in ORDERS, "order", f"be one of {ORDERS}", self.order),
            *check_band("band_hz", self.band_hz, benchmark),
            *check_positive("q", self.q),
        ]

    def prepare(self, benchmark):
        fit = lambda band: nominal_inverse(  # noqa: E731
            benchmark.plant_model, benchmark.fs, self.regressor.matrix, band_hz=float(band)
        )
        bands = np.asarray(self.band_hz, dtype=float)
        coefficients = np.stack([fit(b) for b in bands], axis=-1) if bands.ndim else fit(bands)
        return replace(
            self,
            # Now in the coefficients: designs of different bands share a program.
            band_hz=jnp.asarray(bands),
            coefficients=jnp.asarray(coefficients),
            estimator=design_kalman(benchmark.plant_model, self.q, benchmark.r_mm2),
        )

    def init(self, trials):
        return self.feedforward.init(trials)

    def step(self, state, seen):
        return self.feedforward.step(state, seen)


def check_band(name: str, value, benchmark) -> list[str]:
    """A sentence about a band of a fit that is not between zero and half the sampling rate."""
    if any(isinstance(x, jax.core.Tracer) for x in jax.tree.leaves(value)):
        return complaint(False, name, "be known before the run", "a traced value")
    highest = np.inf if benchmark is None else benchmark.fs / 2
    number = as_numbers(value)
    good = np.isfinite(number) & (number > 0) & (number < highest) & (number.ndim < 2)
    wanted = f"lie above 0 and below half the sampling rate, {highest:g} Hz"
    return complaint(good, name, wanted, f"{value!r:.80}")


#: Parameters of what the feedforward is fitted to, and of the filter.
FIT = (
    Parameter("order", "m", "highest derivative", 1, "1", 1, 3, whole=True, kind="static"),
    Parameter("band_hz", "f_b", "band of the fit", BAND_HZ, "Hz", 0.0, above=True),
)
PROCESS_NOISE = Parameter("q", "q", "process noise", 3e-5, "mm^2", 0.0, above=True, kind="tunable")

ENTRY = Entry(
    name="mff",
    controller=MFF,
    label="MFF",
    paper="Carrion & Spencer 2007; Phillips & Spencer 2013, model-based feedforward",
    parameters=(
        *FIT,
        PROCESS_NOISE,
    ),
)
