"""AFAD (Türkiye), files of the national network until 2020: three components in gal (``.txt``).

Lines of ``NAME : value`` with NUMBER OF DATA and SAMPLING INTERVAL (sec), a line of the components,
``N-S  E-W  U-D``, and three columns.  The unit is that of RAW PGA VALUES (gal).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..checks import check_memory, check_stated_count
from ..units import parse_unit
from .columns import pick, several
from .contents import Contents
from .text import NUMBER, numbers_of, text_lines

_FIRST = "STRONG GROUND MOTION RECORDS OF T"
_ENTRY = re.compile(r"\s*([A-Z][A-Z ]*?)\s*(?:\((\w+)\))?\s*:\s*(.*)")
_HEADER_LINES = 30


def is_afad(lines: list[str]) -> bool:
    """Whether the first line is the archive's."""
    return bool(lines) and _FIRST in lines[0].upper()


def read_afad(path: Path, content: bytes, *, variable=None, dt=None) -> Contents:
    """Acceleration of one component; `variable` picks it (``NS``, ``EW``, ``UD`` or 1 to 3)."""
    lines = text_lines(path, content)
    entries = {m[1]: m for line in lines[:_HEADER_LINES] if (m := _ENTRY.fullmatch(line))}
    count = NUMBER.fullmatch(_text(path, entries, "NUMBER OF DATA"))
    step = NUMBER.fullmatch(_text(path, entries, "SAMPLING INTERVAL"))
    peaks = entries.get("RAW PGA VALUES")
    if not (count and step and float(count[0]) >= 2 and float(step[0]) > 0):
        raise InputError(
            f"File {path}: found no NUMBER OF DATA of at least 2 or no positive SAMPLING INTERVAL "
            "in its header; download it again."
        )
    check_memory(3 * float(count[0]), f"File {path}, NUMBER OF DATA")
    title = [k for k, line in enumerate(lines[:_HEADER_LINES]) if re.match(r"\s*N-?S\s+E-?W", line)]
    names = lines[title[0]].split() if title else ["N-S", "E-W", "U-D"]
    first = title[0] + 1 if title else len(entries) + 1
    rows: list[list[float]] = []
    places: list[int] = []
    for number, line in enumerate(lines[first:], first + 1):
        found = numbers_of(line)
        if found == []:
            continue
        if found is None or len(found) != len(names):
            raise InputError(
                f"File {path}, line {number}: found {line.strip()[:40]!r}, but {len(names)} "
                "numbers a line are wanted below the header; download the file again."
            )
        rows.append(found)
        places.append(number)
    check_stated_count(len(rows), int(float(count[0])), f"File {path}", "NUMBER OF DATA")
    if variable is None:
        raise several(f"File {path}", names, list(range(len(names))))
    chosen = pick(variable, names, f"File {path}", "component")
    values = np.array(rows)[:, chosen]
    unit = parse_unit(peaks[2], f"File {path}, RAW PGA VALUES,") if peaks and peaks[2] else None
    if peaks:
        _check_raw_peak(path, values, names[chosen], peaks[3])
    return Contents(values, float(step[0]), unit, f"File {path}", places)


def _text(path: Path, entries: dict, name: str) -> str:
    if name not in entries:
        raise InputError(f"File {path}: its header lacks {name}; download it again.")
    return entries[name][3].strip()


def _check_raw_peak(path: Path, values: np.ndarray, name: str, text: str) -> None:
    """Refuse samples that are far from the peak stated, which is that of the raw record."""
    found = re.search(rf"\({re.escape(name)}\)\s*({NUMBER.pattern})", text)
    peak = float(np.max(np.abs(values)))
    if found and float(found[1]) > 0 and not 0.5 < peak / float(found[1]) < 2:
        raise InputError(
            f"File {path}: its header says that the raw peak of {name} is {found[1]} gal, but the "
            f"samples reach {peak:.6g}; they are not in gal: write them as CSV with their unit."
        )
