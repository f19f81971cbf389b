"""A linear specimen: K q + C dq/dt + M d2q/dt2, with backward differences."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp

from martths_jax.once import once
from martths_jax.rig.specimen.base import History, Specimen
from martths_jax.structure.modal import contract
from martths_jax.structure.taps import backward_taps


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class LinearSpecimen(Specimen):
    """f(k) = R_0 q(k) + R_1 q(k - 1) + R_2 q(k - 2).

    Attributes:
        taps: (3, f, d) the maps R_0, R_1, R_2, or (3, f, d, T) one set a trial.
    """

    taps: jax.Array

    @classmethod
    def of(cls, M, C, K, dt: float) -> LinearSpecimen:
        """The specimen of matrices (f, d) [SI] at a sample period [s], see ``backward_taps``."""
        return cls(jnp.asarray(backward_taps(M, C, K, dt)))

    def step(self, state, history: History, dt):
        return state, _force(self.taps, history.now, history.before)


@once
def _force(taps, now, before):
    force = contract(taps[0], now)
    force = contract(taps[1], before[0], start=force)
    return contract(taps[2], before[1], start=force)
