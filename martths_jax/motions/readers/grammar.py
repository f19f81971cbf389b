"""The grammar of a header: what is a unit, where it may stand, and what contradicts what.

A **unit** is a unit of acceleration (`units.TO_SI`, however it is spelt), a unit of time, or
anything built like a unit (``mg``, ``mm``, ``ft/s2``, ``g/10``).  A date, a direction or a word in
brackets is none.

A unit of the samples **may stand**

1. in the title of a column: ``acc [g]``, ``acc (g)``, ``acc in g``, ``acc, g``, ``acc_g``,
   ``a/g``, or in a row of units of its own below the titles;
2. in a declaration: ``units: g``, ``UNITS OF G``, ``The units are (g)``, ``units: s, g``;
3. in brackets or after ``in`` behind a word for acceleration: ``Acceleration (NS) [g]``,
   ``acceleration in g``.  Behind any other word it counts where nothing else says a unit, and a
   notice says so.

It may **not** stand beside a number: ``PGA = 294.2 [cm/s2]``, ``PGA (cm/s2): 294.2``, ``Vs30 = 300
m/s`` say something of a value, not of the samples.

It **contradicts** that two of 1 and 2 and 3 name different units, or one of them another than the
argument `units`; that the chosen column is a velocity or a displacement, or names a unit that is
none of acceleration (whatever `units` says); that two time steps differ, or a number of samples
(``NPTS = 400``) and the samples.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from ...errors import InputError
from ..units import TO_SI, is_unit, looks_like_unit, parse_unit, time_unit

_BRACKET = re.compile(r"\[([^\[\]]*)\]|\(((?:[^()]|\([^()]*\))*)\)|\{([^{}]*)\}")
_VALUE_BEFORE = re.compile(r"(?:[=:]\s*[-+]?[\d.]+|\d*\.\d+|\de[-+]?\d+)\s*$", re.IGNORECASE)
_VALUE_AFTER = re.compile(r"\s*[=:]\s*[-+]?[\d.]")
_OF_A_VALUE = re.compile(
    r"\b(?:pg[avd]|peak|max\w*|min\w*|rms|scale\w*|factor|sensitivity|range|resolution|lsb|arias)\b",
    re.IGNORECASE,
)
_ACCELERATION = re.compile(
    r"(?<![^\W_])(?:acc\w*|ac|a|ag|xg\w*|ug\w*|beschl\w*|acél\w*|acel\w*|accél\w*|ivme\w*|gm|"
    r"ground[ _-]?motion|seismogram)(?![^\W_])",
    re.IGNORECASE,
)
_TIME = re.compile(
    r"(?<![^\W_])(?:t|tt|time\w*|tout|zeit\w*|tiempo|temps|tempo|zaman|seconds?|secs?)(?![^\W_])",
    re.IGNORECASE,
)
_COUNTER = re.compile(r"(?:n|no|nr|i|k|idx|index|#|samples?|rows?|points?|steps?)\.?", re.I)
_OTHER = re.compile(
    r"(?<![^\W_])(?:vel\w*|v|displ?\w*|geschw\w*|versch\w*|jerk|force|load|stroke|strain|volt\w*|"
    r"freq\w*|period|sa|psa|spectr\w*)(?![^\W_])",
    re.IGNORECASE,
)
_SPECTRAL = re.compile(r"(?<![^\W_])(?:p?s[av]|sd|spectr\w*)(?![^\W_])", re.IGNORECASE)
_FACTOR = re.compile(
    r"\b(?:scal(?:e|ing)|conversion|multipl\w*)(?:[ _]?factor)?\s*[=:]\s*(\d[\d.,eE+-]*)",
    re.IGNORECASE,
)
_DECLARED = re.compile(
    r"\bunits?\b(?P<word>\s*(?:of|are|is|in|:|=)+)?(?:\s*(?:of|are|is|in|:|=))*\s*", re.IGNORECASE
)
_IN = re.compile(r"\bacc\w*\b[^=:\d\[(]*?\b(?P<word>in)\s+(?:units\s+of\s+)?[\[({]?", re.IGNORECASE)
_DIRECTION = re.compile(r"[NSEWUDVHLTXYZ][NSEWUD]?[ -]?\w{0,3}|-?\d+|[NSEW]\d+[NSEW]", re.I)


@dataclass(frozen=True)
class Cell:
    """Title of a column: its name, and its unit as written (None where it has none)."""

    name: str
    unit: str | None

    @property
    def is_time(self) -> bool:
        """Whether the column says that it is the time."""
        if _ACCELERATION.search(self.name) or _OTHER.search(self.name):
            return False
        named = bool(_TIME.search(self.name))
        return named or (not self.name and bool(self.unit) and time_unit(self.unit) is not None)

    @property
    def is_counter(self) -> bool:
        """Whether the column says that it counts its rows."""
        return bool(_COUNTER.fullmatch(self.name))

    @property
    def is_spectral(self) -> bool:
        """Whether the column says that it is a response spectrum."""
        return bool(_SPECTRAL.search(self.name))

    @property
    def is_other(self) -> bool:
        """Whether the column says that it is no motion's acceleration, by its name or its unit."""
        if self.is_spectral:
            return True
        if self.unit and looks_like_unit(self.unit) and not is_unit(self.unit):
            return True
        named = _OTHER.search(self.name) and not _ACCELERATION.search(self.name)
        return bool(named) and not (self.unit and is_unit(self.unit))


@dataclass(frozen=True)
class Said:
    """A unit that a header names: as written, its line, and whether it surely means the samples."""

    text: str
    line: int
    sure: bool = True


def surely_acceleration(name: str, line: str) -> bool:
    """Whether the title of an only column means the samples: by its name, or by [ ]."""
    direction = _DIRECTION.fullmatch(name) is not None
    return not name or "[" in line or direction or bool(_ACCELERATION.search(name))


def is_acceleration(cell: Cell) -> bool:
    """Whether a column says that it is an acceleration, by its name or its unit."""
    return bool(_ACCELERATION.search(cell.name)) or bool(cell.unit and is_unit(cell.unit))


def _inside(match: re.Match) -> str:
    text = next(group for group in match.groups() if group is not None).strip()
    return re.sub(r"^(?:in|units?:?)\s+", "", text, flags=re.IGNORECASE)


def _names_unit(text: str, square: bool) -> bool:
    """Whether what stands in brackets is meant for a unit, known or not."""
    if looks_like_unit(text) or any(is_unit(word) for word in re.split(r"[\s,;]+", text)):
        return True
    return square and bool(re.search(r"[a-z]", text, re.I)) and not _DIRECTION.fullmatch(text)


def parse_cell(text: str) -> Cell:
    """Name and unit of a column's title."""
    text = text.strip().strip("\"'").strip(" \t:;,")
    if looks_like_unit(text) and not (len(text) == 1 and text not in "gG"):
        return Cell("", text)
    for match in reversed(list(_BRACKET.finditer(text))):
        inside = _inside(match)
        if inside and _names_unit(inside, match[0][0] == "["):
            return Cell((text[: match.start()] + text[match.end() :]).strip(" /,_"), inside)
        if inside in ("-", "1"):
            return Cell(text[: match.start()].strip(), inside)
    found = _tail(text)
    return Cell(found[0].strip(" /,_"), found[1]) if found else Cell(text, None)


def _tail(text: str) -> tuple[str, str] | None:
    """Name and unit of a title without brackets.

    The unit stands after ``in``, a blank, a comma or an underscore, or after a slash (``a/g``).  A
    last word that is built like another unit counts, but for one letter: ``acc V`` is a direction.
    """
    places = list(re.finditer(r"(?:\s+in)?[\s,;_]+(?=\S)", text))
    tails = [(text[: m.start()], text[m.end() :], m[0].strip().lower() == "in") for m in places]
    slash = re.fullmatch(r"([^/]*[^\W\d_])\s*/\s*(.+)", text)
    for name, tail, said in tails:
        if name and (_is_known(tail) or (said and looks_like_unit(tail))):
            return name, tail
    last = [(name, tail) for name, tail, _ in tails[-1:]] + ([slash.groups()] if slash else [])
    for name, tail in last:
        other = looks_like_unit(tail) and len(tail) > 1 and tail.lower() != "in"
        if name and (_is_known(tail) or other):
            return name, tail
    return None


def _is_known(text: str) -> bool:
    return is_unit(text) or time_unit(text) is not None


def column_cells(line: str, split: list[str], columns: int) -> tuple[Cell, ...]:
    """Titles of `columns` columns in a header line, empty where it is no line of titles.

    `split` are the line's cells by the separator of the rows.
    """
    if any(found["word"] for found in _DECLARED.finditer(line)):
        return ()
    if columns == 1:
        split = [line]
        if _OF_A_VALUE.search(line):
            return ()
        if any(_VALUE_BEFORE.search(line[: found.start()]) for found in _BRACKET.finditer(line)):
            return ()
    tries = [split, re.split(r"\s{2,}|\t", line), re.findall(r"[^\])}]*[\])}]", line), line.split()]
    for cells in tries:
        cells = [cell for cell in cells if cell.strip()]
        if len(cells) == columns:
            return tuple(parse_cell(cell) for cell in cells)
        units = [unit.strip("[](){} ") for unit in cells[1::2]]
        if len(cells) == 2 * columns and all(map(looks_like_unit, units)):
            pairs = zip(cells[::2], units, strict=True)
            return tuple(parse_cell(f"{name} [{unit}]") for name, unit in pairs)
    return ()


def units_row(cells: tuple[Cell, ...]) -> tuple[str, ...]:
    """The units of a line that holds nothing else, one a column; empty for any other line."""
    units = [cell.unit if not cell.name else cell.name for cell in cells]
    alone = all(not (cell.name and cell.unit) for cell in cells)
    good = alone and all(unit and looks_like_unit(unit) for unit in units)
    return tuple(units) if good else ()


def says_value(line: str) -> bool:
    """Whether a header line gives a value (``name = 3.2``), so that it cannot be a title."""
    return bool(re.search(r"[=:]\s*[-+]?[\d.]", line))


def units_said(path: Path, header: list[tuple[int, str]]) -> list[Said]:
    """Every unit of the samples in free lines of a header, in their order."""
    found: list[Said] = []
    for number, line in header:
        declared = _declared(path, number, line)
        found += declared if declared else _bracketed(number, line)
    return found


def _declared(path: Path, number: int, line: str) -> list[Said]:
    """Units after ``units of``, ``units:``, or after ``acceleration in``."""
    for pattern in (_DECLARED, _IN):
        for match in pattern.finditer(line):
            rest = line[match.end() :].strip(" \t[({\"'")
            parts = [first_unit(part) for part in re.split(r"[,;&\t]", rest)]
            units = [part for part in parts if part and (match["word"] or is_unit(part))]
            kind = re.search(r"velocity|displacement", line, re.IGNORECASE)
            if units and kind and not _ACCELERATION.search(line):
                raise other_quantity(path, number, kind[0].lower())
            accelerations = [part for part in units if is_unit(part)]
            if accelerations:
                return [Said(text, number) for text in accelerations]
            other = [part for part in units if time_unit(part) is None]
            if other:
                return [Said(other[0], number)]
            plural = "units" in match[0].lower() and pattern is _DECLARED and match["word"]
            if plural and not units and (word := re.match(r"[A-Za-z%][^\s,;)\]]*", rest)):
                return [Said(word[0], number)]
    return []


def first_unit(text: str) -> str | None:
    """The longest unit that a text begins with (up to five words)."""
    words = text.strip().split()[:5]
    for count in range(len(words), 0, -1):
        joined = " ".join(words[:count]).strip(" .,;:)]}\"'")
        if joined.count("(") > joined.count(")"):
            joined += ")"
        if looks_like_unit(joined):
            return joined
    return None


def _bracketed(number: int, line: str) -> list[Said]:
    """Units in brackets of a free line, but for those of a value."""
    found = []
    for match in _BRACKET.finditer(line):
        inside, name = _inside(match), re.split(r"[,;|:\t\])]", line[: match.start()])[-1]
        name = name or line[: match.start()]
        if _VALUE_BEFORE.search(name) or _VALUE_AFTER.match(line[match.end() :]):
            continue
        if _OF_A_VALUE.search(name) or "=" in name:
            continue
        sure = bool(_ACCELERATION.search(line[: match.start()]))
        if is_unit(inside) or (sure and looks_like_unit(inside) and time_unit(inside) is None):
            if not (_TIME.search(name) and not sure):
                found.append(Said(inside, number, sure and not _OTHER.search(name)))
    return found


def factors_said(path: Path, header: list[tuple[int, str]]) -> tuple[str, ...]:
    """Notices of scale factors in a header: they may be applied already, and are not applied."""
    found = [(number, m[1]) for number, line in header if (m := _FACTOR.search(line))]
    return tuple(
        f"File {path}, line {number}: its scale factor {text} was not applied to the samples; "
        "scale them if it should be."
        for number, text in found
        if text.rstrip(".0").rstrip(",") != "1"
    )


def other_quantity(path: Path, line: int, kind: str) -> InputError:
    """The error for a file or column that holds no acceleration."""
    return InputError(
        f"File {path}, line {line}: found a {kind} history, but an acceleration is wanted; take "
        "the acceleration of the same record (the .AT2 file, or another column with `variable`, "
        "--variable)."
    )


def agreed_unit(path: Path, said: list[Said]) -> tuple[str | None, tuple[str, ...]]:
    """The one unit that all of `said` name, and notices; refuses a contradiction."""
    chosen = [one for one in said if one.sure] or said
    units = {parse_unit(one.text, f"File {path}, line {one.line},"): one for one in chosen}
    if len(units) > 1:
        told = " and ".join(f"{unit} (line {one.line})" for unit, one in units.items())
        raise InputError(
            f"File {path} names two units of acceleration, {told}, but its samples can have only "
            f"one of {', '.join(TO_SI)}; correct the header."
        )
    if not units:
        return None, ()
    unit, one = next(iter(units.items()))
    if one.sure:
        return unit, ()
    notice = (
        f"File {path}: the unit {unit} was taken from the brackets in line {one.line}; check that "
        "it means the samples."
    )
    return unit, (notice,)
