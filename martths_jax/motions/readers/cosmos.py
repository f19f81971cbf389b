"""COSMOS strong-motion format, version 1.20: acceleration of Volume 1 and 2 (``.V2c``).

Lines of text, of integers and of reals, comments, and then the series:

    42000 acceleration pts, approx  210 secs, units=cm/sec2(04),Format=(1E15.6)

The time step [ms] is the 62nd real, the length [s] the 63rd and the peak the 64th; each group says
on a line of its own how many values follow and in which format.
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
from .text import block_of_numbers, fixed_numbers, text_lines

_FIRST = re.compile(r"^\s*\S.*\(format\s+v\s*[\d.]+", re.IGNORECASE)
_REALS = re.compile(
    r"^\s*(\d+)\s+real-header values.*format=\s*\(\s*\d+[ef](\d+)\.\d+\s*\)", re.IGNORECASE
)
_BLOCK = re.compile(
    r"^\s*(\d+)\s+accel\w*\s+p(?:oin)?ts.*?units\s*=\s*(.+?)\s*(?:\(\s*\d+\s*\))?\s*,\s*format\s*=\s*"
    r"\(\s*\d+[ef](\d+)\.\d+\s*\)",
    re.IGNORECASE,
)
_CHANNEL = re.compile(r"sta chan\s*\S+?\s*:\s*(.+?)\s*(?:\(|\s{2,}|$)", re.IGNORECASE)
_UNKNOWN = -999.0


def is_cosmos(lines: list[str]) -> bool:
    """Whether the first line says the version of the format."""
    return bool(lines) and bool(_FIRST.match(lines[0]))


def read_cosmos(path: Path, content: bytes, *, variable=None, dt=None) -> Contents:
    """Acceleration of a channel; `variable` picks it by its direction or its place."""
    lines = text_lines(path, content)
    starts = [row for row, line in enumerate(lines) if _FIRST.match(line)]
    blocks = [(row, found) for row, line in enumerate(lines) if (found := _BLOCK.match(line))]
    if not blocks or re.search(r"counts", lines[0], re.IGNORECASE):
        raise InputError(
            f"File {path} begins with {lines[0].strip()[:40]!r}, but corrected acceleration "
            "(Volume 2, .V2c) is wanted; download that of the same record."
        )
    names = []
    for row, _ in blocks:
        first = max((start for start in starts if start < row), default=0)
        found = [m[1] for line in lines[first:row] if (m := _CHANNEL.search(line))]
        names.append(found[0] if found else "")
    row, block = blocks[pick_channel(variable, names, f"File {path}")]
    first = max((start for start in starts if start < row), default=0)
    return _channel(path, lines, first, row, block)


def _channel(path: Path, lines: list[str], first: int, row: int, block: re.Match) -> Contents:
    where = f"File {path}, line {row + 1}"
    count = int(block[1])
    check_memory(count, where)
    unit = parse_unit(block[2], f"{where},")
    reals = _reals(path, lines, first, row)
    step = reals[61] / 1000.0
    if not (np.isfinite(step) and 0 < step):
        raise InputError(
            f"{where}: its time step (the 62nd real of the header) is {reals[61]:g} ms, but a "
            "positive one is wanted; download the file again."
        )
    columns = partial(fixed_numbers, width=int(block[3]))
    values, places = block_of_numbers(lines, row + 1, columns, count)
    check_stated_count(len(values), count, where, "the number of points")
    if reals[62] != _UNKNOWN and abs(reals[62] / step - count) > 2:
        raise InputError(
            f"{where}: {count} values at {step:g} s are not the {reals[62]:g} s that the header "
            "states; download the file again."
        )
    if reals[63] != _UNKNOWN:
        check_stated_peak(np.array(values), reals[63], where)
    notices: tuple[str, ...] = ()
    if re.match(r"\s*uncorrected", lines[first], re.IGNORECASE):
        notices = (f"File {path} is uncorrected (Volume 1); take Volume 2 where there is one.",)
    return Contents(np.array(values), step, unit, f"File {path}", places, notices)


def _reals(path: Path, lines: list[str], first: int, row: int) -> list[float]:
    """The header's reals of one channel."""
    for at in range(first, row):
        if found := _REALS.match(lines[at]):
            values: list[float] = []
            for line in lines[at + 1 : row]:
                if len(values) >= int(found[1]):
                    break
                values += fixed_numbers(line, int(found[2])) or []
            if len(values) >= 64:
                return values
    raise InputError(
        f"File {path}: its header lacks the 100 reals of the COSMOS format, of which the 62nd is "
        "the time step; download the file again."
    )
