"""Models of an actuator whose parameters a filter estimates together with its stroke.

A model says by how much the stroke x_i rises within a sample, d(k+1) = x_i(k+1) - x_i(k), from
x_i(k), d(k), the command u_i(k) and that of the other actuator u_j(k); and it can be solved for the
command that gives a wanted rise.  All are scalar algebra on arrays (T,) or (2, T).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp

#: Number of parameters of every model.
PARAMETERS = 4
#: Largest share phi of a rise that the next one keeps: nearer to 1 the actuator hardly decays.
MOST_KEPT = 0.95


class ActuatorModel(ABC):
    """Base of the models; they hold no numbers, so that one is part of the program.

    The four numbers p count time in samples, so that no sampling rate is needed.

    Attributes:
        names: of the parameters.
    """

    names: tuple[str, ...] = ()

    @abstractmethod
    def rise(self, p: Sequence[jax.Array], x, d, u, other) -> jax.Array:
        """d(k+1) [mm].

        Args:
            p: the parameters.
            x, d: x_i(k) and d(k) [mm].
            u, other: u_i(k) and u_j(k) [mm].
        """

    @abstractmethod
    def slopes(self, p: Sequence[jax.Array], x, d, u, other) -> tuple[jax.Array, ...]:
        """Derivatives of ``rise`` by x, d and the parameters, in this order."""

    @abstractmethod
    def demand(self, p: Sequence[jax.Array], x, d, rise) -> jax.Array:
        """u_i + c u_j [mm] that makes x_i rise by `rise`."""

    @abstractmethod
    def coupling(self, p: Sequence[jax.Array]) -> jax.Array:
        """c [-], what the other command counts beside its own."""

    @abstractmethod
    def from_seconds(self, gain, lead, curvature, coupling, fs: float) -> tuple:
        """The parameters of p_2 x'' + p_1 x' + p_0 x = u_i + c u_j.

        Args:
            gain: p_0 [-].
            lead: p_1 [s].
            curvature: p_2 [s^2].
            coupling: c [-].
            fs: sampling rate [Hz].
        """

    @abstractmethod
    def limits(self, start: Sequence[jax.Array]) -> tuple[tuple, tuple]:
        """Least and largest p / start, one each a parameter: within them the model decays.

        Args:
            start: the parameters at first.
        """


@dataclass(frozen=True)
class TransferFunction(ActuatorModel):
    """x_i = (u_i + c u_j) / (p_2 s^2 + p_1 s + p_0) with p = (p_0, p_1 / dt, p_2 / dt^2, c).

        p_2 (d(k+1) - d(k)) / dt^2 + p_1 d(k+1) / dt + p_0 x(k) = u_i(k) + c u_j(k)

    The velocity is taken at the end of the step, so that p_2 = 0 is an actuator of first order and
    any p_1, p_2 >= 0 decays.
    """

    names = ("p_0", "p_1", "p_2", "c")

    def rise(self, p, x, d, u, other):
        p0, p1, p2, c = p
        return (p2 * d + u + c * other - p0 * x) / (p1 + p2)

    def slopes(self, p, x, d, u, other):
        p0, p1, p2, _ = p
        inverse = 1.0 / (p1 + p2)
        after = self.rise(p, x, d, u, other)
        return (
            -p0 * inverse, p2 * inverse,
            -x * inverse, -after * inverse, (d - after) * inverse, other * inverse,
        )  # fmt: skip

    def demand(self, p, x, d, rise):
        p0, p1, p2, _ = p
        return p0 * x + p1 * rise + p2 * (rise - d)

    def coupling(self, p):
        return p[3]

    def from_seconds(self, gain, lead, curvature, coupling, fs):
        return gain, lead * fs, curvature * fs**2, coupling

    def limits(self, start):
        return (0.5, 0.25, 0.0, -3.0), (2.0, 4.0, 8.0, 3.0)


@dataclass(frozen=True)
class StateSpace(ActuatorModel):
    """x(k+1) = f_1 x(k) + f_2 x(k-1) + g u_i(k) + h u_j(k) with p = (e, phi, g, h).

        d(k+1) = phi d(k) - e x(k) + g u_i(k) + h u_j(k),   f_1 = 1 + phi - e,  f_2 = -phi

    f_1 and f_2 of a slow motion are almost 2 and -1; what they differ by is what tells actuators
    apart, and that is what is estimated.
    """

    names = ("e", "phi", "g", "h")

    def rise(self, p, x, d, u, other):
        e, phi, g, h = p
        return phi * d - e * x + g * u + h * other

    def slopes(self, p, x, d, u, other):
        e, phi, _, _ = p
        return -e, phi, -x, d, u, other

    def demand(self, p, x, d, rise):
        e, phi, g, _ = p
        return (rise - phi * d + e * x) / g

    def coupling(self, p):
        return p[3] / p[2]

    def from_seconds(self, gain, lead, curvature, coupling, fs):
        p1, p2 = lead * fs, curvature * fs**2
        g = 1.0 / (p1 + p2)
        return gain * g, p2 * g, g, coupling * g

    def limits(self, start):
        phi = start[1]
        most = jnp.where(phi > 0, MOST_KEPT / jnp.where(phi > 0, phi, 1.0), 1.0)
        return (0.25, 0.0, 0.25, -3.0), (4.0, most, 4.0, 3.0)
