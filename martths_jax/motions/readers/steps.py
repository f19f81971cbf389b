"""Time step and number of samples as headers state them (see `grammar`)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..units import time_unit

_NUMBER = r"[-+]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eEdD][-+]?\d+)?"
_UNIT = r"(?:\s*[\[(]?\s*(?P<{}>(?!(?:is|of)\b)[a-zA-Zµμ]+)\.?\s*[\])]?)?"
_STEP = re.compile(
    r"(?<![^\W_])(?:dt|delta[ _]?t|Δt|time[ _]?(?:step|interval|increment)|sampling[ _]"
    r"(?:interval|period|time|step))(?:_(?P<tail>m?s))?(?![^\W_])"
    + _UNIT.format("before")
    + rf"\s*(?:[=:]|\bis\b|\bof\b|\s)\s*(?P<value>{_NUMBER})(?!\s*[\d,.]*\s*[:/]\d)"
    + _UNIT.format("after"),
    re.IGNORECASE,
)
_RATE = re.compile(
    r"(?<![^\W_])(?:fs|f_s|sampling[ _]?(?:rate|freq\w*)|sample[ _]?rate|"
    r"samples?[ _/]?per[ _]?s\w*)"
    r"(?![^\W_])(?:\s*[\[(]?\s*(?P<before>k?hz|sps|1/s)\s*[\])]?)?"
    rf"\s*(?:[=:]|\bis\b|\bof\b|\s)\s*(?P<value>{_NUMBER})(?:\s*(?P<after>[a-zA-Z]+))?",
    re.IGNORECASE,
)
_COUNT = re.compile(
    r"(?<![^\W_])(?:npts?|ndata|n_?points|n_?samples|(?:number|no\.?)[ _]of[ _](?:points|samples|"
    rf"data(?:[ _]points)?|values))(?![^\W_])\s*[=:]\s*(?P<value>{_NUMBER})",
    re.IGNORECASE,
)
_OLD = re.compile(rf"^\s*(?P<count>\d+)\s+(?P<step>{_NUMBER})\s+NPTS?\s*,\s*DT\b", re.IGNORECASE)
_HERTZ = {"hz": 1.0, "khz": 1e3, "sps": 1.0, "1/s": 1.0}


def _number(path: Path, line: int, text: str) -> float:
    """A number of a header, whose comma is a decimal comma where it can be nothing else."""
    text = text.rstrip(",").replace("D", "E").replace("d", "e")
    if "," in text and not re.match(r"[-+]?0?,", text):
        raise InputError(
            f"File {path}, line {line}: found {text}, whose comma may be a decimal comma or part "
            "two numbers; write it with a decimal point."
        )
    return float(text.replace(",", "."))


def header_step(path: Path, header: list[tuple[int, str]]) -> float | None:
    """The time step [s] that a header states (``dt = 5 ms``, ``fs = 200 Hz``), None without.

    Raises:
        InputError: a step that is no positive time, an unknown unit, or two different steps.
    """
    found: dict[int, float] = {}
    for number, line in header:
        if old := _OLD.match(line):
            found[number] = _positive(path, number, old["step"], 1.0)
        elif match := _STEP.search(line):
            unit = match["before"] or match["tail"] or match["after"] or "s"
            factor = time_unit(unit)
            if factor is None and match["before"] is None and match["tail"] is None:
                factor = 1.0  # a word behind the number that is no unit
            if factor is None:
                raise InputError(
                    f"File {path}, line {number}: found a time step in {unit!r:.30}, but s or ms "
                    "are wanted; correct it."
                )
            found[number] = _positive(path, number, match["value"], factor)
        elif match := _RATE.search(line):
            found[number] = _rate(path, number, match)
    if len({f"{step:.4g}" for step in found.values()}) > 1:
        told = " and ".join(f"{step:.6g} s (line {line})" for line, step in found.items())
        raise InputError(f"File {path} states two time steps, {told}; correct the header.")
    return next(iter(found.values()), None)


def _rate(path: Path, number: int, match: re.Match) -> float:
    unit = (match["before"] or match["after"] or "hz").lower()
    if unit not in _HERTZ and time_unit(unit) is not None:
        return _positive(path, number, match["value"], time_unit(unit))
    rate = _number(path, number, match["value"]) * _HERTZ.get(unit, 1.0)
    if not (np.isfinite(rate) and rate >= 1):
        raise InputError(
            f"File {path}, line {number}: found the sampling rate {match['value'][:40]}, but at "
            "least 1 Hz is wanted; write a time step as dt = 0.005."
        )
    return 1.0 / rate


def _positive(path: Path, number: int, text: str, factor: float) -> float:
    step = _number(path, number, text) * factor
    if not (np.isfinite(step) and step > 0):
        raise InputError(
            f"File {path}, line {number}: found dt = {text[:40]}, but a positive time step [s] is "
            "wanted; correct it."
        )
    return step


def header_count(path: Path, header: list[tuple[int, str]]) -> tuple[int, int] | None:
    """The number of samples that a header states, and its line."""
    for number, line in header:
        text = old["count"] if (old := _OLD.match(line)) else None
        if text is None and (match := _COUNT.search(line)):
            text = match["value"].rstrip(",.")
        if text is None:
            continue
        count = _number(path, number, text)
        if not (np.isfinite(count) and count == int(count) and count >= 2):
            raise InputError(
                f"File {path}, line {number}: found NPTS = {text[:40]}, but a whole number of at "
                "least 2 is wanted; correct it."
            )
        return int(count), number
    return None
