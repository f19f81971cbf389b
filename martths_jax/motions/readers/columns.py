"""Which column or row of a matrix is the time, and which the acceleration."""

from __future__ import annotations

import re

import numpy as np

from ...errors import InputError
from ..timeaxis import is_time

#: A matrix with at most so many rows may hold its series as rows.
_ROWS = 8
_LONG = 20

#: A series runs on from one place to the next where its steps are so much smaller one way.
_SMOOTHER = 0.8
_FEWEST = 8


def plain(name: str) -> str:
    """A name without case and punctuation, for comparing."""
    return re.sub(r"[^a-z0-9]", "", name.lower())


def lies_in_rows(matrix: np.ndarray) -> bool:
    """Whether a matrix (R, C) without titles is time and acceleration in rows (2 x N)."""
    rows, columns = matrix.shape
    if not 2 <= rows < columns or rows > _ROWS or (rows > 2 and columns < _LONG):
        return False
    return is_time(matrix[0]) or (rows == 2 and is_time(matrix[1]))


def time_column(matrix: np.ndarray) -> int | None:
    """Index of the column of (n, C) that is the time by its numbers: the first, else the second."""
    if matrix.shape[0] > 1 and matrix.shape[1] > 1:
        if is_time(matrix[:, 0]):
            return 0
        if matrix.shape[1] == 2 and is_time(matrix[:, 1]):
            return 1
    return None


def runs_on(matrix: np.ndarray) -> bool | None:
    """Whether (R, C) is one series that runs on from row to row; None where it may be either.

    Neighbours of a motion differ less than samples further apart.  Along the rows the steps are
    those of neighbours if the rows are one series, and jumps between components if they are not.
    """
    if matrix.shape[0] < _FEWEST:
        return None
    along = np.mean(np.abs(np.diff(matrix.ravel())))
    down = np.mean(np.abs(np.diff(matrix, axis=0)))
    if along < _SMOOTHER * down:
        return True
    return False if down < _SMOOTHER * along else None


def numbered(names: list[str]) -> str:
    """Columns as an error lists them: ``2 (NS), 3 (EW)``."""
    return ", ".join(f"{k} ({name})" if name else f"{k}" for k, name in enumerate(names[:12], 1))


def pick(variable: str, names: list[str], where: str, what: str = "column") -> int:
    """Index of the column (channel, component) that `variable` names, or numbers from 1 on."""
    wanted = str(variable).strip()
    exact = [k for k, name in enumerate(names) if name and name.lower() == wanted.lower()]
    alike = [k for k, name in enumerate(names) if plain(name) and plain(name) == plain(wanted)]
    for found in (exact, alike):
        if len(found) == 1:
            return found[0]
    if re.fullmatch(r"\d{1,9}", wanted) and 1 <= int(wanted) <= len(names) and not alike:
        return int(wanted) - 1
    raise InputError(
        f"{where} has no {what} {wanted!r:.60} to pick with `variable` (--variable); it has "
        f"{numbered(names)}."
    )


def pick_channel(variable: str | None, names: list[str], where: str) -> int:
    """Index of the channel that `variable` picks, or of the only one there is."""
    if variable is not None:
        return pick(variable, names, where, "channel")
    if len(names) > 1:
        raise several(where, names, list(range(len(names))), "channels")
    return 0


def several(where: str, names: list[str], choices: list[int], what: str = "columns") -> InputError:
    """The error for more than one candidate and no `variable`."""
    listed = ", ".join(f"{k + 1} ({names[k]})" if names[k] else f"{k + 1}" for k in choices[:12])
    return InputError(
        f"{where} has {len(names)} {what}, and {len(choices)} of them could be the acceleration: "
        f"{listed}; name or number one in `variable` (--variable), or remove the others."
    )
