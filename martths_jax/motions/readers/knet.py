"""K-NET and KiK-net ASCII: one component a file (``.NS``, ``.EW``, ``.UD``, ``.NS1`` ... ``.UD2``).

Seventeen lines of name and value, and then whole numbers, eight on a line.  The scale factor
``3920(gal)/6182761`` makes gal of them.  The numbers have an offset; the largest acceleration that
the header states is about their mean.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..checks import check_memory, check_stated_count, check_stated_peak
from ..units import parse_unit
from .contents import Contents
from .text import NUMBER, numbers_below, text_lines

_HEADER_LINES = 17
_SCALE = re.compile(rf"({NUMBER.pattern})\s*\((\w+)\)\s*/\s*({NUMBER.pattern})")


def is_knet(lines: list[str]) -> bool:
    """Whether the header begins as the format says."""
    head = "\n".join(lines[:_HEADER_LINES])
    return head.startswith("Origin Time") and "Scale Factor" in head


def read_knet(path: Path, content: bytes, *, variable=None, dt=None) -> Contents:
    """Acceleration of a K-NET file; `variable` and `dt` do not apply, the header says all."""
    lines = text_lines(path, content)
    scale = _SCALE.search(_value(path, lines, "Scale Factor"))
    rate = NUMBER.search(_value(path, lines, "Sampling Freq"))
    if scale is None or rate is None or not float(rate[0]) > 0 or not float(scale[3]) > 0:
        raise InputError(
            f"File {path}: its header has no sampling frequency (100Hz) or no scale factor such as "
            "3920(gal)/6182761; download it again."
        )
    check_memory(len(content) / 2, f"File {path}")
    unit = parse_unit(scale[2], f"File {path}, scale factor,")
    first = next(k for k, line in enumerate(lines) if line.startswith("Memo")) + 1
    values, places = numbers_below(path, lines, first)
    seconds = NUMBER.search(_value(path, lines, "Duration Time"))
    if seconds:
        stated = round(float(seconds[0]) * float(rate[0]))
        check_stated_count(len(values), stated, f"File {path}", "duration times frequency")
    samples = np.array(values) * (float(scale[1]) / float(scale[3]))
    offset = float(np.mean(samples)) if samples.size else 0.0
    samples = samples - offset
    peak = NUMBER.search(_value(path, lines, "Max"))
    if peak:
        check_stated_peak(samples, float(peak[0]), f"File {path}")
    notice = f"File {path}: the mean of its numbers ({offset:.4g} {scale[2]}) was taken off."
    return Contents(samples, 1 / float(rate[0]), unit, f"File {path}", places, (notice,))


def _value(path: Path, lines: list[str], name: str) -> str:
    """What stands behind a name and its unit in the header."""
    for line in lines[:_HEADER_LINES]:
        if line.startswith(name):
            return line[18:] if len(line) > 18 else ""
    raise InputError(f"File {path}: its header lacks {name!r}; download it again.")
