"""Adaptive inverse compensation (Chen & Ricles), decentralised.

    u(k)     = g [alpha(k) x_a(k) - (alpha(k) - 1) x_a(k-1)]
    alpha(k) = 1 + T(k) / dt,  T(k) = T_0 + k_p TI(k) + k_i dt sum TI,  clamped to [0, 0.087] s

The first is the inverse of the actuator x(k) = x(k-1) + (u(k) - x(k-1)) / alpha, which has the time
constant T; adapting T rather than alpha keeps the settings when the sampling rate is another.  T
moves with the tracking indicator of Mercan & Ricles,

    A += (x_hat(k) + x_hat(k-1)) (x_a(k) - x_a(k-1)) / 2
    B += (x_hat(k) - x_hat(k-1)) (x_a(k) + x_a(k-1)) / 2,  TI = (B - A) / 2  [mm^2]

to which one cycle of amplitude X with a lag phi adds pi X^2 sin phi.  Form from the design notes,
where it is given from memory of the method; the sign was derived anew: stroke over target runs
through an ellipse, of which A and B are the signed areas seen from either axis, and TI is positive
for a lag.  Chen, C. & Ricles, J. M. (2010), Journal of Structural Engineering 136(11).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import jax
import jax.numpy as jnp

from martths_jax.control.adaptive.arguments import check_positive, complaint, known
from martths_jax.control.base import Controller, Decision, Signal
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.estimators import design_kalman

#: Bounds of T, 1 to 90 for alpha at 1024 Hz [s].
BOUNDS_S = (0.0, 89 / 1024)
#: Start values and gains that put the nominal plant's strokes on the targets (design notes): the
#: indicator says nothing of a gain, so a wrong one would stay.
LEAD_S, GAIN = (55 / 1024, 22 / 1024), (0.872, 1.054)
#: One cycle of 1 ms lag at 1 mm and 1.9 Hz, 0.037 mm^2, moves alpha by 0.3 samples at 1024 Hz
#: [s/mm^2].
K_P = 8.0 / 1024
#: A tenth of that a second [1/mm^2].
K_I = 0.8 / 1024
#: Time constant with which TI fades, some periods of the structure [s].
LEAK_S = 2.0


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class AIC(Controller):
    """u = g [alpha x_a(k) - (alpha - 1) x_a(k-1)] with alpha = 1 + T / dt led by the indicator.

    Attributes:
        lead: (2,) T_0, time constants of the two actuators [s].
        gain: (2,) g [-].
        k_p: proportional gain [s/mm^2].
        k_i: integral gain [1/mm^2].
        leak: time constant with which TI fades, so that old motion does not rule [s].
        q: process noise of the Kalman filter whose strokes TI is made of [mm^2].
        estimator: the Kalman filter, designed by ``prepare``.

    `lead` and `gain` may be (2, T), the others arrays over trials.
    """

    lead: Any = LEAD_S
    gain: Any = GAIN
    k_p: jax.Array | float = K_P
    k_i: jax.Array | float = K_I
    leak: jax.Array | float = LEAK_S
    q: jax.Array | float = 3e-5
    estimator: Any = None

    name = "aic"
    actuators_needed = 2
    adapts = True
    first_lag_range = 1
    signals = (
        Signal("alpha", ("actuator",), "samples", "coefficient of the inverse compensation"),
        Signal("indicator", ("actuator",), "mm^2", "fading tracking indicator"),
    )
    shared_axes = MappingProxyType({"lead": 1, "gain": 1, "k_p": 0, "k_i": 0, "leak": 0, "q": 0})

    def problems(self, benchmark):
        found = [
            *check_positive("k_p", self.k_p, zero=True),
            *check_positive("k_i", self.k_i, zero=True),
            *check_positive("gain", self.gain),
            *check_positive("q", self.q),
        ]
        dt = 1 / benchmark.fs
        lead, leak = known(self.lead), known(self.leak)
        for name in ("lead", "gain"):
            value = known(getattr(self, name))
            good = value is None or (value.ndim in (1, 2) and len(value) == 2)
            found += complaint(good, name, "be two numbers", f"{getattr(self, name)!r:.80}")
        if lead is not None:
            wanted = f"lie from {BOUNDS_S[0]:g} to {BOUNDS_S[1]:.3g} s"
            inside = (lead >= BOUNDS_S[0]) & (lead <= BOUNDS_S[1])
            found += complaint(inside, "lead", wanted, f"{self.lead!r:.80}")
        wanted = f"be at least the sample period, {dt:g} s"
        return found + complaint(leak is None or leak >= dt, "leak", wanted, self.leak)

    def prepare(self, benchmark):
        return replace(
            self,
            lead=jnp.asarray(self.lead, dtype=float),
            gain=jnp.asarray(self.gain, dtype=float),
            estimator=design_kalman(benchmark.plant_model, self.q, benchmark.r_mm2),
        )

    def init(self, trials):
        # Before the first sample all is at rest: x_a and x_hat of k = -1 are zero.
        return {n: jnp.zeros((2, trials)) for n in ("x_a", "x_hat", "indicator", "integral")}

    def step(self, state, seen):
        k_p, k_i, leak = (_row(x) for x in (self.k_p, self.k_i, self.leak))
        ti = state["indicator"] * (1.0 - seen.dt / leak) + indicated(
            state["x_a"], seen.x_a, state["x_hat"], seen.x_hat
        )
        both = lambda x: x.reshape(2, -1)  # noqa: E731
        first = both(self.lead) + k_p * ti
        summed = state["integral"] + k_i * seen.dt * ti
        # Where T is at a bound its integral rests, or it would stick there long after.
        free = (first + summed > BOUNDS_S[0]) & (first + summed < BOUNDS_S[1])
        integral = jnp.where(free, summed, state["integral"])
        alpha = 1.0 + jnp.clip(first + integral, *BOUNDS_S) / seen.dt
        u = both(self.gain) * (alpha * seen.x_a - (alpha - 1.0) * state["x_a"])
        state = {"x_a": seen.x_a, "x_hat": seen.x_hat, "indicator": ti, "integral": integral}
        return state, Decision(u=u, signals={"alpha": alpha, "indicator": ti})


def _row(number) -> jax.Array:
    """One number, or one a trial, as a row that goes with (2, T)."""
    return jnp.reshape(jnp.asarray(number, dtype=float), (1, -1))


def indicated(x_a_before, x_a, x_before, x) -> jax.Array:
    """What a sample adds to the tracking indicator [mm^2], positive for a lag.

        (dB - dA) / 2 = (x_a(k-1) x(k) - x_a(k) x(k-1)) / 2

    which is dA and dB of the module's head multiplied out: twice their mixed products cancel.
    """
    return 0.5 * (x_a_before * x - x_a * x_before)


ENTRY = Entry(
    name="aic",
    controller=AIC,
    label="AIC",
    paper="Chen & Ricles 2010, adaptive inverse compensation by the tracking indicator",
    parameters=(
        Parameter("lead", "T_0", "time constants of the actuators at first", LEAD_S, "s",
                  *BOUNDS_S, size=2),
        Parameter("gain", "g", "gains of the commands", GAIN, "1", 0.0, above=True, size=2),
        Parameter("k_p", "k_p", "proportional gain", K_P, "s/mm^2", 0.0, kind="tunable"),
        Parameter("k_i", "k_i", "integral gain", K_I, "1/mm^2", 0.0, kind="tunable"),
        Parameter("leak", "", "time constant of the fading indicator", LEAK_S, "s", 0.0,
                  above=True, kind="lane"),
        Parameter("q", "q", "process noise", 3e-5, "mm^2", 0.0, above=True, kind="tunable"),
    ),
)  # fmt: skip
