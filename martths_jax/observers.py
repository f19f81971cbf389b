"""What looks at a run while it goes: index sums, watch, counts, kept signals, tuning's norms.

The loop knows one protocol.  An observer has a state, which it is given sample by sample:

    init(trials) -> state                               before the first sample
    add(state, signals, reference, k, valid) -> state   after sample k
    finish(state) -> state                              after the last sample, still in the loop
    result(state) -> ...                                what it comes to, NumPy's arrays or JAX's

What is cheaper for many samples at once (a cross-correlation, a spectrum) names the signals it
wants in ``pieces`` and gets them some hundred samples at a time:

    add_piece(state, piece) -> state                    after the samples of a piece

What hands something back for every sample says so in ``emit``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp

from martths_jax.control.base import Controller


class Observer:
    """Base of all observers; each of its methods may be left out.

    Attributes:
        pieces: names of the signals that ``add_piece`` gets.
    """

    pieces: tuple[str, ...] = ()

    def init(self, trials: int) -> Any:
        """State before the first sample, a pytree with the trials on the last axis."""
        return ()

    def add(
        self,
        state: Any,
        signals: Mapping[str, jax.Array],
        reference: jax.Array,
        k: jax.Array,
        valid: jax.Array,
    ) -> Any:
        """Look at a sample.

        Args:
            signals: (..., T) by name, see ``signals.SIGNALS``, and what the controller gives.
            reference: (6, 1) response of the reference structure [m, rad].
            k: number of the sample, a scalar.
            valid: whether it belongs to the motion; after its end the loop may go on a little.
        """
        return state

    def add_piece(self, state: Any, piece: Mapping[str, jax.Array]) -> Any:
        """Look at the next samples, all at once.

        Args:
            piece: (n, rows, T) of each signal in ``pieces``; zeros after the motion's end.
        """
        return state

    def finish(self, state: Any) -> Any:
        """The state, after the last sample."""
        return state

    def emit(self, signals: Mapping[str, jax.Array]) -> Any:
        """What of a sample is handed back, a pytree; it comes with the samples first."""
        return None

    def result(self, state: Any) -> Any:
        """What the state at the end comes to."""
        return state


@dataclass(frozen=True)
class Counts(Observer):
    """Counts that a controller keeps, as they stand after the last sample.

    Attributes:
        names: of the signals, which the controller declares with ``count=True``.
    """

    names: tuple[str, ...] = ()

    @classmethod
    def of(cls, controller: Controller) -> Counts:
        """Those that a controller declares."""
        return cls(tuple(signal.name for signal in controller.signals if signal.count))

    def init(self, trials):
        return {name: jnp.zeros(trials) for name in self.names}

    def add(self, state, signals, reference, k, valid):
        return {name: jnp.where(valid, signals[name], before) for name, before in state.items()}


@dataclass(frozen=True)
class Keep(Observer):
    """Signals of every sample.

    Attributes:
        trials: of the first so many; 0 keeps nothing.
        left_out: names of signals that are not kept.
    """

    trials: int
    left_out: tuple[str, ...] = ()

    def emit(self, signals):
        if not self.trials:
            return {}
        return {
            name: x[..., : self.trials] for name, x in signals.items() if name not in self.left_out
        }
