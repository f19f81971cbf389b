"""ADFC whose fit forgets step by step instead of dropping what is older than a buffer.

    C(k) = (G + lambda I)^-1 (h + lambda C_n),  G = sum mu^age phi phi',  h = sum mu^age phi u'

u, phi and the coefficients are those of Calayir, Tao & Mercan 2025; C_n is the inverse of the
nominal plant.  This is recursive least squares with forgetting factor mu, written as normal
equations: for lambda = 0 they give the same C as P = (P - g phi' P) / mu, and cannot wind up where
nothing moves, since G then fades and the pull takes over.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax

from martths_jax.control.adaptive.fading import Fading
from martths_jax.control.adaptive.guards import ConditionGate, Pull
from martths_jax.control.adaptive.inverse import nominal_inverse
from martths_jax.control.controllers.adfc import CONDITION_LIMIT, GUARD_PULL, REGRESSOR
from martths_jax.control.controllers.feedforward import AdaptiveFeedforward
from martths_jax.control.entry import Entry, Parameter

#: Samples 1 / (1 - mu) that the fit remembers: as many as ADFC's buffer holds.
MEMORY = 1024.0


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class RecursiveADFC(AdaptiveFeedforward):
    """Pieces of ``AdaptiveFeedforward`` as ADFC takes them, with a fading fit; see ``design``."""

    name = "adfc-rls"

    @classmethod
    def design(
        cls,
        benchmark,
        *,
        memory: float = MEMORY,
        pull: float = GUARD_PULL,
        wait: int = 1024,
        q: float = 3e-5,
    ) -> RecursiveADFC:
        """The controller, pulled to the inverse of the nominal plant.

        Args:
            benchmark: gives the sampling rate, the nominal plant and the sensor noise.
            memory: 1 / (1 - mu), samples that the fit remembers; above the 8 unknowns.
            pull: lambda [mm^2].
            wait: samples that u = x_a runs for before the first fit is used, ADFC's N_b by default.
            q: process noise of the Kalman filter [mm^2].
        """
        anchor = nominal_inverse(benchmark.plant_model, benchmark.fs, REGRESSOR.matrix)
        return cls(
            regressor=REGRESSOR,
            fit=Fading(1.0 - 1.0 / memory, wait=int(wait)),
            guards=(Pull(pull, anchor), ConditionGate(CONDITION_LIMIT)),
            q=q,
        )


ENTRY = Entry(
    name="adfc-rls",
    controller=RecursiveADFC,
    make=RecursiveADFC.design,
    label="ADFC-RLS",
    paper="Calayir, Tao & Mercan 2025, with recursive least squares instead of a buffer",
    parameters=(
        Parameter("memory", "1/(1-mu)", "memory of the fit", MEMORY, "samples", 9.0,
                  kind="tunable"),
        Parameter("pull", "lambda", "pull", GUARD_PULL, "mm^2", 0.0, above=True, kind="tunable"),
        Parameter("wait", "", "samples before the first fit", 1024, "samples", 0, whole=True,
                  kind="static"),
        Parameter("q", "q", "process noise", 3e-5, "mm^2", 0.0, above=True, kind="tunable"),
    ),
)  # fmt: skip
