"""ADFC whose buffer weighs newer rows more.

    C(k) = (sum w phi phi' + lambda I)^-1 (sum w phi u' + lambda C_n),  w = mu^age,  age < N_b

u, phi and the coefficients are those of Calayir, Tao & Mercan 2025, whose fit is mu = 1; C_n is the
inverse of the nominal plant.  It forgets softly like recursive least squares, and wholly like the
buffer.  The weights are ours: the paper has none.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax

from martths_jax.control.adaptive.guards import ConditionGate, Pull
from martths_jax.control.adaptive.inverse import nominal_inverse
from martths_jax.control.adaptive.weighted import WeightedWindow
from martths_jax.control.controllers.adfc import CONDITION_LIMIT, GUARD_PULL, REGRESSOR
from martths_jax.control.controllers.feedforward import AdaptiveFeedforward
from martths_jax.control.entry import Entry, Parameter

#: Weight of the oldest row of the buffer.
LAST = 0.1


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class WeightedADFC(AdaptiveFeedforward):
    """Pieces of ``AdaptiveFeedforward`` as ADFC takes them, rows weighted; see ``design``."""

    name = "adfc-weighted"

    @classmethod
    def design(
        cls,
        benchmark,
        *,
        nb: int = 1024,
        last: float = LAST,
        pull: float = GUARD_PULL,
        q: float = 3e-5,
    ) -> WeightedADFC:
        """The controller, fitted every sample and pulled to the inverse of the nominal plant.

        Args:
            benchmark: gives the sampling rate, the nominal plant and the sensor noise.
            nb: buffer length N_b [samples].
            last: weight of a row that leaves, mu^N_b; 1 is ADFC.
            pull: lambda [mm^2].
            q: process noise of the Kalman filter [mm^2].
        """
        anchor = nominal_inverse(benchmark.plant_model, benchmark.fs, REGRESSOR.matrix)
        return cls(
            regressor=REGRESSOR,
            fit=WeightedWindow(nb, forgetting=last ** (1.0 / nb)),
            guards=(Pull(pull, anchor), ConditionGate(CONDITION_LIMIT)),
            q=q,
        )


ENTRY = Entry(
    name="adfc-weighted",
    controller=WeightedADFC,
    make=WeightedADFC.design,
    label="ADFC weighted",
    paper="Calayir, Tao & Mercan 2025, with rows that count less as they age",
    parameters=(
        Parameter("nb", "Nb", "buffer length", 1024, "samples", 9, whole=True, kind="static"),
        Parameter("last", "mu^Nb", "weight of the oldest row", LAST, "1", 0.0, 1.0, above=True),
        Parameter("pull", "lambda", "pull", GUARD_PULL, "mm^2", 0.0, above=True, kind="tunable"),
        Parameter("q", "q", "process noise", 3e-5, "mm^2", 0.0, above=True, kind="tunable"),
    ),
)  # fmt: skip
