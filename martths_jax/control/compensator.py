"""Estimator and controller as one box: what stands between the sensors, the target and the valves.

The box has two halves, since the restoring force made from the estimate at k decides the target at
k: ``observe`` takes the measurement, ``decide`` the target.  The loop runs exactly these; ``step``
does both, on recorded signals or wherever the box is exported to.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import jax
import jax.numpy as jnp

from martths_jax.control.base import Controller, Decision, Estimator, Observation
from martths_jax.once import computed


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class CompensatorState:
    """What a compensator remembers, at the start of sample k.

    Attributes:
        k: number of the sample, a scalar.
        predicted: the estimator's prediction for k.
        controller: state of the controller.
        line: (n, ..., T) records in the delay line, that of sample j in row j mod n; None without.
    """

    k: jax.Array
    predicted: Any
    controller: Any
    line: Any


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Observed:
    """A compensator between its halves: the measurement of k is in, the target is not.

    Attributes:
        state: as before the sample.
        corrected: what the estimator knows at k.
        x_m, x_hat: (2, T) x_m(k) and x_hat(k).
    """

    state: CompensatorState
    corrected: Any
    x_m: jax.Array
    x_hat: jax.Array


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Compensator:
    """An estimator and a controller, both prepared for a benchmark.

    Attributes:
        controller: what decides the commands.
        estimator: what it is told of the strokes.
        dt: sample period [s].
    """

    controller: Controller
    estimator: Estimator
    dt: float = field(metadata={"static": True})

    @classmethod
    def of(cls, controller: Controller, benchmark) -> Compensator:
        """The box of a controller on a benchmark.

        Args:
            controller: prepared or not.
            benchmark: from ``build_benchmark``.
        """
        ready = controller.prepare(benchmark)
        return cls(ready, ready.estimator, benchmark.dt)

    def init(self, trials: int = 1) -> CompensatorState:
        """Everything at rest, at sample 0.

        Args:
            trials: number T of trials side by side.
        """
        line = self.controller.delay_line(trials)
        state = self.init_served(trials)
        if line is None:
            return state
        rows = lambda x: jnp.broadcast_to(x, (line.samples, *x.shape))  # noqa: E731
        return replace(state, line=jax.tree.map(rows, line.blank))

    def init_served(self, trials: int) -> CompensatorState:
        """``init`` for a caller that serves the delay line itself: without one."""
        states = self.estimator.init(trials), self.controller.init(trials)
        return CompensatorState(jnp.zeros((), int), *states, None)

    def observe(self, state: CompensatorState, x_m: jax.Array) -> tuple[Observed, jax.Array]:
        """First half of sample k.

        Args:
            state: at the start of k.
            x_m: (2, T) strokes x_m(k).

        Returns:
            the box between its halves; (2, T) estimated strokes x_hat(k) [mm].
        """
        corrected, estimate = self.estimator.correct(state.predicted, x_m)
        return Observed(state, corrected, x_m, estimate), estimate

    def decide(
        self, observed: Observed, x_a: jax.Array
    ) -> tuple[CompensatorState, jax.Array, dict[str, jax.Array]]:
        """Second half of sample k.

        Args:
            observed: from ``observe``.
            x_a: (2, T) strokes x_a(k).

        Returns:
            state at the start of k + 1; (2, T) commands u(k) [mm]; the controller's signals.
        """
        k, rows = observed.state.k, observed.state.line
        line = self.controller.delay_line(x_a.shape[-1])
        if line is None:
            state, decision = self.decide_served(observed, x_a, None)
            return state, decision.u, decision.signals
        row = k % line.samples
        out = jax.tree.map(lambda x: x[row], rows)
        state, decision = self.decide_served(observed, x_a, out)
        rows = jax.tree.map(lambda x, new: x.at[row].set(new), rows, decision.record)
        controller = state.controller
        if line.renew is not None:
            full = row == line.samples - 1
            controller = jax.lax.cond(full, line.renew, lambda x: x, controller)
        state = replace(state, controller=controller, line=rows)
        return state, decision.u, decision.signals

    def decide_served(
        self, observed: Observed, x_a: jax.Array, delayed: Any
    ) -> tuple[CompensatorState, Decision]:
        """``decide`` for a caller that serves the delay line itself.

        Args:
            observed, x_a: as for ``decide``.
            delayed: what comes out of the line at k.

        Returns:
            state at the start of k + 1, with the line as it was and not renewed; the decision,
            whose ``record`` goes into the line.
        """
        before = observed.state
        seen = Observation(
            before.k, self.dt, x_a, observed.x_m, observed.x_hat,
            observed.corrected, delayed,
        )  # fmt: skip
        controller, decision = self.controller.step(before.controller, seen)
        decision = replace(decision, u=computed(decision.u))
        predicted = self.estimator.predict(observed.corrected, decision.u)
        return CompensatorState(before.k + 1, predicted, controller, before.line), decision

    def step(
        self, state: CompensatorState, x_a: jax.Array, x_m: jax.Array
    ) -> tuple[CompensatorState, jax.Array, dict[str, jax.Array]]:
        """Both halves of a sample, on signals that are there: recorded ones, or a rig's.

        Args:
            state: at the start of k.
            x_a, x_m: (2, T) strokes x_a(k) and x_m(k).

        Returns:
            as ``decide``.
        """
        observed, _ = self.observe(state, x_m)
        return self.decide(observed, x_a)
