"""Adaptive discrete feedforward controller (Calayir, Tao & Mercan 2025).

The inverse of the plant is modelled as u = C_A' phi, where phi holds value and first three
derivatives of both strokes, taken as backward differences.  C_A is the least-squares fit of the
last N_b pairs (phi of the estimated strokes, command that caused them); the command then is the
same model applied to the target strokes.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.controllers import least_squares as ls
from martths_jax.controllers.base import Controller, Decision
from martths_jax.errors import InputError, argument_error
from martths_jax.kalman import design_kalman

#: Backward differences of second order for value and dt^j times the j-th derivative, from
#: samples k, k-1, ..., k-4 (the paper's C_D, scaled so that the columns stay comparable).
BACKWARD_DIFFERENCES = np.array(
    [
        [1.0, 0.0, 0.0, 0.0, 0.0],
        [1.5, -2.0, 0.5, 0.0, 0.0],
        [2.0, -5.0, 4.0, -1.0, 0.0],
        [2.5, -9.0, 12.0, -7.0, 1.5],
    ]
)
TAPS = BACKWARD_DIFFERENCES.shape[1]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class ADFC(Controller):
    """Adaptive feedforward by sliding least squares.

    Attributes:
        nb: buffer length N_b, rows in the fit.
        no: overlap N_o of successive fits; a new C_A comes every N_b - N_o samples.
        pull: weight lambda of the pull towards the start coefficients, added to the normal matrix
            in scaled derivatives [mm^2]; 0 is the paper's literal least squares.
        q: process noise of the Kalman filter [mm^2].
        start: (8, 2) coefficients C_0 until the buffer is full; None follows the target (u = x_a).
        solver: ``ldl`` (unrolled, fast) or ``lu`` (``jnp.linalg.solve``, the reference).
        estimator: the Kalman filter, designed by ``prepare``.

    Scalars may be given as arrays over trials (T,).
    """

    nb: int = field(default=1024, metadata={"static": True})
    no: jax.Array | int = 1023
    pull: jax.Array | float = 1e-5
    q: jax.Array | float = 3e-5
    start: jax.Array | None = None
    solver: str = field(default="ldl", metadata={"static": True})
    estimator: Any = None

    name = "adfc"

    def __post_init__(self):
        numbers = (self.no, self.pull, self.q)
        if all(type(x) in (int, float) for x in numbers):  # not when JAX rebuilds it from leaves
            problems = self.problems(None)
            if problems:
                raise InputError(problems[0])

    @property
    def window(self) -> int:
        return self.nb

    def problems(self, benchmark):
        found = []

        def expect(good, name, wanted, got):
            if not good:
                found.append(str(argument_error(name, wanted, got)))

        def known(value):
            # A traced value has none yet; it is the caller's to keep in range.
            return None if isinstance(value, jax.core.Tracer) else np.asarray(value)

        nb, no, pull, q = self.nb, known(self.no), known(self.pull), known(self.q)
        whole = isinstance(nb, (int, np.integer))
        expect(whole and nb >= 9, "nb", "be a whole number of at least 9 (8 unknowns)", nb)
        if whole and no is not None:
            expect(np.all((no >= 0) & (no <= nb - 1)), "no", f"lie in [0, nb - 1 = {nb - 1}]", no)
        if pull is not None:
            good = np.all(np.isfinite(pull) & (pull >= 0))
            expect(good, "pull", "be zero or positive (mm^2)", pull)
        if q is not None:
            expect(np.all(np.isfinite(q) & (q > 0)), "q", "be positive (mm^2)", q)
        expect(self.solver in ls.SOLVERS, "solver", f"be one of {sorted(ls.SOLVERS)}", self.solver)
        if self.start is not None:
            shape = np.shape(self.start)
            expect(shape[:2] == (8, 2) and len(shape) in (2, 3), "start", "be (8, 2)", shape)
        return found

    def prepare(self, benchmark):
        start = self.start
        if start is None:
            start = np.zeros((8, 2))
            start[0, 0] = start[4, 1] = 1.0
        start = jnp.asarray(start, dtype=float)
        return replace(
            self,
            no=jnp.asarray(self.no),
            pull=jnp.asarray(self.pull, dtype=float),
            start=start,
            estimator=design_kalman(benchmark.plant_model, self.q, benchmark.r_mm2),
        )

    def init(self, trials):
        zero = jnp.zeros(trials)
        taps = ((zero,) * (TAPS - 1),) * 2
        return {
            "coefficients": tuple(
                tuple(jnp.broadcast_to(c, (trials,)) for c in row) for row in self.start
            ),
            # Normal equations of the rows of the last window that are still in the buffer, and of
            # the rows of this window.
            "old": ls.zeros(8, 2, trials),
            "new": ls.zeros(8, 2, trials),
            # Four samples before this one of both estimates, of the estimates N_b samples ago, and
            # of both targets.
            "estimate": taps,
            "leaving": taps,
            "target": taps,
            "command": (zero, zero),
        }

    def blank_record(self, trials):
        return jnp.zeros((4, trials))

    def step(self, state, seen):
        left = seen.delayed
        estimate, phi = regress(state["estimate"], seen.estimate_mm)
        leaving, phi_leaving = regress(state["leaving"], left[:2])
        target, phi_target = regress(state["target"], seen.target_mm)

        # u(k-1) is the last command that the estimate at k can have felt.
        applied = state["command"]
        new = ls.add_observation(state["new"], phi, applied)
        old = ls.add_observation(state["old"], phi_leaving, left[2:], sign=-1.0)
        # The first fit waits until no row in the buffer reaches back before the first sample.
        since_full, hop = seen.k - (self.nb + TAPS - 1), self.nb - self.no
        due = (since_full >= 0) & (since_full % hop == 0)
        fitted = ls.SOLVERS[self.solver](ls.pulled(ls.add(old, new), self.pull, self.start))
        coefficients = tuple(
            tuple(jnp.where(due, a, b) for a, b in zip(*rows, strict=True))
            for rows in zip(fitted, state["coefficients"], strict=True)
        )
        command = tuple(
            sum(c[i] * p for c, p in zip(coefficients, phi_target, strict=True)) for i in range(2)
        )
        state = {
            "coefficients": coefficients,
            "old": old,
            "new": new,
            "estimate": estimate,
            "leaving": leaving,
            "target": target,
            "command": command,
        }
        decision = Decision(
            command_mm=jnp.stack(command),
            record=jnp.concatenate([seen.estimate_mm, jnp.stack(applied)]),
            signals={"C_A": jnp.stack([jnp.stack(row) for row in coefficients])},
        )
        return state, decision

    def turn(self, state):
        """Start a new window: the fresh sum of its rows replaces the sliding difference.

        Adding and subtracting rows for ever would let round-off grow with the record; here every
        sum is at most two windows old.
        """
        return state | {"old": state["new"], "new": jax.tree.map(jnp.zeros_like, state["new"])}


def regress(before, newest: jax.Array):
    """Regressor phi = [C_D x_1, C_D x_2] and the samples to remember for the next one.

    Args:
        before: for each actuator, its last four samples (T,), newest first.
        newest: (2, T) this sample.

    Returns:
        for each actuator, its four newest samples; phi as eight arrays (T,).
    """
    phi, kept = [], []
    for actuator in range(2):
        taps = (newest[actuator], *before[actuator])
        phi += [
            sum(c * x for c, x in zip(row, taps, strict=True) if c) for row in BACKWARD_DIFFERENCES
        ]
        kept.append(taps[:-1])
    return tuple(kept), phi
