"""CSMIP (CDMG) Volume 2: corrected accelerograms, one or more channels a file (``.V2``).

A channel has 25 lines of text, integers and reals, and then its series, of which the first is

    10100 points of accel data equally spaced at 0.010 sec, in cm/sec2. (8f10.5)

with as many fixed columns as the format says, followed by velocity and displacement.  Layout: CSMIP
Report OSMS 85-03.
"""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..checks import check_memory, check_stated_count, check_stated_peak
from ..units import parse_unit
from .columns import pick_channel
from .contents import Contents
from .grammar import first_unit
from .text import NUMBER, block_of_numbers, fixed_numbers, numbers_of, text_lines

_BLOCK = re.compile(
    rf"^\s*(\d+)\s+points\s+of\s+accel\w*\s+data\s+equally\s+spaced\s+at\s*({NUMBER.pattern})\s*"
    r"sec\w*\.?,?\s*(?:\(?\s*(?:in\s+)?(?:units:?\s*)?(.*?))?(?:\(\s*(\d+)f(\d+)\.\d+\s*\))?\s*$",
    re.IGNORECASE,
)
_CHANNEL = re.compile(r"chan\w*\s+(\d+)\s*:\s*(.+?)(?:\s{2,}|\s+from\b|\s*$)", re.IGNORECASE)
_PEAK = re.compile(rf"peak\s+accel\w*\s*=\s*({NUMBER.pattern})\s*(\S+?)\s*,?\s+at\b", re.IGNORECASE)


def is_csmip(lines: list[str]) -> bool:
    """Whether the first line is that of a Volume 1 or 2 file."""
    first = next((line for line in lines if line.strip()), "")
    return bool(re.match(r"\s*(?:un)?corrected accelerogram", first, re.IGNORECASE))


def read_csmip(path: Path, content: bytes, *, variable=None, dt=None) -> Contents:
    """Acceleration of a channel; `variable` picks it by its direction or its place."""
    lines = text_lines(path, content)
    blocks = [(row, found) for row, line in enumerate(lines) if (found := _BLOCK.match(line))]
    if not blocks:
        raise InputError(
            f"File {path} has no line of the kind 'points of accel data equally spaced at', as "
            "Volume 2 (corrected) has it; take the .V2 file of the same record."
        )
    names = [_above(lines, row, _CHANNEL) for row, _ in blocks]
    names = [found[2].strip() if found else "" for found in names]
    chosen = pick_channel(variable, names, f"File {path}")
    return _channel(path, lines, *blocks[chosen])


def _above(lines: list[str], row: int, pattern: re.Pattern) -> re.Match | None:
    """The nearest line above a block that matches, within its header of 45 lines and a few."""
    for line in reversed(lines[max(0, row - 60) : row]):
        if found := pattern.search(line):
            return found
    return None


def _channel(path: Path, lines: list[str], row: int, block: re.Match) -> Contents:
    where = f"File {path}, line {row + 1}"
    count, step = int(block[1]), float(block[2])
    check_memory(count, where)
    peak = _above(lines, row, _PEAK)
    unit = first_unit(block[3] or "") or (peak[2] if peak else None)
    unit = parse_unit(unit, f"{where},") if unit else None
    if not (count >= 2 and step > 0):
        raise InputError(f"{where}: found {count} points at {step:g} s; download the file again.")
    columns = partial(fixed_numbers, width=int(block[5])) if block[5] else numbers_of
    values, places = block_of_numbers(lines, row + 1, columns, count)
    check_stated_count(len(values), count, where, "the number of points")
    if peak and unit and parse_unit(peak[2], f"File {path}, peak acceleration") == unit:
        check_stated_peak(np.array(values), float(peak[1]), where)
    return Contents(np.array(values), step, unit, f"File {path}", places)
