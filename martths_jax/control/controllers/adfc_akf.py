"""ADFC behind a Kalman filter that finds the sensors' noise by itself.

Regressor, fit, guard and command are those of Calayir, Tao & Mercan 2025; the strokes that it
learns from, and that the force is made from, come from ``estimators.adaptive``, whose memory is
tuned together with the filter's process noise and the fit's pull.  Where the noise is as the
benchmark says nothing is gained.  It is for a rig whose noise is not known: with ten times the
amplitude on 64 plants the median J2true is 1.8 and 1.9 %, where ADFC has 3.4 and 2.9 %.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType

import jax
import jax.numpy as jnp

from martths_jax.control.adaptive.arguments import complaint, known
from martths_jax.control.base import Signal
from martths_jax.control.controllers.adfc import ADFC
from martths_jax.control.controllers.adfc import ENTRY as OF_ADFC
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.estimators.adaptive import AdaptiveKalmanFilter, design_adaptive

#: Memory of the innovations' mean square: r within 1.6 % of itself [samples].
MEMORY = 4096.0


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class AdaptiveFilterADFC(ADFC):
    """``ADFC`` with an ``AdaptiveKalmanFilter``.

    Attributes:
        memory: M, samples that the mean square of the innovations remembers.
        adapt: whether the noise is adapted; False is ``ADFC`` itself.
        r: variance of the sensors' noise at first, from ``prepare`` [mm^2].

    The other attributes are those of ``ADFC``.
    """

    memory: jax.Array | float = MEMORY
    adapt: bool = field(default=True, metadata={"static": True})
    r: jax.Array | None = None

    actuators_needed = 2
    name = "adfc-akf"
    signals = (*ADFC.signals, Signal("r_hat", (), "mm^2", "variance of the sensors' noise"))
    shared_axes = MappingProxyType({**ADFC.shared_axes, "memory": 0, "r": 0})

    def problems(self, benchmark):
        memory = known(self.memory)
        good = memory is None or memory > 1
        return [
            *super().problems(benchmark),
            *complaint(good, "memory", "be above 1 (samples)", f"{self.memory!r:.80}"),
        ]

    def prepare(self, benchmark):
        ready = super().prepare(benchmark)
        memory, r = (jnp.asarray(x, dtype=float) for x in (self.memory, benchmark.r_mm2))
        if self.adapt:
            own = design_adaptive(benchmark.plant_model, self.q, benchmark.r_mm2, memory)
            ready = replace(ready, estimator=own)
        return replace(ready, memory=memory, r=r)

    def frozen(self, benchmark, coefficients):
        """Coefficients that stay, behind the filter of the noise that it starts from."""
        still = replace(self, adapt=False).prepare(benchmark)
        return still.composed().frozen(benchmark, coefficients)

    def step(self, state, seen):
        state, decision = super().step(state, seen)
        if isinstance(self.estimator, AdaptiveKalmanFilter):
            r = self.estimator.noise(seen.state)
        else:
            r = jnp.broadcast_to(self.r, seen.x_a.shape[1:])
        return state, replace(decision, signals=decision.signals | {"r_hat": r})


#: Of the filter's own.
OWN = Parameter("memory", "M", "memory of the innovations", MEMORY, "samples", 1.0, above=True,
                kind="tunable")  # fmt: skip

ENTRY = Entry(
    name="adfc-akf",
    controller=AdaptiveFilterADFC,
    label="ADFC-AKF",
    paper="Calayir, Tao & Mercan 2025, with a Kalman filter that adapts to its innovations",
    parameters=(
        *OF_ADFC.parameters,
        OWN,
        Parameter("adapt", "", "find the sensors' noise", True, kind="static"),
    ),
    tuned=(*OF_ADFC.tuned, OWN),
    traced=lambda benchmark, **values: AdaptiveFilterADFC(
        **{"towards": "inverse"} | values
    ).prepare(benchmark),
    settings_from=OF_ADFC.settings_from,
    follow=OF_ADFC.follow,
    clash=OF_ADFC.clash,
)
