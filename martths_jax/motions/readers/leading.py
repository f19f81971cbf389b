"""Numbers before the samples: a count and a time step on lines of their own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ...errors import InputError
from .dialect import Table


def without_counts(path: Path, table: Table, dt: float | None):
    """The table without a first count and step, the two (or None), and notices.

    A whole number that is exactly the number of values (or rows) behind it is their count, and a
    number up to 1 beside or below it the step [s].  A first number that could be a count, but does
    not match, is refused: it may as well be a sample.
    """
    rows = table.rows
    if len(rows) < 4:
        return table, None, None, ()
    for taken, count, step in _openings(rows, table.whole):
        rest = rows[taken:]
        wide = len(rows[0]) > 1 and len(rest[0]) == len(rows[0])
        sizes = {len(rest)} if wide else {len(rest), sum(map(len, rest))}
        if count in sizes and len(rest) > 1:
            told = f"the number of samples ({count:.0f})"
            told += f" and the time step ({step:g} s)" if step else ""
            notice = (
                f"File {path}: the first {taken} line{'s' if taken > 1 else ''} of numbers "
                f"{'were' if taken > 1 else 'was'} taken for {told}."
            )
            cut = replace(table, rows=rest, places=table.places[taken:])
            return cut, int(count), step, (notice,)
    _refuse_odd_first(path, table)
    first = rows[0][0]
    if dt is not None and len(rows[0]) == 1 and first == dt and first != 0:
        notice = (
            f"File {path}, line {table.places[0]}: its first value is the time step {dt:g}; if it "
            "is no sample, mark the line with #."
        )
        return table, None, None, (notice,)
    return table, None, None, ()


def _openings(rows: list[list[float]], whole: tuple[bool, ...]):
    """(lines taken, count, step or None) of every way the first rows can be read."""
    first, second = rows[0], rows[1]
    if not any(whole):
        return
    if len(first) == 1 and whole[0] and _is_count(first[0]):
        if len(second) == 1 and 0 < second[0] <= 1:
            yield 2, first[0], second[0]
        yield 1, first[0], None
    if (
        len(first) == 1
        and len(second) == 1
        and 0 < first[0] <= 1
        and whole[1]
        and _is_count(second[0])
    ):
        yield 2, second[0], first[0]
    if len(first) == 2 and whole[0] and _is_count(first[0]) and 0 < first[1] <= 1:
        yield 1, first[0], first[1]


def _is_count(value: float) -> bool:
    return np.isfinite(value) and value >= 2 and value == int(value)


def _refuse_odd_first(path: Path, table: Table) -> None:
    """`InputError` where a lone whole number stands above numbers with decimals."""
    if len(table.rows[0]) != 1 or not table.whole[0]:
        return
    first = table.rows[0][0]
    rest = np.concatenate([np.asarray(row) for row in table.rows[1:]])
    if not (_is_count(first) and np.all(np.isfinite(rest))):
        return
    if first > np.max(np.abs(rest)) and np.mean(rest != np.round(rest)) > 0.5:
        raise InputError(
            f"File {path}, line {table.places[0]}: found {first:g} above {rest.size} numbers with "
            "decimals, which may be a count or a sample; remove it, or mark the line with #."
        )
