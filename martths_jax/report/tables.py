"""The published table with our columns beside it, and percentiles over the uncertain plants."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

import numpy as np
import xarray as xr

from martths_jax.campaign.dataset import index_names, problem_of, unit_of
from martths_jax.campaign.statistics import PERCENTS, percentile
from martths_jax.errors import argument_error
from martths_jax.figures.style import Names, index_label, motion_label
from martths_jax.study.summary import Table, number
from martths_jax.text import csv_cell

FORMATS = ("md", "tex", "csv")


def study_tables(dataset: xr.Dataset) -> list[Table]:
    """The published table, then one table of percentiles a motion."""
    motions = [str(m) for m in dataset.motion.values]
    return [nominal_table(dataset), *(distribution_table(dataset, m) for m in motions)]


def nominal_means(dataset: xr.Dataset) -> dict[str, dict[str, float]]:
    """Controller -> index -> mean over the motions, nominal plant (NaN if a run diverged)."""
    mean = dataset.value.sel(trial=0).mean("motion", skipna=False)
    return {
        str(c): dict(zip(index_names(dataset), mean.sel(controller=c).values.tolist(), strict=True))
        for c in dataset.controller.values
    }


def nominal_table(dataset: xr.Dataset) -> Table:
    """The published table and our numbers (nominal plant, mean over the motions)."""
    means = nominal_means(dataset)
    called, paper = Names(dataset), problem_of(dataset).published
    heads = ["index", *paper.aside]
    for name in means:
        label, known = called.label(name), name in paper.values
        heads += [f"{label}, paper", f"{label}, here", "deviation"] if known else [f"{label}, here"]
    rows = []
    for index in index_names(dataset):
        cells = [f"{index} [{unit_of(dataset, index)}]"]
        cells += [_printed(column.get(index)) for column in paper.aside.values()]
        for name, found in means.items():
            own = _beside(paper.printed(index, name), found[index])
            cells += own if name in paper.values else [own[1]]
        rows.append(tuple(cells))
    motions = ", ".join(motion_label(str(m)) for m in dataset.motion.values)
    title, note = "Nominal plant", f"Nominal plant, one noise draw, mean over {motions}"
    if paper.aside or set(means) & set(paper.values):
        title = f"{paper.table}: nominal plant"
        note += f"; the paper's columns are over {paper.over} scaled by {paper.scale:.2f}"
    return Table(title, tuple(heads), rows, (f"{note}.",))


def _beside(paper: float | None, value: float) -> list[str]:
    """A published number, ours, and the deviation."""
    off = "–"
    if paper is not None and not np.isnan(value):
        off = f"{round(100 * (value / paper - 1)):+d} %"
    return [_printed(paper), number(value), off]


def _printed(value: float | None) -> str:
    """A published number as it is printed, or a dash."""
    return "–" if value is None else f"{value:g}"


def distribution_table(dataset: xr.Dataset, motion: str) -> Table:
    """P5, P50 and P95 of every index over the uncertain plants, controller beside controller."""
    names, called = [str(c) for c in dataset.controller.values], Names(dataset)
    heads = ["index", *(f"{called.label(c)} P{p}" for c in names for p in PERCENTS)]
    value = {c: dataset.value.sel(controller=c, motion=motion).values[1:] for c in names}
    rows = [
        (
            f"{index} [{unit_of(dataset, index)}]",
            *(number(percentile(value[c][:, i], p).value) for c in names for p in PERCENTS),
        )
        for i, index in enumerate(index_names(dataset))
    ]
    counts = ", ".join(
        f"{called.label(c)} {int(np.isfinite(v[:, 0]).sum())} of {len(v)}" for c, v in value.items()
    )
    note = f"Over the uncertain plants that finished: {counts}."
    return Table(f"{motion_label(motion)}: percentiles", tuple(heads), rows, (note,))


def tidy_rows(dataset: xr.Dataset) -> list[tuple]:
    """(table, motion, controller, index, unit, statistic, value) of every number, all digits."""
    rows, published = [], problem_of(dataset).published
    table = published.table.lower().replace(" ", "") or "nominal"
    for name, found in nominal_means(dataset).items():
        for index in index_names(dataset):
            head = (table, "mean", name, index, unit_of(dataset, index))
            rows.append((*head, "here", found[index]))
            paper = published.printed(index, name)
            if paper is not None:
                rows.append((*head, "published", paper))
    for motion in map(str, dataset.motion.values):
        for name in map(str, dataset.controller.values):
            cell = dataset.value.sel(controller=name, motion=motion).values[1:]
            for i, index in enumerate(index_names(dataset)):
                for p in PERCENTS:
                    found = percentile(cell[:, i], p)
                    head = ("percentiles", motion, name, index, unit_of(dataset, index))
                    rows.append((*head, f"P{p}", found.value))
                    rows.append((*head, f"P{p}_low", found.low))
                    rows.append((*head, f"P{p}_high", found.high))
    return rows


def render(dataset: xr.Dataset, style: str) -> str:
    """All tables as Markdown, LaTeX (booktabs) or tidy CSV.

    Raises:
        InputError: for a format that is none of ``FORMATS``.
    """
    if style == "md":
        return "\n".join(t.markdown() for t in study_tables(dataset))
    if style == "tex":
        return "\n\n".join(latex(t) for t in study_tables(dataset)) + "\n"
    if style == "csv":
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(("table", "motion", "controller", "index", "unit", "statistic", "value"))
        for *head, value in tidy_rows(dataset):
            writer.writerow((*map(csv_cell, head), "" if np.isnan(value) else repr(float(value))))
        return text.getvalue()
    raise argument_error("format", f"be one of {', '.join(FORMATS)}", repr(style))


def latex(table: Table) -> str:
    """A table as LaTeX; needs the package booktabs."""
    columns = "l" + "r" * (len(table.columns) - 1)
    body = [" & ".join(_index_cell(row)) + r" \\" for row in table.rows]
    return "\n".join(
        [
            r"\begin{table}",
            rf"\caption{{{_escaped(table.title)}. {_escaped(' '.join(table.notes))}}}",
            rf"\begin{{tabular}}{{{columns}}}",
            r"\toprule",
            " & ".join(map(_escaped, table.columns)) + r" \\",
            r"\midrule",
            *body,
            r"\bottomrule",
            r"\end{tabular}",
            r"\end{table}",
        ]
    )


def _index_cell(row: Sequence[str]) -> list[str]:
    index, _, unit = row[0].partition(" ")
    return [f"{index_label(index)} {_escaped(unit)}", *map(_escaped, row[1:])]


_LATEX = {"&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{", "}": r"\}",
          "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "\\": r"\textbackslash{}",
          "–": "--"}  # fmt: skip


def _escaped(text: str) -> str:
    text = "".join(_LATEX.get(c, c) for c in text)
    return text if not text.startswith("-") or text == "--" else f"${text}$"
