"""Text files: decoding, lines, numbers."""

from __future__ import annotations

import re
from pathlib import Path

from ...errors import InputError

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?"
NUMBER = re.compile(_NUMBER)
_NOT_FINITE = re.compile(r"[+-]?(?:nan|inf(?:inity)?)\b", re.IGNORECASE)


def text_lines(path: Path, content: bytes) -> list[str]:
    """Lines of a text file; `InputError` when it is no text."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = content.decode("utf-16", errors="replace")
    elif b"\x00" in content[:4096]:
        raise InputError(
            f"File {path} is not a text file (it holds zero bytes); check its ending, or export "
            "the record as text."
        )
    else:
        text = content.decode("utf-8-sig", errors="replace")
    return re.split(r"\r\n|\r|\n", text)


def to_float(text: str) -> float:
    """A number as Fortran or C prints it."""
    return float(text.replace("D", "E").replace("d", "e"))


def numbers_of(line: str) -> list[float] | None:
    """The numbers of a line (also run together: ``0.1E-3-0.2E-3``), None if it holds more."""
    spread = _NOT_FINITE.sub(lambda m: f" {m[0]} ", line)
    values: list[float] = []
    rest = spread
    while rest := rest.lstrip(" \t,;"):
        match = _NOT_FINITE.match(rest) or NUMBER.match(rest)
        if match is None:
            return None
        values.append(to_float(match[0]))
        rest = rest[match.end() :]
    return values
