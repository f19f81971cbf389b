"""What a controller is: two functions on pytrees, and what it is told each sample.

A controller is a frozen dataclass registered as a pytree.  Its array fields (gains, weights) are
traced, so they can be differentiated and batched; counts that set array shapes are static.  Arrays
carry the trials on their last axis, so that an ordinary line of algebra works on a whole batch.

To add one, write one file: subclass ``Controller``, give it ``init`` and ``step``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import jax

if TYPE_CHECKING:
    from martths_jax.benchmark import Benchmark


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Observation:
    """What the controller knows at sample k, trials T on the last axis.

    Attributes:
        k: number of the sample, a scalar.
        dt: sample period [s].
        target_mm: (2, T) strokes x_a(k) that the numerical substructure asks for.
        measured_mm: (2, T) strokes x_m(k) as the sensors give them.
        estimate_mm: (2, T) strokes x_hat(k) after the Kalman correction.
        state: (2, m, T) estimated plant state z_hat(k), slot by slot.
        delayed: what this controller put into ``Decision.record`` ``window`` samples ago (zeros
            before that), or None if it keeps no window.
    """

    k: jax.Array
    dt: jax.Array
    target_mm: jax.Array
    measured_mm: jax.Array
    estimate_mm: jax.Array
    state: jax.Array
    delayed: Any


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Decision:
    """What the controller does at sample k.

    Attributes:
        command_mm: (2, T) commands u(k), held until k + 1.
        record: pytree of (..., T) arrays to be handed back ``window`` samples later, or None.
        signals: named (..., T) arrays that ``simulate(..., keep=True)`` should store.
    """

    command_mm: jax.Array
    record: Any = None
    signals: dict[str, jax.Array] = field(default_factory=dict)


class Controller(ABC):
    """Base of all controllers.

    Attributes:
        window: after how many samples a ``record`` comes back; 0 for none.  It replaces a ring
            buffer in the state: the time loop keeps whole windows and hands them through.
        name: short name for tables and files.
        first_lag_range: 0 if delays of a few ms are to be expected, 1 for tens of ms; only saves
            time, since a run whose delay lies outside is repeated with a wider range.
        shared_axes: number of axes of array fields when all trials share them; with one more, the
            last, a field holds one value a trial.  A field that is not named here may too, where
            the controller works with one value a trial and not otherwise.
    """

    window: int = 0
    name: str = "controller"
    first_lag_range: int = 0
    shared_axes: Mapping[str, int] = MappingProxyType({})

    def prepare(self, benchmark: Benchmark) -> Controller:
        """Finish the design for a benchmark (on the host, before the loop).

        The result carries ``estimator``, the filter that runs with this controller.  The default
        returns the controller as it is.
        """
        return self

    def problems(self, benchmark: Benchmark) -> list[str]:
        """Sentences about arguments that cannot be used; empty if all are fine."""
        return []

    @abstractmethod
    def init(self, trials: int) -> Any:
        """State before the first sample, a pytree with the trials on the last axis."""

    @abstractmethod
    def step(self, state: Any, seen: Observation) -> tuple[Any, Decision]:
        """One sample: what to command, and the state for the next."""

    def blank_record(self, trials: int) -> Any:
        """What ``delayed`` holds before the first record comes back: zeros of its shape."""
        return None

    def turn(self, state: Any) -> Any:
        """Called after every ``window`` samples: what to change at a window's end."""
        return state
