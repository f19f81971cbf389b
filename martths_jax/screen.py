"""Tables on a terminal of any width: no number and no head is ever cut."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from dataclasses import dataclass

from rich.box import SIMPLE
from rich.cells import cell_len
from rich.markup import escape
from rich.table import Table

#: Room that a column takes beside its text.
GAP = 2
#: A column of text is folded down to this where the terminal is narrow.
TEXT_WIDTH = 16


@dataclass(frozen=True)
class ScreenTable:
    """A table that fits the terminal it is printed on, by ``rich``.

    Columns stand side by side as long as they fit, first with their heads in one line, then with
    the words of the heads below one another.  Columns that still find no room follow in a second
    table below, which begins with the key columns again.

    Attributes:
        title: what it shows; notes: sentences below it.
        columns: heads; rows: cells.
        keys: number of columns that say what a row is.
        text: heads of columns of text, which may be folded: names, paths, sentences.
    """

    title: str
    columns: tuple[str, ...]
    rows: list[tuple[str, ...]]
    notes: tuple[str, ...] = ()
    keys: int = 1
    text: tuple[str, ...] = ()

    def __rich_console__(self, console, options) -> Iterator[Table | str]:
        pieces = list(self.pieces(options.max_width))
        for i, (which, widths) in enumerate(pieces):
            if i:
                yield ""
            yield self._piece(which, widths, first=i == 0, last=i == len(pieces) - 1)

    def pieces(self, width: int) -> Iterator[tuple[list[int], list[int]]]:
        """(columns, their widths) of each table, so that it is at most `width` wide."""
        everything = list(range(len(self.columns)))
        full = [self._width(i, cell_len(self.columns[i])) for i in everything]
        if sum(full) + GAP * len(full) <= width:
            yield everything, full
            return
        least = [
            self._width(i, max(map(cell_len, head.split()), default=0), folded=True)
            for i, head in enumerate(self.columns)
        ]
        keys = everything[: self.keys]
        start = sum(least[i] + GAP for i in keys)
        found, used = [*keys], start
        for i in everything[self.keys :]:
            if used + least[i] + GAP > width and len(found) > len(keys):
                yield found, self._spread(found, least, width - used)
                found, used = [*keys], start
            found.append(i)
            used += least[i] + GAP
        yield found, self._spread(found, least, width - used)

    def _width(self, i: int, head: int, folded: bool = False) -> int:
        widest = max((cell_len(row[i]) for row in self.rows), default=0)
        if folded and self.columns[i] in self.text:
            widest = min(widest, TEXT_WIDTH)
        return max(head, widest)

    def _spread(self, which: list[int], least: list[int], spare: int) -> list[int]:
        """Widths of some columns, with the spare room given to those of text."""
        widths = [least[i] for i in which]
        for place, i in enumerate(which):
            if self.columns[i] in self.text and spare > 0:
                more = min(spare, self._width(i, 0) - widths[place])
                widths[place] += max(more, 0)
                spare -= max(more, 0)
        return widths

    def _piece(self, which: list[int], widths: list[int], first: bool, last: bool) -> Table:
        notes = " ".join(self.notes)
        table = Table(
            title=escape(self.title) if first else None,
            caption=escape(notes) if notes and last else None,
            box=SIMPLE,
            padding=(0, 1, 0, 0),
            show_edge=False,
        )
        for i, width in zip(which, widths, strict=True):
            head = textwrap.wrap(self.columns[i], width, break_long_words=False)
            left = i < self.keys or self.columns[i] in self.text
            table.add_column(
                escape("\n".join(head)), justify="left" if left else "right", width=width,
                overflow="fold",
            )  # fmt: skip
        for row in self.rows:
            table.add_row(*(escape(row[i]) for i in which))
        return table
