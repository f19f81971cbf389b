"""Polynomial extrapolation of a constant delay (Horiuchi, Inoue, Konno & Namita 1999)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import jax
import jax.numpy as jnp

from martths_jax.control.base import Controller, Decision
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.extrapolation import (
    MOST_ORDER,
    MOST_SPACING,
    Extrapolation,
    unusable,
)
from martths_jax.control.uncoupled import (
    FILTER,
    both,
    numbers,
    out_of_range,
    per_actuator,
    ready,
)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Polynomial(Controller):
    """u_i(k) = p_i(tau_i), p_i the polynomial through x_a,i(k), x_a,i(k - h_i), ...

    Of degree n through n + 1 points, which is Lagrange's form for any spacing h and any delay tau:

        u(k) = sum_j w_j x_a(k - j h),   w_j = prod_{l != j} (tau + l h) / ((l - j) h).

    With tau = h, the paper's form, w = (2, -1), (3, -3, 1), (4, -6, 4, -1), (5, -10, 10, -5, 1).
    More points than n + 1 make it a least-squares fit, see ``martths_jax.control.extrapolation``.
    The spacing stays where it is when tau moves; give both for the paper's form of another delay.

    The numbers of actuator 1 and 2 end in _1 and _2.

    Attributes:
        tau_1, tau_2: delay that is made up for [s]; one value a trial too.
        order_1, order_2: degree n.  Through points 40 samples apart, degree 3 makes the loop of the
            nominal plant unstable.
        points_1, points_2: N points; None is n + 1.
        spacing_1, spacing_2: h [s], rounded to whole samples.
        q: process noise of the Kalman filter [mm^2].
        estimate: strokes that are handed on: that filter's (``kalman``), or ``measured``.
        estimator: made by ``prepare``.
        shape: of both polynomials, made by ``prepare``.
    """

    tau_1: jax.Array | float = 40 / 1024
    tau_2: jax.Array | float = 26 / 1024
    order_1: int = field(default=2, metadata={"static": True})
    order_2: int = field(default=1, metadata={"static": True})
    points_1: int | None = field(default=None, metadata={"static": True})
    points_2: int | None = field(default=None, metadata={"static": True})
    spacing_1: float = field(default=40 / 1024, metadata={"static": True})
    spacing_2: float = field(default=26 / 1024, metadata={"static": True})
    q: jax.Array | float = 3e-5
    estimate: str = field(default="kalman", metadata={"static": True})
    estimator: Any = None
    shape: tuple[Extrapolation, ...] = field(default=(), metadata={"static": True})

    name = "polynomial"
    actuators_needed = 2
    first_lag_range = 1
    shared_axes = numbers(*both("tau"))

    @property
    def given(self) -> tuple:
        """Order, points and spacing of each actuator."""
        names = ("order", "points", "spacing")
        return tuple(zip(*(per_actuator(self, name) for name in names), strict=True))

    def problems(self, benchmark):
        found = out_of_range(self, ENTRY)
        if found:
            return found
        pairs = zip(("_1", "_2"), self.given, strict=True)
        return [text for end, one in pairs for text in unusable(end, *one, benchmark.fs)]

    def prepare(self, benchmark):
        shape = tuple(Extrapolation.of(*one, benchmark.fs) for one in self.given)
        return replace(ready(self, benchmark), shape=shape)

    def init(self, trials):
        return tuple(one.init(trials) for one in self.shape)

    def step(self, state, seen):
        kept, u = [], []
        for one, past, x_a, tau in zip(
            self.shape, state, seen.x_a, per_actuator(self, "tau"), strict=True
        ):
            past, c = one.step(past, x_a)
            kept.append(past)
            u.append(one.value(c, tau / seen.dt))
        return tuple(kept), Decision(u=jnp.stack(u))


def _of_actuator(i: int, samples: int, order: int) -> tuple[Parameter, ...]:
    """Parameters of actuator i: the pair of delay and order that tracks best on the nominal plant,
    of those that the paper has, with spacing and delay alike (whole samples of 1024 Hz).
    """
    delay, short = samples / 1024, 1e-4
    return (
        Parameter(f"tau_{i}", f"tau_{i}", f"delay of actuator {i}", delay, "s", 0.0, 0.08,
                  kind="tunable"),
        Parameter(f"order_{i}", f"n_{i}", f"order for actuator {i}", order, "1", 0, MOST_ORDER,
                  whole=True, kind="static"),
        Parameter(f"points_{i}", f"N_{i}", f"points for actuator {i}", None, "1", 1, 64,
                  whole=True, kind="static"),
        Parameter(f"spacing_{i}", f"h_{i}", f"spacing for actuator {i}", delay, "s", short,
                  MOST_SPACING, kind="static"),
    )  # fmt: skip


ENTRY = Entry(
    name="polynomial",
    controller=Polynomial,
    label="Polynomial",
    paper="Horiuchi, Inoue, Konno & Namita 1999, polynomial extrapolation of a constant delay",
    parameters=(*_of_actuator(1, 40, 2), *_of_actuator(2, 26, 1), *FILTER),
)
