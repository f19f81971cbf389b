"""One look for all figures: journal widths, a colour-blind safe palette, lines that print in grey.

Colours are those of Okabe and Ito (2008); whatever a colour tells, a dash pattern, a marker or a
shade of clearly other lightness tells too.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from martths_jax.campaign.dataset import controllers_of
from martths_jax.control.controllers import ENTRIES
from martths_jax.files import atomic
from martths_jax.indices.base import plain
from martths_jax.text import csv_cell

MM = 1 / 25.4  # inch per mm
_NAME = re.compile(r"([A-Z]+|[A-Za-z]+)(\d*)([a-z]*)(?:_(\w+))?")
#: Widths of one and of two journal columns [mm].
SINGLE, DOUBLE = 85.0, 174.0
BLUE, VERMILLION, GREEN, PURPLE, SKY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9"
TARGET = {"color": "0.68", "lw": 2.2, "ls": "-"}
#: Line, marker and fill of the things a figure compares, in the order in which they appear.
LOOKS = (
    {"color": VERMILLION, "ls": (0, (4, 1.4)), "marker": "s", "fill": "#F2B58C"},
    {"color": BLUE, "ls": "-", "marker": "o", "fill": "#3B7FA8"},
    {"color": GREEN, "ls": (0, (1, 1)), "marker": "^", "fill": "#8FD0BC"},
    {"color": PURPLE, "ls": (0, (5, 1, 1, 1)), "marker": "D", "fill": "#E8C4D8"},
    {"color": "black", "ls": (0, (3, 1, 1, 1, 1, 1)), "marker": "v", "fill": "0.5"},
)
#: How many looks are taken by controllers that look the same in every figure.
FIXED = sum(entry.look is not None for entry in ENTRIES)
_RC = {
    "font.family": "sans-serif",
    "font.size": 7.5,
    "axes.titlesize": 8,
    "axes.labelsize": 7.5,
    "legend.fontsize": 7,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 0.9,
    "lines.markersize": 3.2,
    "axes.grid": True,
    "grid.linewidth": 0.4,
    "grid.color": "0.88",
    "axes.axisbelow": True,
    "legend.frameon": False,
    "mathtext.fontset": "dejavusans",
    "pdf.fonttype": 42,
    "agg.path.chunksize": 20000,
}


@dataclass(frozen=True)
class Drawing:
    """A figure and the numbers in it.

    Attributes:
        figure: a matplotlib ``Figure``.
        data: columns of equal length by name, units in the names; what is drawn.
        caption: what is shown, for the report and for the page beside the figures.
    """

    figure: Any
    data: Mapping[str, Any]
    caption: str


@contextmanager
def house_style() -> Iterator[None]:
    """Settings under which figures are drawn and saved."""
    import matplotlib

    with matplotlib.rc_context(_RC):
        yield


def new_figure(width_mm: float, height_mm: float):
    """Empty figure of a size on paper, which lays its axes out without overlaps."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width_mm * MM, height_mm * MM), layout="constrained")


def look(position: int) -> dict:
    """Colour, dashes and marker of the thing at a position among those compared."""
    base = LOOKS[position % len(LOOKS)]
    if position < len(LOOKS):
        return base
    # The same colours again, each with another one's dashes and marker, and filled.
    other = LOOKS[(position + position // len(LOOKS)) % len(LOOKS)]
    return base | {"ls": other["ls"], "marker": other["marker"], "fill": base["color"]}


def line(position: int) -> dict:
    """Keyword arguments of a line (see ``look``)."""
    return {k: look(position)[k] for k in ("color", "ls")}


class Names:
    """How the controllers of a result file are called and drawn, as their entries say.

    Args:
        dataset: of a study, sweep or analysis.
    """

    def __init__(self, dataset):
        self._about = controllers_of(dataset)

    def label(self, controller: str) -> str:
        """Name for a legend or the head of a table."""
        return self._about[controller]["label"]

    def position(self, controller: str) -> int:
        """Position of its look (see ``look``): where its entry puts it, or after all of those."""
        fixed = self._about[controller]["look"]
        if fixed is not None:
            return fixed
        others = [name for name, about in self._about.items() if about["look"] is None]
        return FIXED + others.index(controller)


def index_label(name: str) -> str:
    """The name of an index as it is typeset: a capital with a number as its subscript, ``J5_28``
    or ``J5``; other words upright, ``TI_1``; what follows either in small letters above,
    ``J2true_1``."""
    match = _NAME.fullmatch(name)
    if not match or not (match[2] or match[4]):
        return name
    word, number, more, where = match.groups()
    below = ",".join(part for part in (number, (where or "").replace("_", ",")) if part)
    above = rf"^{{\mathrm{{{more}}}}}" if more else ""
    word = word if len(word) == 1 else rf"\mathrm{{{word}}}"
    return f"${word}_{{{below}}}{above}$"


def typeset(name: str) -> str:
    """A name of an actuator within a formula: digits, or upright letters and digits."""
    word = plain(name)
    return word if word.isdigit() else rf"\mathrm{{{word}}}"


def motion_label(name: str) -> str:
    """Name of a motion for a title."""
    base, dash, rest = name.partition("-")
    known = {"elcentro": "El Centro", "kobe": "Kobe", "morganhill": "Morgan Hill"}
    return known.get(base, base) + dash + rest


def save(drawing: Drawing, folder: Path, name: str, formats=("pdf", "png"), dpi: int = 300):
    """Write a drawing in each format, and what is drawn as CSV.

    Returns:
        paths of the files.

    Raises:
        InputError: if the folder or a file cannot be written.
    """
    paths = []
    for kind in formats:
        # No time of day in the files, so that the same study gives the same bytes.
        extra = {"metadata": {"CreationDate": None}} if kind == "pdf" else {}
        with atomic(Path(folder) / f"{name}.{kind}") as part:
            drawing.figure.savefig(part, dpi=dpi, **extra)
        paths.append(Path(folder) / f"{name}.{kind}")
    path = Path(folder) / f"{name}.csv"
    with atomic(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(map(csv_cell, drawing.data))
        columns = [_cells(np.asarray(column)) for column in drawing.data.values()]
        writer.writerows(zip(*columns, strict=True))
    return [*paths, path]


def _cells(column: np.ndarray) -> list:
    if column.dtype.kind != "f":
        return [csv_cell(value) for value in column.tolist()]
    return ["" if x != x else f"{x:.9g}" for x in column.tolist()]
