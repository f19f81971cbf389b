"""Words for counts, and text as other programs read it: CSV and Markdown."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable

#: Beginnings that make a spreadsheet take a cell for a formula, of full width too.
_FORMULAS = ("=", "+", "-", "@", "\N{FULLWIDTH EQUALS SIGN}", "\N{FULLWIDTH PLUS SIGN}",
             "\N{FULLWIDTH HYPHEN-MINUS}", "\N{FULLWIDTH COMMERCIAL AT}")  # fmt: skip
#: What Markdown would not read as text: HTML, entities, links, ends of lines.
_MARKDOWN = re.compile(r"<|&(?=#?\w+;)|\](?=\()|[\r\n]+")
_AS_TEXT = {"<": "&lt;", "&": "&amp;", "]": "&#93;"}


def counted(number: int, noun: str, plural: str | None = None) -> str:
    """``1 trial``, ``2 trials``, ``0 trials``; `plural` where it is no added s."""
    return f"{number} {noun if number == 1 else plural or noun + 's'}"


def shortened(value: object, most: int = 80) -> str:
    """``repr`` of a value for a message, cut where it is long."""
    try:
        text = repr(value)
    except ValueError:  # Python writes out no integer of more than 4300 digits
        return "a number of more than 4300 digits"
    return text if len(text) <= most else f"{text[:most]} ... ({len(text)} characters)"


def nearest(name: object, known: Iterable[str]) -> str:
    """Words on a name that is unknown: the known ones like it, or all where none is."""
    known = list(known)
    near = difflib.get_close_matches(str(name), known, n=3)
    if near:
        return f"the nearest {'is' if len(near) == 1 else 'are'} {', '.join(near)}"
    if not known:
        return "there is none"
    shown = ", ".join(known[:12])
    return (
        f"known are {shown}"
        if len(known) <= 12
        else f"known are {shown} and {len(known) - 12} more"
    )


def csv_cell(value: object) -> object:
    """A cell that stays what it is in a spreadsheet; numbers are left alone.

    Text that begins like a formula gets an apostrophe before it, so that nothing is computed.
    """
    if not isinstance(value, str):
        return value
    return f"'{value}" if value.lstrip("' ").startswith(_FORMULAS) else value


def csv_field(text: str) -> str:
    """Text as a field of a CSV line: ``csv_cell``, in quotes where it needs them."""
    text = csv_cell(str(text))
    return '"' + text.replace('"', '""') + '"' if set(text) & set(',"\r\n') else text


def markdown_text(text: str, cell: bool = False) -> str:
    """Text that stands for itself in Markdown; with `cell`, in a table's cell too."""
    text = _MARKDOWN.sub(lambda m: _AS_TEXT.get(m[0], " "), text)
    return text.replace("|", "&#124;") if cell else text
