"""How a table is written: header and rows told apart, separator, decimal sign, quotes."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

from ...errors import InputError
from .text import numbers_of, to_float

#: Signs that make a line a comment.
COMMENT = ("#", "%", "//", "!")

_HEADER_LINES = 60
_LETTER = re.compile(r"[^\W\d_]")
_NUMERIC = re.compile(r"(?:[-+.,;\d\s\"']|[eEdD](?=[-+]?\d)|\b(?:nan|inf(?:inity)?)\b)+", re.I)
_DATE = re.compile(r"\D*\d{1,4}[/.-]\d{1,2}[/.-]\d{1,4}\D*(?:[\d:. ]*)\D*")
_EXPONENT = r"(?:[eEdD][+-]?\d+)?"
_NO_NUMBER = r"[+-]?(?:nan|inf(?:inity)?)"
_CELL = {
    ".": re.compile(rf"[+-]?(?:\d+\.?\d*|\.\d+){_EXPONENT}|{_NO_NUMBER}", re.IGNORECASE),
    ",": re.compile(rf"[+-]?(?:\d+,?\d*|,\d+){_EXPONENT}|{_NO_NUMBER}", re.IGNORECASE),
}
_COMMA_NUMBER = re.compile(r"[+-]?\d*,\d+(?:[eEdD][+-]?\d+)?|[+-]?\d+(?:[eEdD][+-]?\d+)?")
_LONE_COMMA = re.compile(rf"[+-]?\d+,\d+{_EXPONENT}|[+-]?\d+")
_ZEROS = re.compile(rf"[+-]?\d+,0\d+{_EXPONENT}|-0,\d+{_EXPONENT}")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(?:,\d{3})+")
_WHOLE = re.compile(r"[\s\"']*\d+(?![.,]?\d|\.|[eEdD])")
_MISSING = re.compile(r"(?:n/?a|null|none|missing|-+|\*+|#\S*)?", re.IGNORECASE)


@dataclass(frozen=True)
class Table:
    """A text file as rows of numbers.

    Attributes:
        header: number and text of the lines that are no rows, without comment signs.
        before: how many of them stand before the first row.
        rows, places: the numbers of each row, and its line number.
        separator: ``,``, ``;``, a tab, or a blank for any white space.
        whole: of the first two rows, whether their first number is written without decimals.
    """

    header: list[tuple[int, str]]
    before: int
    rows: list[list[float]]
    places: list[int]
    separator: str
    whole: tuple[bool, ...] = ()


def read_dialect(path: Path, lines: list[str]) -> Table:
    """The rows and the header of a table.

    Lines before the first row (60 at most) and comments are the header.  The decimal sign is a
    point, or a comma where that is certain; a file that can be read either way is refused.
    """
    header: list[tuple[int, str]] = []
    body: list[tuple[int, str]] = []
    before = 0
    for number, line in enumerate(lines, 1):
        stripped = line.strip()
        if not stripped:
            continue
        if stripped.startswith(COMMENT):
            header.append((number, stripped.lstrip("#%/! \t")))
        elif body or (re.search(r"\d", stripped) and _NUMERIC.fullmatch(stripped)):
            before = before if body else len(header)
            body.append((number, line.strip("\r\n")))
        elif len(header) < _HEADER_LINES and _may_be_header(stripped):
            header.append((number, stripped))
        else:
            raise _not_numbers(path, number, stripped)
    if not body:
        raise InputError(
            f"File {path} holds no numbers, but one column (acceleration) or two (time, "
            "acceleration) are wanted; check that this is the right file."
        )
    separator, decimal = _style(path, header[:before], body)
    rows = [_row(path, number, line, separator, decimal) for number, line in body]
    if header and before and separator != " ":
        number, line = header[before - 1]
        cells = split_line(line, separator)
        if len(cells) == len(rows[0]) > 1 and _is_damaged(cells, decimal):
            raise _not_numbers(path, number, line)
    whole = tuple(bool(_WHOLE.match(line)) for _, line in body[:2])
    return Table(header, before, rows, [number for number, _ in body], separator, whole)


def split_line(line: str, separator: str) -> list[str]:
    """Cells of a line, without quotes and blanks around them."""
    if separator == " ":
        return line.split()
    if '"' in line:
        cells = next(csv.reader([line.strip()], delimiter=separator, skipinitialspace=True))
    else:
        cells = line.split(separator)
    return [cell.strip().strip("\"'").strip() for cell in cells]


def _may_be_header(line: str) -> bool:
    """Whether a line may stand in a header: it has a word, is a rule of signs, or a date."""
    return bool(_LETTER.search(line) or not re.search(r"\d", line) or _DATE.fullmatch(line))


def _is_damaged(cells: list[str], decimal: str) -> bool:
    """Whether cells before the first row are a row of which something is missing."""
    numbers = [bool(_CELL[decimal].fullmatch(cell)) for cell in cells]
    return any(numbers) and all(
        good or _MISSING.fullmatch(cell) for good, cell in zip(numbers, cells, strict=True)
    )


def _not_numbers(path: Path, number: int, line: str) -> InputError:
    return InputError(
        f"File {path}, line {number}: found {line.strip()[:40]!r}, but only numbers may follow the "
        "header, one decimal sign throughout; correct the line, remove it, or mark it with #."
    )


def _style(path: Path, header: list, body: list[tuple[int, str]]) -> tuple[str, str]:
    """Separator and decimal sign, from all rows at once."""
    sample = [line for _, line in body]
    text = "\n".join(sample)
    for separator in (";", "\t"):
        if separator in text and not (separator == "\t" and _blanks_too(sample)):
            return separator, _decimal(path, sample, separator)
    if "," not in text:
        return " ", "."
    if '"' in text:
        return ",", _decimal(path, sample, ",")
    if "." in text:
        return ",", "."
    tokens = [line.split() for line in sample]
    if any(len(row) > 1 for row in tokens) and all(
        _COMMA_NUMBER.fullmatch(token) for row in tokens for token in row
    ):
        return " ", ","
    if all(_LONE_COMMA.fullmatch(line.strip()) for line in sample) and any(
        _ZEROS.fullmatch(line.strip()) for line in sample
    ):
        return " ", ","  # whole numbers are not written with zeros in front
    columns = len(split_line(sample[0].rstrip(", "), ","))
    named = header and len(split_line(header[-1][1], ",")) == columns
    if columns % 2 == 0 and not named:
        raise InputError(
            f"File {path}, line {body[0][0]}: found {sample[0].strip()[:40]!r}, which may be "
            "numbers with a decimal comma or columns of whole numbers; write decimals with a "
            "point, or separate the columns by semicolons."
        )
    return ",", "."


def _blanks_too(sample: list[str]) -> bool:
    """Whether blanks part numbers as well as tabs do."""
    return any(len(line.split()) > len(line.strip().split("\t")) for line in sample)


def _decimal(path: Path, sample: list[str], separator: str) -> str:
    """The decimal sign of cells that a comma cannot separate."""
    cells = [cell for line in sample for cell in split_line(line, separator) if "," in cell]
    if not cells:
        return "."
    if any("." in line for line in sample) or all(_THOUSANDS.fullmatch(cell) for cell in cells):
        raise InputError(
            f"File {path} holds {cells[0][:30]!r}, whose comma may be a decimal comma or part "
            "thousands; write numbers with a decimal point and without such commas."
        )
    return ","


def _row(path: Path, number: int, line: str, separator: str, decimal: str) -> list[float]:
    """The numbers of one line."""
    if separator == " " and decimal == ".":
        values = numbers_of(line)
        if not values:
            raise _not_numbers(path, number, line)
        return values
    cells = split_line(line, separator)
    while len(cells) > 1 and not cells[-1]:  # spreadsheets close rows with separators
        cells.pop()
    if not all(_CELL[decimal].fullmatch(cell) for cell in cells):
        raise _not_numbers(path, number, line)
    return [to_float(cell.replace(",", ".")) for cell in cells]
