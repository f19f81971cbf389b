"""A conditional adaptive time series outside, a feedback controller inside (Aguila et al. 2024).

    r(k) = a_0 x_a(k) + a_1 x_a'(k) + a_2 x_a''(k)
    u(k) = feedback that makes the strokes follow r

The time series is ``ats_rls.RecursiveATS`` as it stands, but for what it is taught: the pairs of
r(k-1) and the strokes at k.  To it the inner loop is the actuator, of which it learns the inverse;
what the feedback has taken away of the plants' differences it need not learn.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import jax
import jax.numpy as jnp

from martths_jax.control.base import Controller, Observation, Signal
from martths_jax.control.controllers.ats_rls import ENTRY as ATS_RLS
from martths_jax.control.controllers.feedforward import SIGNALS, AdaptiveFeedforward
from martths_jax.control.controllers.frozen import FrozenFeedforward
from martths_jax.control.entry import Parameter


def outer_parameters(delay: tuple[float, float]) -> tuple[Parameter, ...]:
    """Parameters of the time series and of the filter.

    Args:
        delay: of the inner loop, from which the time series starts [s].
    """
    inner = replace(
        ATS_RLS.parameter("delay"), label="delays of the inner loop that it starts from",
        default=delay,
    )  # fmt: skip
    return tuple(inner if p.name == "delay" else p for p in ATS_RLS.parameters)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Cascade(Controller):
    """A feedback controller behind a time series; what a subclass adds is ``follow``.

    Attributes:
        outer: the time series, whose estimator is the controller's.
    """

    outer: AdaptiveFeedforward

    adapts = True
    first_lag_range = 1
    signals = (
        *SIGNALS,
        Signal("r", ("actuator",), "mm", "strokes that the inner loop follows"),
    )

    @property
    def estimator(self) -> Any:
        """The filter that both loops run with."""
        return self.outer.estimator

    def problems(self, benchmark):
        return self.outer.problems(benchmark)

    def prepare(self, benchmark):
        return replace(self, outer=self.outer.prepare(benchmark))

    def frozen(self, benchmark, coefficients):
        """The same with (3, 2) or (3, 2, T) coefficients of the time series that stay."""
        return FrozenCascade(jnp.asarray(coefficients, dtype=float), self.prepare(benchmark))

    def init(self, trials):
        return self.outer.init(trials), self.init_inner(trials)

    def step(self, state, seen):
        outer, inner = state
        outer, asked = self.outer.step(outer, seen)
        inner, u = self.follow(inner, asked.u, seen)
        return (outer, inner), replace(asked, u=u, signals=asked.signals | {"r": asked.u})

    @abstractmethod
    def init_inner(self, trials: int) -> Any:
        """State of the inner loop before the first sample."""

    @abstractmethod
    def follow(self, state: Any, r: jax.Array, seen: Observation) -> tuple[Any, jax.Array]:
        """One sample of the inner loop.

        Args:
            state: of the inner loop.
            r: (2, T) r(k) [mm].
            seen: what the controller is told at k.

        Returns:
            state for k + 1; (2, T) commands u(k) [mm].
        """


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class FrozenCascade(Controller):
    """A cascade whose time series does not adapt.

    Attributes:
        coefficients: (3, 2) or (3, 2, T) of the time series.
        cascade: the live one, prepared.
    """

    coefficients: jax.Array
    cascade: Cascade

    name = "frozen cascade"
    shared_axes = MappingProxyType({"coefficients": 2})

    @property
    def estimator(self) -> Any:
        """That of the cascade."""
        return self.cascade.estimator

    @property
    def outer(self) -> FrozenFeedforward:
        """The time series that stays."""
        live = self.cascade.outer
        return FrozenFeedforward(
            self.coefficients, live.estimator, live.regressor, live.joint, live.law
        )

    def init(self, trials):
        return self.outer.init(trials), self.cascade.init_inner(trials)

    def step(self, state, seen):
        outer, inner = state
        outer, asked = self.outer.step(outer, seen)
        inner, u = self.cascade.follow(inner, asked.u, seen)
        return (outer, inner), replace(asked, u=u)
