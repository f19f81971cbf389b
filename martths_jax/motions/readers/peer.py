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
from ..checks import check_memory
from ..units import parse_unit
from .contents import Contents
from .text import NUMBER, numbers_of, text_lines, to_float

_HEADER_LINES = 12
_NPTS = re.compile(rf"NPTS\s*=\s*({NUMBER.pattern})", re.IGNORECASE)
_DT = re.compile(rf"\bDT\s*=\s*({NUMBER.pattern})", re.IGNORECASE)
_OLD = re.compile(rf"^\s*(\d+)\s+({NUMBER.pattern})\s+NPTS\s*,\s*DT", re.IGNORECASE)
_UNITS = re.compile(r"UNITS?\s*(?:OF|:|=|ARE)?\s*([A-Za-z/0-9^*\-]+)", re.IGNORECASE)


def read_at2(path: Path, content: bytes, *, variable=None, dt=None) -> Contents:
    """Acceleration of a PEER file; `variable` and `dt` do not apply, the header says all."""
    lines = text_lines(path, content)
    row, count, step = _header(path, lines)
    unit = _unit(path, lines[:row])
    check_memory(count, f"File {path}, line {row + 1}")
    values: list[float] = []
    places: list[int] = []
    for number, line in enumerate(lines[row + 1 :], row + 2):
        found = numbers_of(line)
        if found is None:
            raise InputError(
                f"File {path}, line {number}: found {line.strip()[:40]!r}, but only numbers may "
                "follow the header; download the file again."
            )
        values.extend(found)
        places.extend([number] * len(found))
    if len(values) != count:
        fewer = len(values) < count
        remedy = "it is truncated: download it again" if fewer else "correct NPTS or the data"
        raise InputError(
            f"File {path}, line {row + 1}: the header says NPTS = {count}, but {len(values)} "
            f"values follow; {remedy}."
        )
    return Contents(np.array(values), step, unit, f"File {path}", places)


def _header(path: Path, lines: list[str]) -> tuple[int, int, float]:
    """Index of the line with the counts, NPTS, and DT [s]."""
    for row, line in enumerate(lines[:_HEADER_LINES]):
        old = _OLD.search(line)
        count, step = (old[1], old[2]) if old else (_NPTS.search(line), _DT.search(line))
        if count is None or step is None:
            continue
        count, step = (count, step) if old else (count[1], step[1])
        points, seconds = to_float(count), to_float(step)
        if not (np.isfinite(points) and points == int(points) and points >= 2):
            raise InputError(
                f"File {path}, line {row + 1}: found NPTS = {count[:40]}, but a whole number of at "
                "least 2 is wanted; download the file again."
            )
        if not (np.isfinite(seconds) and seconds > 0):
            raise InputError(
                f"File {path}, line {row + 1}: found DT = {step[:40]}, but a positive time step is "
                "wanted; download the file again."
            )
        return row, int(points), seconds
    raise InputError(
        f"File {path}: none of its first {_HEADER_LINES} lines has the number of points and the "
        "time step (NPTS= ..., DT= ...) of a PEER file; download it again, or save it as CSV."
    )


def _unit(path: Path, header: list[str]) -> str | None:
    """The unit that the header names, if it does; refuses velocity and displacement."""
    for number, line in enumerate(header, 1):
        match = _UNITS.search(line)
        if match is None:
            continue
        kind = re.search(r"VELOCITY|DISPLACEMENT", line, re.IGNORECASE)
        if kind:
            raise InputError(
                f"File {path}, line {number}: found a {kind[0].lower()} history, but an "
                "acceleration is wanted; take the .AT2 file of the same record."
            )
        return parse_unit(match[1], f"File {path}, line {number},")
    return None
