"""What an estimator and a controller are: a few functions on pytrees, and what they are told.

Both are frozen dataclasses registered as pytrees.  Their array fields (gains, weights) are traced,
so they can be differentiated and batched; counts that set array shapes are static.  Arrays carry
the trials T on their last axis, so that an ordinary line of algebra works on a whole batch.

A sample k goes: the sensors measure; the estimator corrects its prediction; the controller decides
the command, which the rig holds until k + 1; the estimator predicts k + 1 with it.  To add one of
either kind, write one file: subclass it, give it its methods.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import jax

if TYPE_CHECKING:
    from martths_jax.benchmark import Benchmark


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Observation:
    """What the controller knows at sample k.

    Attributes:
        k: number of the sample, a scalar.
        dt: sample period [s].
        x_a: (2, T) strokes x_a(k) that the numerical substructure asks for.
        x_m: (2, T) strokes x_m(k) as the sensors give them.
        x_hat: (2, T) strokes x_hat(k) after the estimator's correction.
        state: what the estimator knows at k: of the Kalman filter (2, m, T), z_hat(k) slot by slot.
        delayed: what comes out of the controller's delay line at k: the record of n samples ago,
            zeros before that; None without one.
    """

    k: jax.Array
    dt: jax.Array
    x_a: jax.Array
    x_m: jax.Array
    x_hat: jax.Array
    state: Any
    delayed: Any


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Decision:
    """What the controller does at sample k.

    Attributes:
        u: (2, T) commands u(k), held until k + 1.
        record: pytree of (..., T) arrays that goes into the delay line, or None without one.
        signals: named (..., T) arrays that ``simulate(..., keep=True)`` should store.
    """

    u: jax.Array
    record: Any = None
    signals: dict[str, jax.Array] = field(default_factory=dict)


@dataclass(frozen=True)
class DelayLine:
    """A controller's memory of n samples: what goes in at k comes out at k + n.

    Attributes:
        samples: its length n.
        blank: what comes out during the first n samples, a pytree of (..., T) arrays; zeros.
        renew: called with the controller's state after every n samples, to give it back: where a
            running sum over the line is replaced by a fresh one, so that round-off does not grow
            with the record.
    """

    samples: int
    blank: Any
    renew: Callable[[Any], Any] | None = None


@dataclass(frozen=True)
class Signal:
    """What is said of a signal: one of the loop's own, or one that a controller gives.

    Attributes:
        name: key in ``Decision.signals``.
        dims: names of its axes before the trials.
        unit: of its values; label: what it is, in words.
        elements: names of its elements for a legend, the last axis counting fastest.
        count: it counts events from the first sample on, one number (T,) a trial; what it stands
            at in the end is kept with the results of every run, see ``observers.Counts``.
        stored: whether it is kept where signals are.
    """

    name: str
    dims: tuple[str, ...] = ()
    unit: str = "1"
    label: str = ""
    elements: tuple[str, ...] = ()
    count: bool = False
    stored: bool = True


class Estimator(ABC):
    """Base of all estimators of the actuators' strokes.

    Attributes:
        shared_axes: see ``Controller``.
    """

    shared_axes: Mapping[str, int] = MappingProxyType({})

    @abstractmethod
    def init(self, trials: int) -> Any:
        """The prediction for k = 0, a pytree with the trials on the last axis."""

    @abstractmethod
    def correct(self, predicted: Any, x_m: jax.Array) -> tuple[Any, jax.Array]:
        """At k, with the measurement of k.

        Args:
            predicted: prediction for k, made at k - 1.
            x_m: (2, T) strokes x_m(k).

        Returns:
            what is known at k, of any structure; (2, T) estimated strokes x_hat(k) [mm].
        """

    @abstractmethod
    def predict(self, state: Any, u: jax.Array) -> Any:
        """The prediction for k + 1.

        Args:
            state: what is known at k, from ``correct``.
            u: (2, T) commands u(k).

        Returns:
            a prediction of the same structure, shapes and types as that of ``init``.
        """


class Controller(ABC):
    """Base of all controllers.

    Attributes:
        name: short name for tables and files.
        estimator: the ``Estimator`` that runs with it, there once it is prepared.
        signals: what it says of the signals it gives; others may come, with names only.
        adapts: whether its coefficients move during a run, so that the loop is not linear.
        first_lag_range: 0 if delays of a few ms are to be expected, 1 for tens of ms; only saves
            time, since a run whose delay lies outside is repeated with a wider range.
        shared_axes: number of axes of array fields when all trials share them; with one more, the
            last, a field holds one value a trial.  A field that is not named here may too, where
            the controller works with one value a trial and not otherwise.
        actuators_needed: how many actuators it is made for; None for any number.
    """

    name: str = "controller"
    signals: tuple[Signal, ...] = ()
    adapts: bool = False
    first_lag_range: int = 0
    shared_axes: Mapping[str, int] = MappingProxyType({})
    actuators_needed: int | None = None

    def prepare(self, benchmark: Benchmark) -> Controller:
        """Finish the design for a benchmark (on the host, before the loop).

        The result carries ``estimator``, the filter that runs with this controller.  The default
        returns the controller as it is.
        """
        return self

    def problems(self, benchmark: Benchmark) -> list[str]:
        """Sentences about arguments that cannot be used; empty if all are fine."""
        return []

    def frozen(self, benchmark: Benchmark, coefficients) -> Controller:
        """The prepared controller that this one is once its coefficients stay.

        Args:
            benchmark: what it is prepared for.
            coefficients: of an adaptive one, as its signals hold them, trials last if each has
                its own.
        """
        return self.prepare(benchmark)

    def delay_line(self, trials: int) -> DelayLine | None:
        """The controller's memory of past samples, if it keeps one.

        Its length must not depend on the trials.
        """
        return None

    @abstractmethod
    def init(self, trials: int) -> Any:
        """State before the first sample, a pytree with the trials on the last axis."""

    @abstractmethod
    def step(self, state: Any, seen: Observation) -> tuple[Any, Decision]:
        """One sample: what to command, and the state for the next."""
