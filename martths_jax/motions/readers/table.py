"""CSV and other plain tables: acceleration alone, or time and acceleration."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..checks import uniform_step
from ..units import is_unit, parse_unit
from .contents import Contents
from .text import NUMBER, numbers_of, text_lines, to_float

_BRACKETS = re.compile(r"[\[(]\s*([^\])]*?)\s*[\])]")
_STEP = re.compile(rf"\bdt\s*(?:\[s\]|\(s\))?\s*[=:]\s*({NUMBER.pattern})", re.IGNORECASE)
_TIMELIKE = re.compile(r"^\s*#?\s*\"?\s*(t|time)\b", re.IGNORECASE)
_HEADER_LINES = 20


def read_table(path: Path, content: bytes, *, variable=None, dt=None) -> Contents:
    """Acceleration of a text table with one or two columns and an optional header.

    Columns are separated by commas, semicolons, tabs or spaces.  Lines before the first numbers
    (20 at most) and lines that start with ``#`` are the header; a unit there stands in brackets
    after the column's name (``acceleration [g]``), a time step as ``dt = 0.005``.
    """
    header, rows, places = _split(path, text_lines(path, content))
    if not rows:
        raise InputError(
            f"File {path} holds no numbers, but one column (acceleration) or two (time, "
            "acceleration) are wanted; check that this is the right file."
        )
    where = f"File {path}"
    columns = len(rows[0])
    for row, place in zip(rows, places, strict=True):
        if len(row) != columns or columns > 2:
            wanted = "1 or 2" if columns > 2 else f"{columns} as in line {places[0]}"
            raise InputError(
                f"File {path}, line {place}: found {len(row)} columns, but {wanted} are wanted "
                "(acceleration, or time and acceleration); remove the others."
            )
    data = np.array(rows)
    unit = _unit(path, header)
    if columns == 1:
        return Contents(data[:, 0], _step(path, header), unit, where, places)
    if len(rows) < 2:
        raise InputError(f"{where} holds one row of numbers, but a motion needs at least 2.")
    return Contents(data[:, 1], uniform_step(data[:, 0], where, places), unit, where, places)


def _split(path: Path, lines: list[str]):
    """Header lines with their numbers, rows of numbers, and the rows' line numbers."""
    header: list[tuple[int, str]] = []
    rows: list[list[float]] = []
    places: list[int] = []
    for number, line in enumerate(lines, 1):
        stripped = line.strip()
        if not stripped:
            continue
        if stripped.startswith(("#", "%")):
            header.append((number, stripped))
            continue
        row = _row(stripped)
        if row is not None:
            rows.append(row)
            places.append(number)
        elif not rows and len(header) < _HEADER_LINES:
            header.append((number, stripped))
        else:
            raise InputError(
                f"File {path}, line {number}: found {stripped[:40]!r}, but only numbers may follow "
                "the header; correct or remove the line."
            )
    return header, rows, places


def _row(line: str) -> list[float] | None:
    """Numbers of a line; an empty field between two separators counts as not a number."""
    if re.search(r"[,;]\s*[,;]", line):
        return None
    values = numbers_of(line)
    return values or None


def _unit(path: Path, header: list[tuple[int, str]]) -> str | None:
    """The unit in brackets after the name of the last column that is not time."""
    for number, line in reversed(header):
        for part in reversed(re.split(r"[,;\t]", line)):
            match = _BRACKETS.search(part)
            if match is None or _TIMELIKE.match(part) or _STEP.search(part):
                continue
            if is_unit(match[1]) or "/" in match[1]:  # other brackets are part of a title
                return parse_unit(match[1], f"File {path}, line {number},")
    return None


def _step(path: Path, header: list[tuple[int, str]]) -> float | None:
    for number, line in header:
        if match := _STEP.search(line):
            step = to_float(match[1])
            if not (np.isfinite(step) and step > 0):
                raise InputError(
                    f"File {path}, line {number}: found dt = {match[1][:40]}, but a positive time "
                    "step [s] is wanted; correct it."
                )
            return step
    return None
