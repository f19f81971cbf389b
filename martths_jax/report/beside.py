"""What a report shows beside its study: sweeps, sensitivity studies and tunings."""

from __future__ import annotations

import base64
import csv
import json
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path

from martths_jax.errors import InputError
from martths_jax.sensitivity import open_sensitivity
from martths_jax.study.summary import Summary, Table, number
from martths_jax.sweep import open_sweep

#: The pictures of one folder are shown up to this size in all [bytes].
PICTURES = 4_000_000


def open_beside(folder: Path | str) -> tuple[Summary, list[Path]]:
    """Tables and pictures of a sweep, a sensitivity study or a tuning.

    Raises:
        InputError: if the folder holds none of them, finished.
    """
    folder = Path(folder)
    for mark, (read, pictures) in KINDS.items():
        if (folder / mark).is_file():
            return read(folder), sorted(folder.glob(pictures))
    marks = ", ".join(KINDS)
    raise InputError(
        f"{folder} holds no finished sweep, sensitivity study or tuning (none of {marks}); run "
        "martths sweep, sensitivity or tune with --out (`out`) there first."
    )


def beside_html(folders: Sequence[Path | str], table: Callable[[Table, bool], str]) -> str:
    """The sections of some folders.

    Args:
        folders: each with a sweep, a sensitivity study or a tuning.
        table: HTML of a table, folded or not.
    """
    return "\n".join(_section(Path(f), *open_beside(f), table) for f in folders)


def _section(folder: Path, found: Summary, pictures: list[Path], table) -> str:
    shown, left_out, room = [], [], PICTURES
    for path in pictures:
        data = path.read_bytes()
        if len(data) > room:
            left_out.append(path.name)
            continue
        room -= len(data)
        name = escape(path.stem.replace("_", " "))
        code = base64.b64encode(data).decode()
        shown.append(
            f'<figure><img alt="{name}" src="data:image/png;base64,{code}">'
            f"<figcaption>{name}</figcaption></figure>"
        )
    note = ""
    if left_out:
        names = escape(", ".join(left_out))
        note = f"<p class=note>Too large to be shown here, see {escape(str(folder))}: {names}</p>"
    tables = "\n".join(table(t, i > 0) for i, t in enumerate(found.tables))
    return (
        f'<section class="beside"><h2>{escape(found.heading)}</h2>{tables}'
        f"{''.join(shown)}{note}</section>"
    )


def _tuning(folder: Path) -> Summary:
    """Design and comparison that a tuning has written."""
    try:
        design = json.loads((folder / "design.json").read_text("utf-8"))
        with (folder / "comparison.csv").open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except (OSError, ValueError) as error:
        raise InputError(f"{folder} holds no finished tuning ({error}).") from None
    controller = design.pop("controller", "controller")
    cells = lambda row: (v if i == 0 else _rounded(v) for i, v in enumerate(row.values()))  # noqa: E731
    heads = tuple(rows[0]) if rows else ()
    return Summary(
        f"Tuning of {controller}",
        [
            Table(
                "On fresh plants and a motion that was not tuned on",
                heads,
                [tuple(cells(row)) for row in rows],
            ),
            Table("The design", ("name", "value"), [(k, _rounded(v)) for k, v in design.items()]),
        ],
    )


def _rounded(value) -> str:
    try:
        return number(float(value))
    except (TypeError, ValueError):
        return str(value)


#: What tells the kind of a folder, how it is read, and its pictures.
KINDS = {
    "sweep.nc": (lambda folder: open_sweep(folder).summary(), "figures/*.png"),
    "sensitivity.nc": (lambda folder: open_sensitivity(folder).summary(), "figures/*.png"),
    "comparison.csv": (_tuning, "*.png"),
}
