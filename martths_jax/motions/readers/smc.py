"""SMC format of the U.S. Geological Survey: one component a file, cm/s^2 (``.smc``).

Eleven lines of text (the first says what it is), six lines of integers (8I10), ten of reals
(5E15.7), comments that start with ``|``, and the samples (8F10).  The 16th integer counts the
comments, the 17th the samples; the 2nd real is the sampling rate [Hz], the 30th the largest and the
32nd the smallest sample.  Integers and reals that are not known equal the first of their group.
"""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..checks import check_memory, check_stated_count, check_stated_peak
from .contents import Contents
from .grammar import other_quantity
from .text import fixed_numbers, numbers_below, text_lines

_TEXT, _INTEGERS, _REALS = 11, 6, 10
_FIRST = re.compile(
    r"\s*(\d)\s+(UNKNOWN|(?:UN)?CORRECTED ACCELEROGRAM|VELOCITY|DISPLACEMENT|RESPONSE SPECTRA|"
    r"FOURIER.*)\s*",
    re.IGNORECASE,
)


def is_smc(lines: list[str]) -> bool:
    """Whether the first line is one of the format's titles."""
    return bool(lines) and bool(_FIRST.fullmatch(lines[0]))


def read_smc(path: Path, content: bytes, *, variable=None, dt=None) -> Contents:
    """Acceleration of an SMC file; `variable` and `dt` do not apply, the header says all."""
    lines = text_lines(path, content)
    kind = _FIRST.fullmatch(lines[0])[2].upper()
    if "ACCELEROGRAM" not in kind:
        raise other_quantity(path, 1, kind.lower())
    integers = _numbers(path, lines, _TEXT, _INTEGERS, 10)
    reals = _numbers(path, lines, _TEXT + _INTEGERS, _REALS, 15)
    comments, count, rate = integers[15], integers[16], reals[1]
    if not (count >= 2 and count == int(count) and 0 <= comments < len(lines)):
        raise InputError(f"File {path}, line 14: found {count:g} samples; download it again.")
    if rate in (reals[0], 0) or not 1 <= rate <= 1e5:
        raise InputError(
            f"File {path}, line 18: found the sampling rate {rate:g} Hz, but an evenly sampled "
            "record is wanted; take the corrected file (Volume 2)."
        )
    check_memory(count, f"File {path}, line 14")
    start = _TEXT + _INTEGERS + _REALS + int(comments)
    columns, wanted = partial(fixed_numbers, width=10), "only numbers may follow the comments"
    values, places = numbers_below(path, lines, start, columns, wanted)
    check_stated_count(len(values), int(count), f"File {path}, line 14", "the number of samples")
    stated = [reals[k] for k in (29, 31) if reals[k] != reals[0]]
    if stated:
        peak = max(stated, key=abs)
        check_stated_peak(np.array(values), peak, f"File {path}")
    notices: tuple[str, ...] = ()
    if kind.startswith("UN"):
        notices = (f"File {path} is uncorrected (Volume 1); take Volume 2 where there is one.",)
    return Contents(np.array(values), 1 / rate, "cm/s2", f"File {path}", places, notices)


def _numbers(path: Path, lines: list[str], first: int, count: int, width: int) -> list[float]:
    """Numbers of `count` header lines in columns of `width`."""
    values: list[float] = []
    for number in range(first, first + count):
        found = fixed_numbers(lines[number], width) if number < len(lines) else None
        if found is None or len(found) != 80 // width:
            raise InputError(
                f"File {path}, line {number + 1}: {80 // width} numbers in columns of {width} are "
                "wanted in the header of an SMC file; download it again."
            )
        values += found
    return values
