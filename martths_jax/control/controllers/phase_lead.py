"""Phase-lead compensation: a discrete lead filter on each target (Zhao et al. 2003)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.arguments import known
from martths_jax.control.base import Controller, Decision
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.uncoupled import (
    FILTER,
    both,
    gain_and_time,
    numbers,
    out_of_range,
    per_actuator,
    ready,
)
from martths_jax.errors import argument_error


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class PhaseLead(Controller):
    """U_i / X_a,i = g_i (1 + T_l,i s) / (1 + T_f s), T_l,i = tau_i + T_f, by the bilinear rule.

    With s = c (z - 1) / (z + 1), c = 2 / dt, sample by sample

        (1 + c T_f) u(k) = g [(1 + c T_l) x_a(k) + (1 - c T_l) x_a(k-1)] - (1 - c T_f) u(k-1).

    At frequencies well below 1 / T_f it leads by tau.  The structure of the filter is that of the
    lead in front of the uniaxial benchmark's controller (Silva et al. 2020), 50.8 (s + 168.6) /
    (s + 8570).

    The numbers of actuator 1 and 2 end in _1 and _2; each of them may be one value a trial.

    Attributes:
        gain_1, gain_2: g, the gain of slow motion [-].
        tau_1, tau_2: net lead tau [s].  As published methods have it, g = 1, the leads that track
            best are 0.0469 and 0.0254 s.
        lag: time constant T_f of the filter's pole [s], at least half a sample: with less its
            response alternates from sample to sample.
        q: process noise of the Kalman filter [mm^2].
        estimate: strokes that are handed on: that filter's (``kalman``), or ``measured``.
        estimator: made by ``prepare``.
    """

    gain_1: jax.Array | float = 0.872
    gain_2: jax.Array | float = 1.054
    tau_1: jax.Array | float = 0.0537
    tau_2: jax.Array | float = 0.0219
    lag: jax.Array | float = 0.001
    q: jax.Array | float = 3e-5
    estimate: str = field(default="kalman", metadata={"static": True})
    estimator: Any = None

    name = "phase-lead"
    actuators_needed = 2
    first_lag_range = 1
    shared_axes = numbers(*both("gain"), *both("tau"), "lag")

    def problems(self, benchmark):
        found, lag = out_of_range(self, ENTRY), known(self.lag)
        if not found and lag is not None and np.min(lag) < benchmark.dt / 2:
            wanted = f"be at least half a sample ({benchmark.dt / 2:g} s)"
            found = [str(argument_error("lag", wanted, f"{self.lag!r:.80}"))]
        return found

    def prepare(self, benchmark):
        return ready(self, benchmark)

    def init(self, trials):
        """x_a(k-1), u(k-1), at rest before the first sample."""
        return jnp.zeros((2, trials)), jnp.zeros((2, trials))

    def step(self, state, seen):
        c = 2.0 / seen.dt
        f, u = c * self.lag, []
        for gain, tau, new, old, last in zip(
            per_actuator(self, "gain"), per_actuator(self, "tau"), seen.x_a, *state, strict=True
        ):
            led = f + c * tau
            u.append((gain * ((1 + led) * new + (1 - led) * old) - (1 - f) * last) / (1 + f))
        u = jnp.stack(u)
        return (seen.x_a, u), Decision(u=u)


def _of_actuator(i: int, gain: float, tau: float) -> tuple[Parameter, ...]:
    """Parameters of actuator i: what a first-order least-squares inverse of the nominal plant's
    strokes settles at under the reference motion.
    """
    return gain_and_time(i, gain, "tau", "tau", "lead", tau)


ENTRY = Entry(
    name="phase-lead",
    controller=PhaseLead,
    label="Phase lead",
    paper="Zhao, French, Shield & Posbergh 2003, lead compensation of the actuator's lag",
    parameters=(
        *_of_actuator(1, 0.872, 0.0537),
        *_of_actuator(2, 1.054, 0.0219),
        # One sample of 1024 Hz: with three the gain falls by tau T_f omega^2, 2 % at 1.9 Hz.
        Parameter("lag", "T_f", "lag of the filter", 0.001, "s", 0.0, 0.05, kind="lane"),
        *FILTER,
    ),
)
