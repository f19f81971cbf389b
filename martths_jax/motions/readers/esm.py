"""ESM and ITACA (DYNA 1.2) and AFAD's TADAS: one component a file (``.ASC``).

Lines of ``NAME: value``, then a value a line.  Needed are SAMPLING_INTERVAL_S, NDATA, UNITS and
DATA_TYPE; PGA_CM/S^2 is compared where it is given.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..checks import check_memory, check_stated_count, check_stated_peak
from ..units import TO_SI, parse_unit
from .contents import Contents
from .grammar import other_quantity
from .steps import header_step
from .text import NUMBER, numbers_below, numbers_of, text_lines

_ENTRY = re.compile(r"([A-Z][A-Z0-9_/^]*)\s*:\s*(.*)")


def is_esm(lines: list[str]) -> bool:
    """Whether the header is made of the format's entries."""
    head = "\n".join(lines[:70])
    return bool(re.search(r"^SAMPLING_INTERVAL_S\s*:", head, re.M)) and "NDATA" in head


def read_esm(path: Path, content: bytes, *, variable=None, dt=None) -> Contents:
    """Acceleration of an ESM file; `variable` and `dt` do not apply, the header says all."""
    lines = text_lines(path, content)
    entries: dict[str, tuple[int, str]] = {}
    for number, line in enumerate(lines, 1):
        if not (found := _ENTRY.match(line)):
            break
        entries[found[1]] = (number, found[2].strip())
    first = len(entries)
    kind = entries.get("DATA_TYPE", (0, "ACCELERATION"))
    if "ACCELERATION" not in kind[1].upper() or "SPECTR" in kind[1].upper():
        raise other_quantity(path, kind[0], kind[1].lower() or "nameless")
    step = header_step(
        path, [(n, f"dt = {text}") for n, text in _get(entries, "SAMPLING_INTERVAL_S")]
    )
    counts = [NUMBER.fullmatch(text) for _, text in _get(entries, "NDATA")]
    if step is None or not counts or counts[0] is None:
        raise InputError(
            f"File {path}: its header lacks SAMPLING_INTERVAL_S or NDATA; download it again."
        )
    unit = None
    for number, text in _get(entries, "UNITS"):
        unit = parse_unit(text, f"File {path}, line {number},")
    check_memory(float(counts[0][0]), f"File {path}, NDATA")
    wanted = "one number a line is wanted below the header"
    values, places = numbers_below(path, lines, first, _one_number, wanted)
    check_stated_count(len(values), int(float(counts[0][0])), f"File {path}", "NDATA")
    for _, text in _get(entries, "PGA_CM/S^2"):
        if unit and NUMBER.fullmatch(text):
            stated = float(text) * TO_SI["cm/s2"] / TO_SI[unit]
            check_stated_peak(np.array(values), stated, f"File {path}")
    return Contents(np.array(values), step, unit, f"File {path}", places)


def _get(entries: dict, name: str) -> list[tuple[int, str]]:
    """An entry and its line, in a list that is empty where it has no value."""
    return [entries[name]] if entries.get(name, (0, ""))[1] else []


def _one_number(line: str) -> list[float] | None:
    """The number of a line, none if it is empty, None if it holds more."""
    found = numbers_of(line)
    return None if found is None or len(found) > 1 else found
