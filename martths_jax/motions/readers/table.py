"""CSV and other plain tables: acceleration alone, with its time, or among other columns."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..timeaxis import uniform_step
from ..units import is_unit, looks_like_unit, time_unit
from .columns import lies_in_rows, pick, runs_on, several, time_column
from .contents import Contents
from .dialect import Table, read_dialect, split_line
from .grammar import (
    Cell,
    Said,
    agreed_unit,
    column_cells,
    factors_said,
    is_acceleration,
    other_quantity,
    says_value,
    surely_acceleration,
    units_row,
    units_said,
)
from .leading import without_counts
from .steps import header_count, header_step
from .text import text_lines


@dataclass(frozen=True)
class Titles:
    """Titles of the columns, empty where the header has none, and the lines they stand in."""

    cells: tuple[Cell, ...] = ()
    lines: tuple[int, ...] = ()

    def names(self, columns: int) -> list[str]:
        """A name for each column, empty where it has none."""
        return [cell.name for cell in self.cells] if self.cells else [""] * columns


def read_table(path: Path, content: bytes, *, variable=None, dt=None) -> Contents:
    """Acceleration of a text table (``docs/motions.md`` says what is read and what refused).

    Columns are separated by commas, semicolons, tabs or blanks.  `variable` picks a column by its
    title or its number; `dt` [s] is the step where the file has none.
    """
    table = read_dialect(path, text_lines(path, content))
    table, count, step, notices = without_counts(path, table, dt)
    said_step = header_step(path, table.header)
    said_count = header_count(path, table.header)
    step = said_step if said_step is not None else step
    count = said_count[0] if said_count else count
    titles = _titles(table)
    found = _series(path, table, titles, variable, dt if dt is not None else step, count)
    if count is not None and found.values.size != count:
        place = f"line {said_count[1]}" if said_count else "line 1"
        raise InputError(
            f"File {path}, {place}: the header says that there are {count} samples, but "
            f"{found.values.size} values follow; the file is truncated, or correct the header."
        )
    if found.dt is not None and step is not None and abs(found.dt / step - 1) > 1e-3:
        raise InputError(
            f"File {path} has times at a step of {found.dt:.6g} s, but its header states the time "
            f"step {step:.6g} s; correct one of them."
        )
    return replace(
        found,
        dt=step if found.dt is None else found.dt,
        notices=(*notices, *found.notices),
    )


def _titles(table: Table) -> Titles:
    """The last line before the rows that has a title for each column, with a row of units."""
    columns = len(table.rows[0])
    units: tuple[tuple[str, ...], int] | None = None
    for number, line in reversed(table.header[: table.before]):
        cells = column_cells(line, split_line(line, table.separator), columns)
        if not cells or says_value(line):
            continue
        if units is None and (row := units_row(cells)):
            units = (row, number)
        elif units:
            both = tuple(Cell(n.name, unit) for n, unit in zip(cells, units[0], strict=True))
            return Titles(both, (number, units[1]))
        else:
            return Titles(cells, (number,))
    if units is None:
        return Titles()
    # One letter without a title above it is a direction (V, H), but for that of g.
    cells = tuple(Cell("", u) if len(u) > 1 or u in "gGsS" else Cell(u, None) for u in units[0])
    return Titles(cells, (units[1],))


def _series(path, table: Table, titles: Titles, variable, dt, count) -> Contents:
    """The acceleration, its unit and its step, from the shape of the table."""
    where = f"File {path}"
    columns = len(table.rows[0])
    odd = [k for k, row in enumerate(table.rows) if len(row) != columns]
    if columns == 1 and not odd:
        values = np.array(table.rows)[:, 0]
        unit, notices = _unit(path, table, titles, 0 if titles.cells else None)
        return Contents(values, None, unit, where, table.places, notices)
    if odd or len(table.rows) == 1:
        return _running(path, table, titles, odd, variable)
    matrix = np.array(table.rows)
    if not titles.cells and lies_in_rows(matrix):
        matrix, table = matrix.T, replace(table, places=[])
    time = _time(matrix, titles, dt)
    choice = _column(matrix, titles, time, variable, where, count)
    if choice is None:
        return _running(path, table, titles, [], variable, certain=count == matrix.size)
    unit, notices = _unit(path, table, titles, choice)
    lines = table.places or None
    if time is None:
        return Contents(matrix[:, choice], None, unit, where, lines, notices)
    factor = _time_factor(where, titles, time)
    step, more = uniform_step(matrix[:, time], where, lines, dt / factor if dt else None)
    return Contents(matrix[:, choice], step * factor, unit, where, lines, (*notices, *more))


def _time(matrix: np.ndarray, titles: Titles, dt: float | None) -> int | None:
    """Index of the time's column: by its title, else by its numbers.

    A column that counts rows is no time.  Where nothing says seconds, steps of exactly 1 count
    rows if the step is known otherwise.
    """
    for k, cell in enumerate(titles.cells):
        if cell.is_time:
            return k
    k = time_column(matrix)
    if k is None and matrix.shape[1] == 2 and not titles.cells and _mostly_goes_on(matrix[:, 0]):
        return 0  # `uniform_step` says what is wrong with it
    if k is None or (titles.cells and titles.cells[k].is_counter):
        return None
    if dt is not None and dt != 1 and np.all(np.diff(matrix[:, k]) == 1):
        return None
    if titles.cells and (titles.cells[k].is_other or is_acceleration(titles.cells[k])):
        return None
    return k


def _mostly_goes_on(values: np.ndarray) -> bool:
    """Whether numbers rise or fall nearly throughout, as a damaged time does."""
    with np.errstate(invalid="ignore"):
        steps = np.diff(values)
    return values.size > 10 and max(np.mean(steps > 0), np.mean(steps < 0)) > 0.9


def _column(matrix, titles: Titles, time, variable, where, count) -> int | None:
    """Index of the acceleration's column; None where the rows are one running series."""
    columns = matrix.shape[1]
    names = titles.names(columns)
    if variable is not None:
        choice = pick(variable, names, where)
        if choice == time:
            raise InputError(
                f"{where}: column {choice + 1}, which `variable` (--variable) picks, is the time; "
                "pick an acceleration."
            )
        return choice
    counter = [k for k in range(columns) if _counts_rows(matrix[:, k]) and k != time]
    left = [k for k in range(columns) if k != time and k not in counter[:1]]
    wanted = [k for k in left if not (titles.cells and titles.cells[k].is_other)]
    if titles.cells and not wanted and left:
        return left[-1]  # `_unit` says that it is no acceleration
    if len(wanted) == 1:
        return wanted[0]
    if time is None and not counter and not titles.cells and count != matrix.shape[0]:
        if count == matrix.size or runs_on(matrix):
            return None
    raise several(where, names, wanted or left)


def _counts_rows(values: np.ndarray) -> bool:
    return values.size > 2 and values[0] in (0, 1) and bool(np.all(np.diff(values) == 1))


def _running(path, table: Table, titles, odd: list[int], variable, certain=True) -> Contents:
    """One series over rows of several values, of which the last may be shorter."""
    columns = len(table.rows[0])
    where = f"File {path}"
    whole = np.array(table.rows[: odd[0] if odd else None])
    short = odd == [len(table.rows) - 1] and len(table.rows[-1]) < columns
    timed = whole.shape[0] > 1 and time_column(whole) is not None
    if odd and (not short or timed or titles.cells):
        raise InputError(
            f"File {path}, line {table.places[odd[0]]}: found {len(table.rows[odd[0]])} columns, "
            f"but {columns} as in line {table.places[0]} are wanted; correct the line."
        )
    if len(table.rows) == 1 and columns < 3:
        raise InputError(f"{where} holds one row of numbers, but a motion needs at least 2.")
    if variable is not None:
        raise InputError(
            f"{where} was asked for column {variable!r:.60} (`variable`, --variable), but its rows "
            f"of {columns} values are one series; leave it out."
        )
    unit, notices = _unit(path, table, titles, None)
    values = np.array([value for row in table.rows for value in row])
    places = [p for p, row in zip(table.places, table.rows, strict=True) for _ in row]
    if not (certain or odd or len(table.rows) == 1):
        notices = (
            *notices,
            f"{where}: its {columns} columns were read row by row as one series, which runs on "
            "from line to line; give `variable` (--variable) to read one column.",
        )
    return Contents(values, None, unit, where, places, notices)


def _unit(path, table: Table, titles: Titles, choice: int | None):
    """The unit of the chosen column, and notices; refuses what is no acceleration."""
    cell = titles.cells[choice] if titles.cells and choice is not None else Cell("", None)
    own: list[Said] = []
    line = titles.lines[-1] if titles.lines else 0
    single = len(titles.cells) == 1
    if cell.is_other and not (cell.unit is None and single):
        if cell.unit is None or cell.is_spectral or time_unit(cell.unit) is not None:
            raise other_quantity(path, line, cell.name or "time")
        own = [Said(cell.unit, line)]
    elif cell.unit is not None:
        text = dict(table.header).get(line, "")
        own = [Said(cell.unit, line, not single or surely_acceleration(cell.name, text))]
    free = [(n, text) for n, text in table.header if n not in titles.lines or (single and not own)]
    unit, notices = agreed_unit(path, own + units_said(path, free))
    return unit, (*notices, *factors_said(path, table.header))


def _time_factor(where: str, titles: Titles, time: int) -> float:
    """Seconds in the unit of the time's column."""
    unit = titles.cells[time].unit if titles.cells else None
    factor = time_unit(unit) if unit else 1.0
    if factor is None and (looks_like_unit(unit) or is_unit(unit)):
        raise InputError(
            f"{where}, line {titles.lines[-1]}: found the time in {unit!r:.30}, but s, ms or min "
            "are wanted; correct the title, or give the step in `dt` (--dt) and the acceleration "
            "alone."
        )
    return 1.0 if factor is None else factor
