"""What the pieces of an adaptive feedforward are: regressor, fit, guards and command law.

The inverse of the plant is modelled as u(k-1) = C' phi(k): phi from the strokes that a command
caused, C fitted to what was seen, and the command the same model applied to the target strokes.

    regressor   strokes -> phi, the same for what is learnt from and for the target
    fit         pairs (phi(k), u(k-1)) -> C
    guards      what the fit is pulled to, whether it is used, how far it may go
    law         C and phi of the target -> command

Pieces are frozen dataclasses registered as pytrees; their numbers are traced, what shapes the
program is static.  The algebra is unrolled: a "number" is an array over trials (T,), and C is a
tuple of rows with one number an actuator.  To add a piece, write one file: subclass, give it its
methods, export it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.algebra.least_squares import Rows

if TYPE_CHECKING:
    from martths_jax.benchmark import Benchmark
    from martths_jax.control.controllers.feedforward import AdaptiveFeedforward

#: Strokes that are commanded, where nothing else is said.
ACTUATORS = 2

#: Coefficients C: row j holds that of regressor j for each side, (T,) each.
Coefficients = tuple[tuple[jax.Array, ...], ...]


@dataclass(frozen=True)
class Part:
    """One least-squares problem of a controller: joint over both strokes, or of one actuator.

    Attributes:
        number: which of them.
        unknowns: number of its regressors.
        sides: actuators whose commands it fits.
        values: positions in its regressor that hold a stroke itself.
    """

    number: int
    unknowns: int
    sides: tuple[int, ...]
    values: tuple[int, ...]

    def columns(self, array: jax.Array) -> Coefficients:
        """Its columns of an array (unknowns, actuators, ...), one column an actuator."""
        return tuple(tuple(array[j, i] for i in self.sides) for j in range(self.unknowns))


def parts_of(columns: int, joint: bool, actuators: int = ACTUATORS) -> tuple[Part, ...]:
    """The least-squares problems of a controller.

    Args:
        columns: regressors a stroke.
        joint: one over all strokes, or one an actuator.
        actuators: number of strokes.
    """
    each = range(actuators)
    if joint:
        values = tuple(columns * i for i in each)
        return (Part(0, columns * actuators, tuple(each), values),)
    return tuple(Part(i, columns, (i,), (0,)) for i in each)


@dataclass(frozen=True)
class Pair:
    """What a part is taught at sample k: phi' C = values.

    Attributes:
        k: number of the sample, a scalar.
        dt: sample period [s].
        phi: regressors (T,) of the strokes at k.
        values: commands (T,) at k - 1 of the part's sides, the last that those strokes can have
            felt.
        phi_leaving, values_leaving: the same of as many samples ago as the fit's memory is long;
            None where it has none.
    """

    k: jax.Array
    dt: float
    phi: Sequence[jax.Array]
    values: Sequence[jax.Array]
    phi_leaving: Sequence[jax.Array] | None = None
    values_leaving: Sequence[jax.Array] | None = None


@dataclass(frozen=True)
class Fitted:
    """What a fit proposes.

    Attributes:
        coefficients: rows of the part's sides.
        rows: the normal equations that were solved, guards included; None without any.
        tolerance: (T,) their smallest relative pivot, see ``least_squares.solve_ldl``.
    """

    coefficients: Coefficients
    rows: Rows | None = None
    tolerance: jax.Array | None = None


class Piece:
    """Base of all pieces.

    Attributes:
        shared_axes: see ``Controller``.
    """

    shared_axes: Mapping[str, int] = MappingProxyType({})

    def prepare(self, benchmark: Benchmark, controller: AdaptiveFeedforward):
        """Finish the piece for a controller and a benchmark (on the host, before the loop).

        Args:
            benchmark: what it will run on.
            controller: whose piece it is; its estimator and start are there.
        """
        return self

    def problems(self, controller: AdaptiveFeedforward) -> list[str]:
        """Sentences about arguments that cannot be used; empty if all are fine."""
        return []


class Regressor(Piece, ABC):
    """Base of all regressors: linear maps of a stroke's newest samples, the same for each stroke.

    They hold static numbers only, so that one is hashable and part of the program.
    """

    @property
    @abstractmethod
    def matrix(self) -> np.ndarray:
        """(n, taps): phi of a stroke from its samples k, k-1, ..., k-taps+1."""

    @property
    def columns(self) -> int:
        """Regressors a stroke, n."""
        return self.matrix.shape[0]

    @property
    def reach(self) -> int:
        """Samples before k that phi(k) looks back to."""
        return self.matrix.shape[1] - 1

    @abstractmethod
    def init(self, trials: int, actuators: int = ACTUATORS) -> Any:
        """What is remembered of the samples before the first."""

    @abstractmethod
    def step(self, before: Any, newest_mm: jax.Array) -> tuple[Any, tuple]:
        """Regressors of a sample.

        Args:
            before: what was remembered of the samples before.
            newest_mm: (actuators, T) strokes of this sample [mm].

        Returns:
            what to remember; for each stroke its n regressors (T,).
        """


class Fit(Piece, ABC):
    """Base of all fits.

    Attributes:
        normal: whether it solves normal equations, which guards may change.
        memory: samples after which a pair is taken away again, kept in the controller's delay line;
            0 without.
        length: how many pairs its sums hold, for guards that compare them with noise; 0 without
            sums.
    """

    normal: bool = False
    memory: int = 0
    length: float = 0.0

    @abstractmethod
    def init(self, part: Part, trials: int) -> Any:
        """State of a part before the first sample."""

    @abstractmethod
    def due(self, k: jax.Array, reach: int) -> jax.Array:
        """Whether new coefficients are due at sample k, a scalar.

        Args:
            k: number of the sample.
            reach: of the regressor, see ``Regressor.reach``.
        """

    @abstractmethod
    def step(
        self,
        state: Any,
        part: Part,
        pair: Pair,
        last: Coefficients,
        weigh: Callable[[Rows], Rows],
    ) -> tuple[Any, Fitted]:
        """Learn from a pair, and propose coefficients.

        Args:
            state: the part's.
            part: which it is.
            pair: what sample k teaches.
            last: coefficients in use.
            weigh: the guards' changes of the normal equations.
        """

    def keep(self, use: jax.Array, new: Any, old: Any) -> Any:
        """State after a proposal that was used (T,) or not; by default what was learnt stays."""
        return new

    def renew(self, state: Any) -> Any:
        """State after as many samples as the memory is long, see ``DelayLine``."""
        return state


class Guard(Piece):
    """Base of all guards; each method by default does nothing.

    Attributes:
        weighs: whether it needs the normal equations of the fit.
    """

    weighs: bool = False

    def init(self, part: Part, trials: int) -> Any:
        """State of a part before the first sample."""
        return ()

    def look(self, state: Any, part: Part, pair: Pair) -> Any:
        """State after having seen what a sample teaches."""
        return state

    def weigh(self, part: Part, rows: Rows, last: Coefficients) -> Rows:
        """The normal equations that shall be solved.

        Args:
            part: whose they are.
            rows: of the data and the guards before.
            last: coefficients in use.
        """
        return rows

    def trusts(self, state: Any, part: Part, fitted: Fitted) -> jax.Array | None:
        """Whether a proposal may be used (T,), false for NaN; None where that is no question."""
        return None

    def cut(self, part: Part, proposed: Coefficients, last: Coefficients) -> Coefficients:
        """The coefficients that are used instead of a trusted proposal."""
        return proposed


class Law(Piece, ABC):
    """Base of all command laws."""

    @abstractmethod
    def command(self, coefficients: Sequence[Coefficients], phi: Sequence) -> tuple:
        """Commands u(k), (T,) an actuator [mm].

        Args:
            coefficients: for each actuator its column of C, as many numbers as regressors.
            phi: for each actuator the regressors of the target that go with them.
        """


def weighted(weights: Sequence[float], values: Sequence[jax.Array]) -> jax.Array:
    """Sum of weights times values, without the arithmetic of noughts and ones."""
    terms = [v if w == 1.0 else w * v for w, v in zip(weights, values, strict=False) if w]
    return sum(terms[1:], start=terms[0])


def choose(use: jax.Array, new: Any, old: Any) -> Any:
    """`new` where `use` (T,), else `old`: two trees of arrays (..., T)."""
    return jax.tree.map(lambda a, b: jnp.where(use, a, b), new, old)
