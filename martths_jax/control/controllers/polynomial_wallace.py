"""Adaptive forward prediction: a fitted polynomial, its delay and gain adapted (Wallace 2005)."""

from __future__ import annotations

from dataclasses import dataclass, field

import jax
import jax.numpy as jnp

from martths_jax.control.base import Signal
from martths_jax.control.controllers.adapting_delay import SIGNALS, AdaptingDelay, parameters
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.uncoupled import both, numbers

#: Bounds of the gain rho [-].
GAINS = 0.5, 1.5
#: Share of the running rms that counts as moving fast, as hardly moving, and as far out [-].
FAST, SLOW, FAR = 0.3, 0.3, 1.0
#: Least rms that is reckoned with: below, noise would decide [mm/s], [mm].
LEAST_V, LEAST_X = 1.0, 0.1
#: Memory of the running mean squares [s].
MEMORY = 2.0


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class PolynomialWallace(AdaptingDelay):
    """u = rho p(tau), p of degree n fitted to N points; tau and rho learn where it shows.

    With v the slope of p at k, and rms of v and x_a over the last 2 s or so (fading memory, at
    least 1 mm/s and 0.1 mm),

        tau += dt r_tau (x_a - x_hat) / v                 where |v| > 0.3 v_rms,
        rho += dt r_rho (|x_a| - |x_hat|) / |x_a|         where |v| < 0.3 v_rms and |x_a| > x_rms.

    Wallace, Wagg & Neild 2005 adapt a delay and a gain of that prediction; these laws are reasoned
    from it, not checked against their equations.  A delay d misses by v d where the stroke is fast,
    and a gain by x (1 - rho) near its extremes, where it is slow.

    r is beta / dt of a law that moves by beta a sample: 0.01 a sample is 10 /s at 1024 Hz.  As the
    strokes answer 20 to 50 ms late, r_tau beyond 30 /s oscillates.  tau stays within 0 ... 0.08 s
    and rho within 0.5 ... 1.5.  Degree 4 through 16 points, common elsewhere, makes the loop of the
    nominal plant unstable at its delays (spectral radius 1.22 with consecutive samples).

    Attributes:
        rate: r_tau [1/s].
        gain_rate: r_rho [1/s]; 0 leaves the gain at one.
        tau_1, tau_2, order, points, spacing, q, estimate, estimator, shape: see ``AdaptingDelay``.
    """

    rate: jax.Array | float = 5.0
    gain_rate: jax.Array | float = 10.0
    points: int | None = field(default=8, metadata={"static": True})
    spacing: float = field(default=4 / 1024, metadata={"static": True})

    name = "polynomial-wallace"
    actuators_needed = 2
    signals = (*SIGNALS, Signal("rho", ("actuator",), "1", "adapted gain"))
    shared_axes = numbers(*both("tau"), "rate", "gain_rate")

    @property
    def entry(self):
        return ENTRY

    def learning(self, trials):
        """The gain, and running mean squares of v and x_a."""
        zero = jnp.zeros(trials)
        return jnp.ones(trials), zero, zero

    def adapt(self, tau, learnt, x_a, x_hat, v, dt):
        rho, of_v, of_x = learnt
        share = dt / MEMORY
        of_v = of_v + share * (v**2 - of_v)
        of_x = of_x + share * (x_a**2 - of_x)
        v_rms = jnp.maximum(jnp.sqrt(of_v), LEAST_V)
        x_rms = jnp.maximum(jnp.sqrt(of_x), LEAST_X)

        fast = jnp.abs(v) > FAST * v_rms
        late = (x_a - x_hat) / jnp.where(fast, v, 1.0)
        tau = tau + jnp.where(fast, dt * self.rate * late, 0.0)

        out = (jnp.abs(v) < SLOW * v_rms) & (jnp.abs(x_a) > FAR * x_rms)
        short = (jnp.abs(x_a) - jnp.abs(x_hat)) / jnp.where(out, jnp.abs(x_a), 1.0)
        rho = rho + jnp.where(out, dt * self.gain_rate * short, 0.0)
        rho = jnp.clip(rho, *GAINS)
        return tau, rho, (rho, of_v, of_x)


ENTRY = Entry(
    name="polynomial-wallace",
    controller=PolynomialWallace,
    label="Polynomial, Wallace",
    paper="Wallace, Wagg & Neild 2005, adaptive polynomial forward prediction",
    parameters=(
        # Of 13 choices on 32 drawn plants and elcentro-like, the best for the slower actuator.
        Parameter("rate", "r_tau", "rate of the delay", 5.0, "1/s", 0.0, 30.0, kind="tunable"),
        Parameter("gain_rate", "r_rho", "rate of the gain", 10.0, "1/s", 0.0, 30.0, kind="tunable"),
        *parameters(2, 8, 4 / 1024, (40 / 1024, 26 / 1024)),
    ),
)
