"""Text files: decoding, lines, numbers."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from ...errors import InputError

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?"
NUMBER = re.compile(_NUMBER)
_NOT_FINITE = r"[+-]?(?:nan|inf(?:inity)?)\b"
_ITEM = re.compile(rf"{_NOT_FINITE}|{_NUMBER}", re.IGNORECASE)


def text_lines(path: Path, content: bytes) -> list[str]:
    """Lines of a text file in UTF-8, UTF-16 or cp1252; `InputError` when it is no text."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = content.decode("utf-16", errors="replace")
    elif b"\x00" in content:
        raise InputError(
            f"File {path} is not a text file (it holds zero bytes); check its ending, or export "
            "the record as text."
        )
    else:
        try:
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError:  # what spreadsheets on Windows write
            text = content.decode("cp1252", errors="replace")
    return re.split(r"\r\n|\r|\n", text)


def to_float(text: str) -> float:
    """A number as Fortran or C prints it."""
    return float(text.replace("D", "E").replace("d", "e"))


def numbers_of(line: str) -> list[float] | None:
    """The numbers of a line, None if it holds more.

    Numbers may touch as Fortran prints them (``0.1E-3-0.2E-3``): where the second has a sign and
    both have a decimal point.  ``1.2.3``, a date or ``0.1-104`` (a lost E) is no row of numbers.
    """
    values: list[float] = []
    end, before = 0, ""
    for match in _ITEM.finditer(line):
        start, item = match.start(), match[0]
        if start > end:
            if line[end:start].strip():
                return None
        elif values and not (item[0] in "+-" and "." in item and "." in before):
            return None
        values.append(to_float(item))
        end, before = match.end(), item
    return None if line[end:].strip() else values


def fixed_numbers(line: str, width: int) -> list[float] | None:
    """The numbers of a line in columns of `width` characters, None if it holds more."""
    fields = [line[k : k + width].strip() for k in range(0, len(line.rstrip()), width)]
    if not all(NUMBER.fullmatch(field) for field in fields):
        return None
    return [to_float(field) for field in fields]


def numbers_below(
    path: Path,
    lines: list[str],
    start: int,
    parse: Callable[[str], list[float] | None] = numbers_of,
    wanted: str = "only numbers may follow the header",
    count: int | None = None,
) -> tuple[list[float], list[int]]:
    """All numbers from a line on, and the number of the line of each.

    Args:
        path: for errors.
        lines: of the whole file.
        start: index of the first line of numbers.
        parse: gives the numbers of a line, None if it holds more.
        wanted: what an error says of such a line.
        count: numbers after which lines of another kind may follow.

    Raises:
        InputError: naming the first line that cannot be parsed.
    """
    values: list[float] = []
    places: list[int] = []
    for number, line in enumerate(lines[start:], start + 1):
        found = parse(line)
        if found is None and len(values) == count:
            continue
        if found is None:
            raise InputError(
                f"File {path}, line {number}: found {line.strip()[:40]!r}, but {wanted}; download "
                "the file again."
            )
        values += found
        places += [number] * len(found)
    return values, places


def block_of_numbers(
    lines: list[str], start: int, parse: Callable[[str], list[float] | None], count: int
) -> tuple[list[float], list[int]]:
    """Numbers from a line on, up to a line of another kind or until `count` are there.

    Returns:
        the numbers, and the number of the line of each.
    """
    values: list[float] = []
    places: list[int] = []
    for number, line in enumerate(lines[start:], start + 1):
        found = parse(line)
        if not found or len(values) >= count:
            break
        values += found
        places += [number] * len(found)
    return values, places
