"""Conditional adaptive time series with a PID controller inside (Aguila et al. 2024).

    e(k) = r(k) - x(k)
    u(k) = r(k) + k_p e(k) + k_i dt sum_{j <= k} e(j) + k_d d(k)
    d(k) = (e(k) - y(k-1)) w / (1 + w dt),   y(k) = y(k-1) + dt d(k),   w = 2 pi f_d

an actuator, r from the time series and d the derivative of e behind a low-pass of first order.
Aguila et al. (2024), Frontiers in Built Environment 10:1384235, put a conditional adaptive time
series around a PID controller on this benchmark; only their abstract was at hand, so that which
loop is inside, and the gains, are choices made here.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.arguments import check_positive, complaint
from martths_jax.control.controllers.ats_rls import RecursiveATS
from martths_jax.control.controllers.cascade import Cascade, outer_parameters
from martths_jax.control.entry import Entry, Parameter
from martths_jax.structure.modal import trailing

#: Strokes that the error can be taken of.
ERRORS = ("measured", "estimate")
#: Where the time series settles on the nominal plant with the gains below: delays [s].
DELAY_S = (0.014, 0.006)
#: Gains k_p [-] and k_i [1/s].  Four times k_p loses plants; more k_i takes away at 2 Hz what it
#: gives below.
K_P, K_I = 2.0, 5.0


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class CATSPID(Cascade):
    """The equations above; see ``design``.

    Attributes:
        outer: the time series.
        k_p [-], k_i [1/s], k_d [s]: gains.
        corner: f_d [Hz].
        error: what x is: the ``measured`` strokes x_m, or the filter's ``estimate`` x_hat of them.
    """

    k_p: jax.Array | float = K_P
    k_i: jax.Array | float = K_I
    k_d: jax.Array | float = 0.0
    corner: jax.Array | float = 20.0
    error: str = field(default="measured", metadata={"static": True})

    actuators_needed = 2
    name = "cats-pid"
    shared_axes = MappingProxyType({"k_p": 0, "k_i": 0, "k_d": 0, "corner": 0})

    @classmethod
    def design(
        cls,
        benchmark,
        *,
        k_p: float = K_P,
        k_i: float = K_I,
        k_d: float = 0.0,
        corner: float = 20.0,
        error: str = "measured",
        delay: tuple[float, float] = DELAY_S,
        **outer,
    ) -> CATSPID:
        """The controller.

        Args:
            benchmark: gives the sampling rate, the nominal plant and the sensor noise.
            k_p [-], k_i [1/s], k_d [s], corner [Hz], error: see the attributes.
            delay: of the inner loop, from which the time series starts [s].
            outer: further settings of ``RecursiveATS.design``.

        Raises:
            InputError: as that.
        """
        series = RecursiveATS.design(benchmark, delay=delay, **outer)
        numbers = (jnp.asarray(x, dtype=float) for x in (k_p, k_i, k_d, corner))
        return cls(series, *numbers, error)

    def problems(self, benchmark):
        found = super().problems(benchmark)
        for name in ("k_p", "k_i", "k_d"):
            found += check_positive(name, getattr(self, name), zero=True)
        wanted = f"be one of {ERRORS}"
        return [
            *found,
            *check_positive("corner", self.corner),
            *complaint(self.error in ERRORS, "error", wanted, repr(self.error)),
        ]

    def init_inner(self, trials):
        """Integral of e [mm s], and y."""
        return jnp.zeros((2, trials)), jnp.zeros((2, trials))

    def follow(self, state, r, seen):
        integral, slow = state
        k_p, k_i, k_d, corner = (
            trailing(x, 2) for x in (self.k_p, self.k_i, self.k_d, self.corner)
        )
        e = r - (seen.x_m if self.error == "measured" else seen.x_hat)
        integral = integral + seen.dt * e
        w = 2 * np.pi * corner
        slope = (e - slow) * (w / (1.0 + w * seen.dt))
        u = r + k_p * e + k_i * integral + k_d * slope
        return (integral, slow + seen.dt * slope), u


ENTRY = Entry(
    name="cats-pid",
    controller=CATSPID,
    make=CATSPID.design,
    label="CATS + PID",
    paper="after Aguila et al. 2024, Front. Built Environ. 10:1384235",
    parameters=(
        Parameter("k_p", "k_p", "proportional gain", K_P, "1", 0.0, kind="tunable"),
        Parameter("k_i", "k_i", "integral gain", K_I, "1/s", 0.0, kind="tunable"),
        Parameter("k_d", "k_d", "derivative gain", 0.0, "s", 0.0),
        Parameter("corner", "f_d", "corner of the derivative", 20.0, "Hz", 0.0, above=True),
        Parameter("error", "", "error that is fed back", "measured", choices=ERRORS,
                  kind="static"),
        *outer_parameters(DELAY_S),
    ),
)  # fmt: skip
