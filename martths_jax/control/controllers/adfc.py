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
from martths_jax.control.adaptive.arguments import known
from martths_jax.control.adaptive.base import ACTUATORS
from martths_jax.control.adaptive.differences import BackwardDifferences
from martths_jax.control.adaptive.guards import ConditionGate, Pull
from martths_jax.control.adaptive.inverse import nominal_inverse
from martths_jax.control.adaptive.window import Window
from martths_jax.control.base import Controller
from martths_jax.control.controllers.feedforward import (
    SIGNALS,
    AdaptiveFeedforward,
    follow_target,
)
from martths_jax.control.entry import Derived, Entry, Parameter
from martths_jax.control.estimators import design_kalman
from martths_jax.errors import argument_error, raise_all

#: Value and three derivatives of both strokes.
REGRESSOR = BackwardDifferences(order=3, accuracy=2)
#: Coefficients that do nothing: u follows x_a.
#: Pull towards the inverse plant that keeps every trial (docs/guarded_adfc.md has the evidence)
#: [mm^2].
GUARD_PULL = 6e-5
#: What a fit can be pulled towards.
ANCHORS = ("start", "inverse")
#: A fit whose normal matrix is worse conditioned is not used (the paper's bound).
CONDITION_LIMIT = 1e14


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
        actuators: number m of strokes, by ``prepare``; with other than two, 8 is 4 m and 2 is m.

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
    actuators: int = field(default=ACTUATORS, metadata={"static": True})

    name = "adfc"
    adapts = True
    signals = SIGNALS
    shared_axes = MappingProxyType({"no": 0, "pull": 0, "q": 0, "start": 2, "anchor": 2})

    def __post_init__(self):
        numbers = (self.no, 0 if self.pull is None else self.pull, self.q)
        if all(type(x) in (int, float) for x in numbers):  # not when JAX rebuilds it from leaves
            raise_all(self.problems(None), "The controller cannot be used")

    def composed(self) -> AdaptiveFeedforward:
        """The same controller as pieces."""
        return AdaptiveFeedforward(
            regressor=REGRESSOR,
            fit=Window(self.nb, self.no, self.solver),
            guards=(Pull(self.pull, self.anchor), ConditionGate(CONDITION_LIMIT)),
            start=self.start,
            q=self.q,
            estimator=self.estimator,
            actuators=self.actuators,
        )

    def problems(self, benchmark):
        whole = self.composed().sized(benchmark)
        found = whole.fit.problems(whole)

        def expect(good, name, wanted, got):
            if not good:
                found.append(str(argument_error(name, wanted, got)))

        pull, q = known(self.pull), known(self.q)
        if pull is not None:
            good = np.all(np.isfinite(pull) & (pull >= 0))
            expect(good, "pull", "be zero or positive (mm^2)", pull)
        if q is not None:
            expect(np.all(np.isfinite(q) & (q > 0)), "q", "be positive (mm^2)", q)
        expect(self.towards in (None, *ANCHORS), "towards", f"be one of {ANCHORS}", self.towards)
        for name in ("start", "anchor"):
            value = known(getattr(self, name))
            if value is None or value.dtype == object:
                continue
            shape = whole.parts[0].unknowns, whole.actuators
            good = value.shape[:2] == shape and value.ndim in (2, 3)
            expect(good, name, f"be {shape}", f"shape {value.shape}")
            expect(np.all(np.isfinite(value)), name, "be finite", "NaN or infinity")
        return found

    def prepare(self, benchmark):
        own = self.composed().sized(benchmark)
        start = follow_target(*own.sizes) if self.start is None else self.start
        towards = self.towards or ("inverse" if self.pull is None else "start")
        anchor = self.anchor
        if anchor is None and towards == "start":
            anchor = start
        elif anchor is None:
            anchor = nominal_inverse(benchmark.plant_model, benchmark.fs, REGRESSOR.matrix)
        return replace(
            self,
            no=jnp.asarray(self.no),
            pull=jnp.asarray(GUARD_PULL if self.pull is None else self.pull, dtype=float),
            start=jnp.asarray(start, dtype=float),
            anchor=jnp.asarray(anchor, dtype=float),
            estimator=design_kalman(benchmark.plant_model, self.q, benchmark.r_mm2),
            actuators=own.actuators,
        )

    def frozen(self, benchmark, coefficients):
        """The same feedforward with (8, 2) or (8, 2, T) coefficients that stay."""
        return self.prepare(benchmark).composed().frozen(benchmark, coefficients)

    def init(self, trials):
        return self.composed().init(trials)

    def delay_line(self, trials):
        return self.composed().delay_line(trials)

    def step(self, state, seen):
        return self.composed().step(state, seen)


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
        Parameter("pull", "lambda", "pull", None, "mm^2", 0.0, kind="tunable"),
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
    traced=lambda benchmark, **values: ADFC(**{"towards": "inverse"} | values).prepare(benchmark),
    settings_from=lambda values: {"towards": "inverse"} | values,
    follow=_follow,
    clash=_clash,
    look=1,
)  # fmt: skip
