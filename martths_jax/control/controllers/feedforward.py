"""Adaptive feedforward out of pieces: regressor, fit, guards and command law.

    u(k) = law(C(k), phi(x_a(k))),  C(k) = guards(fit(pairs (phi(x_hat(j)), u(j-1)), j <= k))

``ADFC`` is one choice of the pieces (``martths_jax.control.adaptive``); most adaptive compensators
of the literature are others.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import reduce
from types import MappingProxyType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.arguments import (
    check_positive,
    check_shape,
    complaint,
    per_coefficient,
)
from martths_jax.control.adaptive.base import (
    ACTUATORS,
    Fit,
    Guard,
    Law,
    Pair,
    Part,
    Regressor,
    choose,
    parts_of,
)
from martths_jax.control.adaptive.differences import BackwardDifferences
from martths_jax.control.adaptive.law import Linear
from martths_jax.control.adaptive.lowpass import LowPass
from martths_jax.control.adaptive.window import Window
from martths_jax.control.base import Controller, Decision, DelayLine, Signal
from martths_jax.control.controllers.frozen import FrozenFeedforward, command
from martths_jax.control.estimators import design_kalman

#: Strokes that can be learnt from.
SOURCES = ("estimate", "measurement")
#: What the controllers made of these pieces give beside their command.
SIGNALS = (
    Signal("C_A", ("coefficient", "actuator"), "1",
           "adaptive coefficients in scaled derivatives", elements=tuple(
               f"u{actuator}: x{stroke}" + "'" * order
               for stroke in (1, 2) for order in range(4) for actuator in (1, 2))),
    Signal("held", (), "1", "fits that the controller did not use", count=True),
)  # fmt: skip


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class AdaptiveFeedforward(Controller):
    """A controller composed of exchangeable pieces.

    Attributes:
        regressor: n numbers a stroke, from its newest samples.
        fit: coefficients from what was seen.
        guards: applied in this order.
        law: the command from coefficients and target.
        start: (m n, m) coefficients of m actuators until the first fit, (n, m) one column an
            actuator where each has its own; None follows the target (u = x_a).
        joint: one problem over all strokes (m n unknowns, m sides); False is one an actuator
            (n unknowns, 1 side).
        learns_from: the strokes that it is taught by, ``estimate`` or ``measurement``.
        low_pass: filter of those strokes and of the commands that go with them.
        q: process noise of the Kalman filter [mm^2].
        estimator: another than that filter; designed by ``prepare`` where there is none.
        actuators: number m of strokes, by ``prepare``.
    """

    regressor: Regressor = field(default=BackwardDifferences(), metadata={"static": True})
    fit: Fit = field(default_factory=Window)
    guards: tuple[Guard, ...] = ()
    law: Law = field(default_factory=Linear)
    start: jax.Array | None = None
    joint: bool = field(default=True, metadata={"static": True})
    learns_from: str = field(default="estimate", metadata={"static": True})
    low_pass: LowPass | None = field(default=None, metadata={"static": True})
    q: jax.Array | float = 3e-5
    estimator: Any = None
    actuators: int = field(default=ACTUATORS, metadata={"static": True})

    name = "feedforward"
    adapts = True
    signals = SIGNALS
    shared_axes = MappingProxyType({"q": 0, "start": 2})

    @property
    def parts(self) -> tuple[Part, ...]:
        """Its least-squares problems."""
        return parts_of(*self.sizes)

    @property
    def sizes(self) -> tuple[int, bool, int]:
        """Arguments of ``parts_of``."""
        return self.regressor.columns, self.joint, self.actuators

    def sized(self, benchmark) -> AdaptiveFeedforward:
        """The controller for as many actuators as a benchmark has; the same without one."""
        if benchmark is None:
            return self
        return replace(self, actuators=len(benchmark.layout.actuators))

    def problems(self, benchmark):
        return self.sized(benchmark)._problems()

    def _problems(self) -> list[str]:
        pieces = {"regressor": self.regressor, "fit": self.fit, "law": self.law}
        pieces |= {f"guards[{i}]": guard for i, guard in enumerate(self.guards)}
        if self.low_pass is not None:
            pieces["low_pass"] = self.low_pass
        found = [
            text.replace("Argument `", f"Argument `{place}.", 1)
            for place, piece in pieces.items()
            for text in piece.problems(self)
        ]
        if found:  # what follows builds on sound pieces
            return found
        for guard in self.guards:
            wanted = f"solve normal equations, which {type(guard).__name__} changes"
            good = self.fit.normal or not guard.weighs
            found += complaint(good, "fit", wanted, type(self.fit).__name__)
        if self.start is None:
            wanted = "be given where the first regressor is not the stroke itself"
            found += complaint(_begins_with_stroke(self.regressor), "start", wanted, "None")
        return [
            *found,
            *check_shape("start", self.start, self.parts, ("coefficients",)),
            *check_positive("q", self.q),
            *complaint(self.learns_from in SOURCES, "learns_from", f"be one of {SOURCES}",
                       repr(self.learns_from)),
        ]  # fmt: skip

    def prepare(self, benchmark):
        own = self.sized(benchmark)
        estimator = self.estimator
        if estimator is None:
            estimator = design_kalman(benchmark.plant_model, self.q, benchmark.r_mm2)
        start = follow_target(*own.sizes) if self.start is None else self.start
        ready = replace(own, estimator=estimator, start=per_coefficient(start, *own.sizes))
        fit = ready.fit.prepare(benchmark, ready)
        guards = tuple(guard.prepare(benchmark, ready) for guard in ready.guards)
        return replace(ready, fit=fit, guards=guards, law=ready.law.prepare(benchmark, ready))

    def frozen(self, benchmark, coefficients):
        """The same feedforward with coefficients (n, m) or (n, m, T) that stay."""
        ready = self.prepare(benchmark)
        return FrozenFeedforward(
            jnp.asarray(coefficients, dtype=float), ready.estimator, self.regressor, self.joint,
            ready.law,
        )  # fmt: skip

    def init(self, trials):
        zero = jnp.zeros(trials)
        start = tuple(tuple(jnp.broadcast_to(c, (trials,)) for c in row) for row in self.start)
        return {
            "coefficients": start,
            "fits": tuple(self.fit.init(part, trials) for part in self.parts),
            "guards": tuple(
                tuple(guard.init(part, trials) for guard in self.guards) for part in self.parts
            ),
            # What the regressors remember of the strokes that are learnt from, of those that leave
            # the fit's memory, and of the targets.
            "taught": self.init_taught(trials),
            "leaving": self.regressor.init(trials, self.actuators) if self.fit.memory else (),
            "target": self.regressor.init(trials, self.actuators),
            "command": (zero,) * self.actuators,
            "heard": self.low_pass.init((self.actuators, trials)) if self.low_pass else (),
            # Fits that were not used so far.
            "held": zero,
        }

    def init_taught(self, trials: int):
        """What is remembered of the strokes that are learnt from."""
        memory = self.low_pass.init((self.actuators, trials)) if self.low_pass else ()
        return memory, self.regressor.init(trials, self.actuators)

    def taught(self, before, x_m: jax.Array, x_hat: jax.Array):
        """What a sample's strokes teach.

        Args:
            before: what was remembered, at first from ``init_taught``.
            x_m, x_hat: (m, T) x_m(k), x_hat(k).

        Returns:
            what to remember; (m, T) strokes [mm]; for each its regressors (T,).
        """
        memory, past = before
        strokes = x_m if self.learns_from == "measurement" else x_hat
        if self.low_pass:
            memory, strokes = self.low_pass.step(memory, strokes)
        past, phi = self.regressor.step(past, strokes)
        return (memory, past), strokes, phi

    def delay_line(self, trials):
        if not self.fit.memory:
            return None
        return DelayLine(self.fit.memory, jnp.zeros((2 * self.actuators, trials)), self.renew)

    def renew(self, state):
        """The state after as many samples as the delay line is long."""
        return state | {"fits": tuple(self.fit.renew(one) for one in state["fits"])}

    def step(self, state, seen):
        taught, strokes, phi = self.taught(state["taught"], seen.x_m, seen.x_hat)
        left, leaving, phi_leaving = seen.delayed, (), None
        if self.fit.memory:
            leaving, phi_leaving = self.regressor.step(state["leaving"], left[: self.actuators])
        target, phi_target = self.regressor.step(state["target"], seen.x_a)

        # u(k-1) is the last command that the strokes at k can have felt.
        applied, heard = state["command"], ()
        if self.low_pass:
            heard, filtered = self.low_pass.step(state["heard"], jnp.stack(applied))
            applied = tuple(filtered)
        due = self.fit.due(seen.k, self.regressor.reach)
        columns, fits, guards, held = [], [], [], state["held"]
        for part in self.parts:
            pair = Pair(seen.k, seen.dt, self._of(part, phi), [applied[i] for i in part.sides])
            if phi_leaving is not None:
                values = [left[self.actuators + i] for i in part.sides]
                pair = replace(pair, phi_leaving=self._of(part, phi_leaving), values_leaving=values)
            found, fit, guard, held = self._identify(state, part, pair, due, held)
            columns.append(found)
            fits.append(fit)
            guards.append(guard)
        coefficients = tuple(sum(rows, ()) for rows in zip(*columns, strict=True))
        u = command(self.law, coefficients, phi_target, self.joint)
        state = {
            "coefficients": coefficients,
            "fits": tuple(fits),
            "guards": tuple(guards),
            "taught": taught,
            "leaving": leaving,
            "target": target,
            "command": u,
            "heard": heard,
            "held": held,
        }
        record = jnp.concatenate([strokes, jnp.stack(applied)]) if self.fit.memory else None
        signals = {"C_A": jnp.stack([jnp.stack(row) for row in coefficients]), "held": held}
        return state, Decision(u=jnp.stack(u), record=record, signals=signals)

    def _of(self, part: Part, phi) -> tuple:
        """A part's regressors from those of all strokes."""
        return sum(phi, ()) if self.joint else phi[part.number]

    def _identify(self, state, part: Part, pair: Pair, due, held):
        """A part's coefficients after a pair, the states of its fit and guards, fits held."""
        last = tuple(tuple(row[i] for i in part.sides) for row in state["coefficients"])
        before = state["fits"][part.number]
        seen = tuple(
            guard.look(own, part, pair)
            for guard, own in zip(self.guards, state["guards"][part.number], strict=True)
        )
        weigh = lambda rows: reduce(lambda r, g: g.weigh(part, r, last), self.guards, rows)  # noqa: E731
        learnt, fitted = self.fit.step(before, part, pair, last, weigh)
        fitted = replace(fitted, coefficients=tuple(map(tuple, fitted.coefficients)))
        answers = [g.trusts(own, part, fitted) for g, own in zip(self.guards, seen, strict=True)]
        answers = [answer for answer in answers if answer is not None]
        use = due
        if answers:
            good = reduce(jnp.logical_and, answers)
            held = held + jnp.where(due & ~good, 1.0, 0.0)
            use = due & good
        proposed = reduce(lambda c, g: g.cut(part, c, last), self.guards, fitted.coefficients)
        return choose(use, proposed, last), self.fit.keep(use, learnt, before), seen, held


def follow_target(columns: int, joint: bool, actuators: int = ACTUATORS) -> np.ndarray:
    """(n, m) coefficients that do nothing, u = x_a, where the first regressor is the stroke.

    Arguments as of ``parts_of``.
    """
    parts = parts_of(columns, joint, actuators)
    nothing = np.zeros((parts[0].unknowns, actuators))
    for part in parts:
        for row, side in zip(part.values, part.sides, strict=True):
            nothing[row, side] = 1.0
    return nothing


def _begins_with_stroke(regressor: Regressor) -> bool:
    first = regressor.matrix[0]
    return first[0] == 1 and not first[1:].any()
