"""Polynomial extrapolation of a delay that every error moves (Darby et al. 2002)."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp

from martths_jax.control.controllers.adapting_delay import AdaptingDelay, parameters
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.uncoupled import both, numbers


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class PolynomialDarby(AdaptingDelay):
    """u = p(tau), dtau/dt = C_p tanh(C_v v) (x_a - x_hat), v the slope of p at k.

    A stroke that is late by d misses by about v d, so that tau goes up whichever way it moves;
    where it hardly moves the error says little, and tanh lets tau be.  With C_v v_rms near 1 the
    delay that is left decays at about 0.7 C_p v_rms [1/s].

    Euler steps of a sample; tau stays within 0 ... 0.08 s.

    Attributes:
        C_p: rate of the delay by an error [1/mm].
        C_v: slope of the weighting by velocity [s/mm].
        tau_1, tau_2, order, points, spacing, q, estimate, estimator, shape: see ``AdaptingDelay``.
    """

    C_p: jax.Array | float = 0.1
    C_v: jax.Array | float = 0.1

    name = "polynomial-darby"
    actuators_needed = 2
    shared_axes = numbers(*both("tau"), "C_p", "C_v")

    @property
    def entry(self):
        return ENTRY

    def learning(self, trials):
        return ()

    def adapt(self, tau, learnt, x_a, x_hat, v, dt):
        tau = tau + dt * self.C_p * jnp.tanh(self.C_v * v) * (x_a - x_hat)
        return tau, jnp.ones_like(tau), learnt


ENTRY = Entry(
    name="polynomial-darby",
    controller=PolynomialDarby,
    label="Polynomial, Darby",
    paper="Darby, Williams & Blakeborough 2002, on-line delay estimation",
    parameters=(
        # An error of 0.1 mm moves tau by 1 ms in 0.1 s; the targets' rms velocities are about 7 and
        # 13 mm/s.
        Parameter("C_p", "C_p", "rate of the delay by an error", 0.1, "1/mm", 0.0, kind="tunable"),
        Parameter("C_v", "C_v", "weighting by velocity", 0.1, "s/mm", 0.0, above=True,
                  kind="tunable"),
        *parameters(2, None, 26 / 1024, (40 / 1024, 26 / 1024)),
    ),
)  # fmt: skip
