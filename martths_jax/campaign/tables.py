"""Tables of a summary, on screen (rich) and as Markdown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from martths_jax.screen import ScreenTable
from martths_jax.text import counted, markdown_text


@dataclass(frozen=True)
class Table:
    """A table of text.

    Attributes:
        title: what it shows; notes: sentences below it.
        columns: heads; rows: cells.
        aside: columns that a terminal has no room for.
        keys: number of columns that say what a row is.
        text: columns of text, which may be folded.
    """

    title: str
    columns: tuple[str, ...]
    rows: list[tuple[str, ...]]
    notes: tuple[str, ...] = ()
    aside: tuple[str, ...] = ()
    keys: int = 1
    text: tuple[str, ...] = ()

    def markdown(self) -> str:
        """The table in Markdown."""
        line = lambda cells: f"| {' | '.join(markdown_text(c, cell=True) for c in cells)} |"  # noqa: E731
        rule = line(["---", *["---:"] * (len(self.columns) - 1)])
        body = "\n".join([line(self.columns), rule, *map(line, self.rows)])
        title, notes = f"## {markdown_text(self.title)}", map(markdown_text, self.notes)
        return "\n\n".join([title, body, *notes]) + "\n"

    def __rich__(self) -> ScreenTable:
        shown = [i for i, column in enumerate(self.columns) if column not in self.aside]
        pick = lambda cells: tuple(cells[i] for i in shown)  # noqa: E731
        rows = [pick(row) for row in self.rows]
        return ScreenTable(
            self.title, pick(self.columns), rows, self.notes, keys=self.keys, text=self.text
        )


@dataclass(frozen=True)
class Summary:
    """Tables of a campaign, in the order of reading."""

    heading: str
    tables: list[Table]

    def markdown(self) -> str:
        """The whole summary in Markdown."""
        heading = f"# {markdown_text(self.heading)}\n"
        return "\n".join([heading, *(table.markdown() for table in self.tables)])

    __str__ = markdown


def extent(dataset: xr.Dataset) -> str:
    """How much was run, in words."""
    sizes = dataset.sizes
    return (
        f"{counted(sizes['trial'] - 1, 'uncertain plant')}, "  # trial 0 is the nominal plant
        f"{counted(sizes['motion'], 'motion')}, {counted(sizes['controller'], 'controller')}, "
        f"seed {dataset.attrs['seed']}"
    )


def number(value: float) -> str:
    """Four significant digits, three below one."""
    digits = 4 if abs(value) >= 1 else 3
    return "–" if np.isnan(value) else f"{value:#.{digits}g}".rstrip(".")
