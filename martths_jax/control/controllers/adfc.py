"""Adaptive discrete feedforward controller (Calayir, Tao & Mercan 2025).

The inverse of the plant is modelled as u = C_A' phi, where phi holds value and first three
derivatives of both strokes, taken as backward differences.  C_A is the least-squares fit of the
last N_b pairs (phi of the estimated strokes, command that caused them); the command then is the
same model applied to the target strokes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.algebra import least_squares as ls
from martths_jax.control.adaptive.differences import BACKWARD_DIFFERENCES, TAPS, regress
from martths_jax.control.adaptive.inverse import nominal_inverse
from martths_jax.control.base import Controller, Decision, DelayLine, Signal
from martths_jax.control.controllers.frozen import FrozenFeedforward
from martths_jax.control.entry import Derived, Entry, Parameter
from martths_jax.control.estimators import design_kalman
from martths_jax.errors import argument_error, raise_all
from martths_jax.resources import available_memory

#: Coefficients that do nothing: u follows x_a.
FOLLOW_TARGET = np.zeros((8, 2))
FOLLOW_TARGET[0, 0] = FOLLOW_TARGET[4, 1] = 1.0
#: Pull towards the inverse plant that keeps every trial (docs/guarded_adfc.md has the evidence)
#: [mm^2].
GUARD_PULL = 6e-5
#: What a fit can be pulled towards.
ANCHORS = ("start", "inverse")
#: A fit whose normal matrix is worse conditioned is not used (the paper's bound).
CONDITION_LIMIT = 1e14
#: Memory of a row of the buffer for trials side by side, with the inputs of a window [bytes].
NB_BYTES = 8 * 8 * 128


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class ADFC(Controller):
    """Adaptive feedforward by sliding least squares.

    Attributes:
        nb: buffer length N_b, rows in the fit.
        no: overlap N_o of successive fits; a new C_A comes every N_b - N_o samples.
        pull: weight lambda of the pull towards given coefficients, added to the normal matrix in
            scaled derivatives [mm^2]; 0 is the paper's literal least squares.  None, the default,
            is the guarded controller: ``GUARD_PULL`` towards the inverse of the nominal plant, see
            docs/guarded_adfc.md.
        q: process noise of the Kalman filter [mm^2].
        start: (8, 2) coefficients C_0 until the buffer is full; None follows the target (u = x_a).
        towards: what `pull` pulls to: ``start``, or ``inverse``, the inverse of the nominal plant
            (``nominal_inverse``); None is ``start`` if a pull is given, else ``inverse``.
        anchor: (8, 2) coefficients of one's own to pull to, instead of those.
        solver: ``ldl`` (unrolled, fast) or ``lu`` (``jnp.linalg.solve``, the reference).
        estimator: the Kalman filter, designed by ``prepare``.

    Scalars may be given as arrays over trials (T,), `start` and `anchor` as (8, 2, T).  A fit whose
    normal matrix is singular or worse conditioned than 1e14 leaves the last good coefficients in
    place; ``Result.counts["held"]`` is their number.
    """

    nb: int = field(default=1024, metadata={"static": True})
    no: jax.Array | int = 1023
    pull: jax.Array | float | None = None
    q: jax.Array | float = 3e-5
    start: jax.Array | None = None
    towards: str | None = field(default=None, metadata={"static": True})
    anchor: jax.Array | None = None
    solver: str = field(default="ldl", metadata={"static": True})
    estimator: Any = None

    name = "adfc"
    adapts = True
    signals = (
        Signal("C_A", ("coefficient", "actuator"), "1",
               "adaptive coefficients in scaled derivatives", elements=tuple(
                   f"u{actuator}: x{stroke}" + "'" * order
                   for stroke in (1, 2) for order in range(4) for actuator in (1, 2))),
        Signal("held", (), "1", "fits that the controller did not use", count=True),
    )  # fmt: skip
    shared_axes = MappingProxyType({"no": 0, "pull": 0, "q": 0, "start": 2, "anchor": 2})

    def __post_init__(self):
        numbers = (self.no, 0 if self.pull is None else self.pull, self.q)
        if all(type(x) in (int, float) for x in numbers):  # not when JAX rebuilds it from leaves
            raise_all(self.problems(None), "The controller cannot be used")

    def problems(self, benchmark):
        found = []

        def expect(good, name, wanted, got):
            if not good:
                found.append(str(argument_error(name, wanted, got)))

        def known(value):
            # A traced value has none yet; it is the caller's to keep in range.
            given = value is not None and not isinstance(value, jax.core.Tracer)
            return np.asarray(value) if given else None

        nb, no, pull, q = self.nb, known(self.no), known(self.pull), known(self.q)
        whole = isinstance(nb, (int, np.integer))
        expect(whole and nb >= 9, "nb", "be a whole number of at least 9 (8 unknowns)", nb)
        if whole:
            room = int(available_memory() / 2 / NB_BYTES)
            expect(nb <= room, "nb", f"be at most {room}, whose rows fit into memory", nb)
        if whole and no is not None:
            expect(np.all((no >= 0) & (no <= nb - 1)), "no", f"lie in [0, nb - 1 = {nb - 1}]", no)
        if pull is not None:
            good = np.all(np.isfinite(pull) & (pull >= 0))
            expect(good, "pull", "be zero or positive (mm^2)", pull)
        if q is not None:
            expect(np.all(np.isfinite(q) & (q > 0)), "q", "be positive (mm^2)", q)
        expect(self.towards in (None, *ANCHORS), "towards", f"be one of {ANCHORS}", self.towards)
        expect(self.solver in ls.SOLVERS, "solver", f"be one of {sorted(ls.SOLVERS)}", self.solver)
        for name in ("start", "anchor"):
            value = known(getattr(self, name))
            if value is None or value.dtype == object:
                continue
            good = value.shape[:2] == (8, 2) and value.ndim in (2, 3)
            expect(good, name, "be (8, 2)", f"shape {value.shape}")
            expect(np.all(np.isfinite(value)), name, "be finite", "NaN or infinity")
        return found

    def prepare(self, benchmark):
        start = FOLLOW_TARGET if self.start is None else self.start
        towards = self.towards or ("inverse" if self.pull is None else "start")
        anchor = self.anchor
        if anchor is None and towards == "start":
            anchor = start
        elif anchor is None:
            anchor = nominal_inverse(benchmark.plant_model, benchmark.fs, BACKWARD_DIFFERENCES)
        return replace(
            self,
            no=jnp.asarray(self.no),
            pull=jnp.asarray(GUARD_PULL if self.pull is None else self.pull, dtype=float),
            start=jnp.asarray(start, dtype=float),
            anchor=jnp.asarray(anchor, dtype=float),
            estimator=design_kalman(benchmark.plant_model, self.q, benchmark.r_mm2),
        )

    def frozen(self, benchmark, coefficients):
        """The same feedforward with (8, 2) or (8, 2, T) coefficients that stay."""
        estimator = self.prepare(benchmark).estimator
        return FrozenFeedforward(jnp.asarray(coefficients, dtype=float), estimator)

    def init(self, trials):
        zero = jnp.zeros(trials)
        taps = ((zero,) * (TAPS - 1),) * 2
        start = tuple(tuple(jnp.broadcast_to(c, (trials,)) for c in row) for row in self.start)
        return {
            "coefficients": start,
            # Normal equations of all rows in the buffer, and of those of this window alone.
            "rows": ls.zeros(8, 2, trials),
            "new": ls.zeros(8, 2, trials),
            # Backward differences of order 0 to 3, see ``regress``, of both estimates, of the
            # estimates N_b samples ago, and of both targets.
            "estimate": taps,
            "leaving": taps,
            "target": taps,
            "command": (zero, zero),
            # Fits that were not used so far.
            "held": zero,
        }

    def delay_line(self, trials):
        return DelayLine(self.nb, jnp.zeros((4, trials)), self.renew)

    def step(self, state, seen):
        left = seen.delayed
        estimate, phi = regress(state["estimate"], seen.estimate_mm)
        leaving, phi_leaving = regress(state["leaving"], left[:2])
        target, phi_target = regress(state["target"], seen.target_mm)

        # u(k-1) is the last command that the estimate at k can have felt.
        applied = state["command"]
        new = ls.add_observation(state["new"], phi, applied)
        rows = ls.exchange_observation(state["rows"], phi, applied, phi_leaving, left[2:])
        # The first fit waits until no row in the buffer reaches back before the first sample.
        since_full, hop = seen.k - (self.nb + TAPS - 1), self.nb - self.no
        due = (since_full >= 0) & (since_full % hop == 0)
        normal = ls.pulled(rows, self.pull, self.anchor)
        fitted, tolerance = ls.SOLVERS[self.solver](normal)
        good = tolerance >= 1 / CONDITION_LIMIT  # false for NaN
        held = state["held"] + jnp.where(due & ~good, 1.0, 0.0)
        coefficients = choose(due & good, fitted, state["coefficients"])
        command = tuple(
            sum(c[i] * p for c, p in zip(coefficients, phi_target, strict=True)) for i in range(2)
        )
        state = {
            "coefficients": coefficients,
            "rows": rows,
            "new": new,
            "estimate": estimate,
            "leaving": leaving,
            "target": target,
            "command": command,
            "held": held,
        }
        decision = Decision(
            command_mm=jnp.stack(command),
            record=jnp.concatenate([seen.estimate_mm, jnp.stack(applied)]),
            signals={"C_A": jnp.stack([jnp.stack(row) for row in coefficients]), "held": held},
        )
        return state, decision

    @staticmethod
    def renew(state):
        """The fresh sum of the rows in the delay line replaces the sliding sum.

        Adding and subtracting rows for ever would let round-off grow with the record; here every
        sum is at most two lengths of the line old.
        """
        return state | {"rows": state["new"], "new": jax.tree.map(jnp.zeros_like, state["new"])}


def _overlap(nb: int, value: float) -> int:
    return min(math.floor(value * nb + 0.5), nb - 1)


def _follow(own, changed) -> dict:
    """A fit every sample stays one; a pull that moves still goes where the default's goes."""
    found = {}
    if "nb" in changed and "no" not in changed:
        every = own["no"] == own["nb"] - 1
        found["no"] = changed["nb"] - 1 if every else own["no"]
    if "pull" in changed and not own["towards"]:
        found["towards"] = "inverse" if own["pull"] is None else "start"
    return found


def _clash(own) -> list[str]:
    nb, no = own["nb"], own["no"]
    if 0 <= no <= nb - 1:
        return []
    return [f"No = {no} (hop {nb - no}) must lie in 0 ... {nb - 1}."]


ENTRY = Entry(
    name="adfc",
    controller=ADFC,
    label="ADFC",
    paper="Calayir, Tao & Mercan 2025, Actuators 14(11), 525",
    parameters=(
        Parameter("nb", "Nb", "buffer length", 1024, "samples", 9, whole=True, kind="static"),
        Parameter("no", "No", "overlap", 1023, "samples", 0, whole=True),
        Parameter("pull", "lambda", "pull", None, "mm^2", 0.0, kind="tunable", axis="lambda"),
        Parameter("q", "q", "process noise", 3e-5, "mm^2", 0.0, above=True, kind="tunable"),
        Parameter("towards", "", "what the pull goes to", None, choices=ANCHORS, kind="static"),
        Parameter("solver", "", "solver", "ldl", choices=tuple(ls.SOLVERS), kind="static"),
    ),
    derived=(
        # A fraction of 1 is every sample, No = Nb - 1.
        Derived("no_fraction", "no", lambda v, own, fs: _overlap(own["nb"], v),
                "overlap No / Nb", "1", 0.0, 1.0),
        Derived("hop", "no", lambda v, own, fs: own["nb"] - int(v),
                "hop Nb - No", "samples", 1, whole=True,
                of_cell=lambda own, fs: own["nb"] - own["no"]),
        Derived("fb", "no", lambda v, own, fs: own["nb"] - math.floor(fs / v + 0.5),
                "update rate f_b", "Hz", 0.0, above=True,
                of_cell=lambda own, fs: fs / (own["nb"] - own["no"])),
    ),
    tuned=(
        Parameter("pull", "lambda", "pull", GUARD_PULL, "mm^2", 0.0, above=True),
        Parameter("q", "q", "process noise", 3e-5, "mm^2", 0.0, above=True),
    ),
    traced=lambda benchmark, **values: ADFC(towards="inverse", **values).prepare(benchmark),
    settings_from=lambda values: {**values, "towards": "inverse"},
    follow=_follow,
    clash=_clash,
    look=1,
)  # fmt: skip


def choose(use, new, old):
    """`new` where `use` (T,), else `old`: rows of coefficients, two arrays (T,) each."""
    return tuple(
        tuple(jnp.where(use, a, b) for a, b in zip(*rows, strict=True))
        for rows in zip(new, old, strict=True)
    )
