"""What a plant is described by: a matrix of transfer functions, or a function that writes them.

Each gives, for a batch of parameters, a matrix of ``Entry`` (outputs by row, inputs by column) and
groups of modes that go into slots together.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from martths_jax.errors import argument_error, check_whole
from martths_jax.rig.entries import Coefficients, ZerosPoles, of_coefficients
from martths_jax.rig.modal import Entry, Matrix, Mode, column_modes
from martths_jax.rig.numbers import (
    Batch,
    is_plain_zero,
    without_leading_zeros,
)


class Dynamics:
    """Of one kind or another; the model of a plant holds one."""

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of outputs and of inputs."""
        raise NotImplementedError

    @property
    def names(self) -> set[str] | None:
        """Names of the uncertain parameters in it; None if it is free to use any."""
        raise NotImplementedError

    def matrix(self, batch: Batch) -> Matrix:
        """Transfer functions of a batch, None where an input does not act on an output."""
        raise NotImplementedError

    def groups(self, matrix: Matrix, batch: Batch) -> list[list[Mode]]:
        """Modes of what ``matrix`` gave, column by column."""
        outputs, inputs = self.shape
        columns = [[matrix[i][j] for i in range(outputs)] for j in range(inputs)]
        return [column_modes(column, j, inputs) for j, column in enumerate(columns)]


@dataclass(frozen=True)
class TransferMatrix(Dynamics):
    """One transfer function for each output (row) and input (column).

    Attributes:
        entries: rows of ``ZerosPoles``, ``Coefficients``, or None where nothing acts.

    Raises:
        InputError: for rows of different lengths, or an entry of another kind.
    """

    entries: tuple[tuple[ZerosPoles | Coefficients | None, ...], ...]

    def __post_init__(self):
        try:
            rows = tuple(tuple(row) for row in self.entries)
        except TypeError:
            rows = ()
        if not rows or not rows[0] or len({len(row) for row in rows}) != 1:
            raise argument_error(
                "entries", "be rows of equal length, one for each output", repr(self.entries)[:80]
            )
        for i, row in enumerate(rows):
            for j, entry in enumerate(row):
                if not (entry is None or isinstance(entry, (ZerosPoles, Coefficients))):
                    wanted = "hold ZerosPoles, Coefficients or None"
                    got = f"{entry!r:.80} at ({i + 1}, {j + 1})"
                    raise argument_error("entries", wanted, got)
        for j in range(len(rows[0])):
            if all(row[j] is None for row in rows):
                raise argument_error(
                    "entries", "let every input act on an output", f"None in all of column {j + 1}"
                )
        object.__setattr__(self, "entries", rows)

    @property
    def shape(self) -> tuple[int, int]:
        return len(self.entries), len(self.entries[0])

    @property
    def names(self) -> set[str]:
        return {name for row in self.entries for e in row if e is not None for name in e.names}

    def matrix(self, batch: Batch) -> Matrix:
        return [[None if e is None else e.evaluate(batch) for e in row] for row in self.entries]


@dataclass(frozen=True)
class Written(Dynamics):
    """Transfer functions that a function of the parameters gives, one denominator a column.

    Attributes:
        of: takes a mapping of each parameter's name to its values, (T,) arrays, and returns
            numerators (one row for each output, of one list of coefficients for each input) and
            denominators (one list of coefficients for each input); the highest power first, s in
            rad/s, each coefficient (T,) or a number.  JAX traces it, so it is written with
            operators and jax.numpy, and hands out lists of the same lengths every time.
        outputs, inputs: their numbers.
    """

    of: Callable[[dict[str, Any]], tuple[Any, Any]]
    outputs: int
    inputs: int

    def __post_init__(self):
        if not callable(self.of):
            raise argument_error("of", "be a function of the parameters", repr(self.of)[:80])
        check_whole("outputs", self.outputs, 1, 1000)
        check_whole("inputs", self.inputs, 1, 1000)

    @property
    def shape(self) -> tuple[int, int]:
        return self.outputs, self.inputs

    @property
    def names(self) -> None:
        return None

    def matrix(self, batch: Batch) -> Matrix:
        try:
            numerators, denominators = self.of(dict(batch.parameters))
        except KeyError as error:
            raise argument_error(
                "of", f"use no parameters but {', '.join(batch.parameters) or 'none'}", f"{error}"
            ) from None
        fits = len(numerators) == self.outputs and len(denominators) == self.inputs
        if not fits or {len(row) for row in numerators} != {self.inputs}:
            raise argument_error(
                "of", f"return {self.outputs} rows of {self.inputs} numerators, and {self.inputs} "
                "denominators", f"{[len(row) for row in numerators]} and {len(denominators)}",
            )  # fmt: skip
        below = [self._coefficients(batch, d, f"denominator {j + 1}")
                 for j, d in enumerate(denominators)]  # fmt: skip
        poles = [batch.roots(("column", j), d) for j, d in enumerate(below)]

        def entry(i: int, j: int) -> Entry | None:
            c = self._coefficients(batch, numerators[i][j], f"numerator ({i + 1}, {j + 1})")
            return None if not c else of_coefficients(c, below[j], poles[j], j)

        return [[entry(i, j) for j in range(self.inputs)] for i in range(self.outputs)]

    @staticmethod
    def _coefficients(batch: Batch, given, where: str) -> list:
        """Coefficients as (T,) arrays, without leading zeros; none for plain zeros alone."""
        given = without_leading_zeros(tuple(given))
        if len(given) == 1 and is_plain_zero(given[0]):
            return []
        try:
            return [batch.full(batch.xp.asarray(c, dtype=float)) for c in given]
        except (TypeError, ValueError):
            wanted = "return coefficients that are numbers or arrays (T,)"
            raise argument_error("of", wanted, f"another in {where}") from None
