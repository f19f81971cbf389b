"""The report: one HTML file that needs no network and opens from the disk."""

from __future__ import annotations

import base64
import gzip
import io
import json
from collections.abc import Callable, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path

import numpy as np

from martths_jax.campaign.dataset import problem_of
from martths_jax.campaign.session import read_provenance
from martths_jax.figures import drawings, open_source
from martths_jax.files import atomic
from martths_jax.report.beside import beside_html
from martths_jax.report.payload import (
    chosen_trials,
    history_payload,
    kept_signals,
    trial_payload,
)
from martths_jax.report.tables import study_tables
from martths_jax.study import Study
from martths_jax.study.summary import Table, summarise

#: Resolution of the figures in the page.
DPI = 130
#: Size of a page [bytes]: histories are thinned until it is kept, but for the least they get.
SIZE = 9_800_000
LEAST = 1_000_000


def write_report(
    folder: Path | str,
    out: Path | str | None = None,
    *,
    trial: int = 0,
    only: Sequence[str] = (),
    beside: Sequence[Path | str] = (),
    progress: Callable[[str], None] = lambda name: None,
) -> Path:
    """Write the report of a study.

    Args:
        folder: of a finished study.
        out: file to write; ``report.html`` in the folder if None.
        trial: whose histories the figures draw.
        only: beginnings of the names of the figures wanted; all if empty.
        beside: folders of sweeps, sensitivity studies and tunings to show as well.
        progress: told the name of every figure drawn.

    Returns:
        path of the file.

    Raises:
        InputError: no such study, trial or figure, a folder of another kind, or the file cannot be
            written.
    """
    source = open_source(folder, trial)
    others = beside_html(beside, _html_table)
    out = Path(folder) / "report.html" if out is None else Path(out)
    pictures = []
    for name, drawing in drawings(source, only):
        pictures.append(_picture(name, drawing))
        progress(name)
    text = compose(source.study, "\n".join(pictures), others)
    with atomic(out) as part:
        part.write_text(text, encoding="utf-8")
    return out


def compose(study: Study, pictures: str, others: str = "") -> str:
    """The page's text from a study, its figures as HTML, and what else is shown."""
    from plotly.offline import get_plotlyjs

    summary = summarise(study.dataset)
    kept = kept_signals(study)
    trials = chosen_trials(study, kept)
    data = trial_payload(study, trials) | {"folder": str(study.folder)}
    paired = [t for t in summary.tables if " versus " in t.title]
    tables = [*study_tables(study.dataset), *paired]
    parts = {
        "TITLE": escape(summary.heading),
        "STYLE": _own("style.css"),
        "ENDS": _html_table(summary.tables[0], fold=False),
        "SAMPLE": _sample_note(trials.size, int(study.dataset.sizes["trial"])),
        "TABLES": "\n".join(_html_table(t, fold=i > 0) for i, t in enumerate(tables)),
        "FIGURES": pictures,
        "BESIDE": others,
        "LINK": '<a href="#beside">Sweeps and tunings</a>' if others else "",
        "PROVENANCE": _provenance(study),
        "PLOTLY": _packed(get_plotlyjs()),
        "DATA": _json(data),
        "SCRIPT": _own("app.js"),
    }
    room = SIZE - sum(len(part.encode()) for part in parts.values())
    fs = float(np.ravel(study.dataset.attrs["fs"])[0])
    layout = problem_of(study.dataset).layout
    parts["HISTORIES"] = _json(history_payload(kept, fs, max(LEAST, room), layout))
    pieces = _own("page.html").split("%%")
    return "".join(parts[piece] if i % 2 else piece for i, piece in enumerate(pieces))


def _json(data) -> str:
    """JSON that may stand in a script element: whatever a name holds, no tag and no comment."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", r"\u003c")


def _packed(text: str) -> str:
    """A text compressed, in base64; the page's script unpacks it."""
    return base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode()


def _sample_note(shown: int, trials: int) -> str:
    if shown == trials:
        return ""
    return (
        f"<p class=note>{shown} of {trials} trials are in this table: the nominal plant, those "
        "whose histories are kept, lost ones up to a quarter, and others drawn by the study's "
        "seed. Tables and figures below are of all trials; study.csv lists all.</p>"
    )


def _own(name: str) -> str:
    return files("martths_jax.report").joinpath(name).read_text("utf-8")


def _picture(name: str, drawing) -> str:
    buffer = io.BytesIO()
    drawing.figure.savefig(buffer, format="png", dpi=DPI)
    data = base64.b64encode(buffer.getvalue()).decode()
    caption = escape(drawing.caption)
    return (
        f'<figure id="{escape(name)}"><img alt="{caption}" src="data:image/png;base64,{data}">'
        f"<figcaption>{caption}</figcaption></figure>"
    )


def _html_table(table: Table, fold: bool) -> str:
    head = "".join(f"<th>{escape(c)}</th>" for c in table.columns)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(c)}</td>" for c in row) + "</tr>" for row in table.rows
    )
    notes = "".join(f"<p class=note>{escape(n)}</p>" for n in table.notes)
    opened = "" if fold else " open"
    return (
        f"<details{opened}><summary>{escape(table.title)}</summary><div class=wide><table>"
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>{notes}</details>"
    )


def _provenance(study: Study) -> str:
    """Versions, commit, configuration, seed, checksums and machines as a list."""
    found = study.dataset.attrs
    texts = {k: str(np.ravel(v)[0]) for k, v in found.items()}
    rows = [
        (k, v) for k, v in texts.items() if k not in ("configuration", "identity", "Conventions")
    ]
    rows.append(("configuration", _indented(texts["configuration"])))
    for i, session in enumerate(read_provenance(study.folder)["sessions"], 1):
        rows.append((f"session {i}", ", ".join(f"{k}: {v}" for k, v in session.items())))
    items = "".join(f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>" for k, v in rows)
    return f"<dl>{items}</dl>"


def _indented(text: str) -> str:
    try:
        return json.dumps(json.loads(text), indent=1)
    except ValueError:  # a very long configuration is stored shortened
        return text
