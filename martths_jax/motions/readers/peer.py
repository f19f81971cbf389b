"""PEER ``.AT2`` files, with both styles of header.

Three lines of title, event and unit, then the counts, then the values, five on a line:

    NPTS=   4000, DT=   .0050 SEC,           (as downloaded since 2010)
      4000    0.0050    NPTS, DT             (older)
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..checks import check_memory, check_stated_count
from .contents import Contents
from .grammar import agreed_unit, units_said
from .steps import header_count, header_step
from .text import numbers_below, text_lines

_HEADER_LINES = 12
_DT = re.compile(r"\bDT\b", re.IGNORECASE)


def is_peer(lines: list[str]) -> bool:
    """Whether the first lines hold the counts of a PEER file below the unit that it names."""
    for row, line in enumerate(lines[:_HEADER_LINES]):
        if re.search(r"\bNPTS\b", line, re.IGNORECASE) and _DT.search(line):
            above = " ".join(lines[:row])
            return bool(re.search(r"PEER|TIME (?:SERIES|HISTORY)|\bUNITS\b", above, re.IGNORECASE))
    return False


def read_at2(path: Path, content: bytes, *, variable=None, dt=None) -> Contents:
    """Acceleration of a PEER file; `variable` and `dt` do not apply, the header says all.

    Lines that follow the last of NPTS values and hold no numbers are a closing comment.
    """
    lines = text_lines(path, content)
    row, count, step = _header(path, lines)
    header = list(enumerate(lines[: row + 1], 1))
    unit, notices = agreed_unit(path, units_said(path, header))
    check_memory(count, f"File {path}, line {row + 1}")
    values, places = numbers_below(path, lines, row + 1, count=count)
    check_stated_count(len(values), count, f"File {path}, line {row + 1}")
    return Contents(np.array(values), step, unit, f"File {path}", places, notices)


def _header(path: Path, lines: list[str]) -> tuple[int, int, float]:
    """Index of the line with the counts, NPTS, and DT [s]."""
    for row, line in enumerate(lines[:_HEADER_LINES]):
        if _DT.search(line):
            found = header_count(path, [(row + 1, line)])
            step = header_step(path, [(row + 1, line)])
            if found is not None and step is not None:
                return row, found[0], step
    raise InputError(
        f"File {path}: none of its first {_HEADER_LINES} lines has the number of points and the "
        "time step (NPTS= ..., DT= ...) of a PEER file; download it again, or save it as CSV."
    )
