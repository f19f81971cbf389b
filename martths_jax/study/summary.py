"""The summary of a study as tables, on screen (rich) and as Markdown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from rich.box import SIMPLE
from rich.markup import escape
from rich.table import Table as RichTable

from martths_jax import published
from martths_jax.indices import NAMES
from martths_jax.study.statistics import LEVEL, PERCENTS, Estimate, compare, percentile
from martths_jax.watch import Status

#: The paper's comparison: this controller against that one.
PAIR = ("adfc", "lqg")


@dataclass(frozen=True)
class Table:
    """A table of text.

    Attributes:
        title: what it shows; notes: sentences below it.
        columns: heads; rows: cells.
        aside: columns that a narrow terminal has no room for.
    """

    title: str
    columns: tuple[str, ...]
    rows: list[tuple[str, ...]]
    notes: tuple[str, ...] = ()
    aside: tuple[str, ...] = ()

    def markdown(self) -> str:
        """The table in Markdown."""
        line = lambda cells: "| " + " | ".join(cells) + " |"  # noqa: E731
        rule = line(["---", *["---:"] * (len(self.columns) - 1)])
        body = "\n".join([line(self.columns), rule, *map(line, self.rows)])
        return "\n\n".join([f"## {self.title}", body, *self.notes]) + "\n"

    def __rich__(self) -> RichTable:
        table = RichTable(
            title=escape(self.title),
            caption=escape(" ".join(self.notes)) or None,
            box=SIMPLE,
            padding=(0, 1, 0, 0),
            show_edge=False,
        )
        shown = [i for i, column in enumerate(self.columns) if column not in self.aside]
        for i in shown:
            table.add_column(
                escape(self.columns[i]), justify="right" if i else "left", overflow="fold"
            )
        for row in self.rows:
            table.add_row(*(escape(row[i]) for i in shown))
        return table


@dataclass(frozen=True)
class Summary:
    """Tables of a study, in the order of reading."""

    heading: str
    tables: list[Table]

    def markdown(self) -> str:
        """The whole summary in Markdown."""
        return "\n".join([f"# {self.heading}\n", *(t.markdown() for t in self.tables)])

    __str__ = markdown


def summarise(dataset: xr.Dataset) -> Summary:
    """Summary of a study's results (see ``dataset.assemble``)."""
    cells = [(c, m) for m in dataset.motion.values for c in dataset.controller.values]
    tables = [_ends(dataset, cells)]
    tables += [_percentiles(dataset, *cell) for cell in cells]
    if set(PAIR) <= set(dataset.controller.values):
        tables += [_paired(dataset, motion) for motion in dataset.motion.values]
    tables.append(_nominal(dataset))
    return Summary(f"Study of {extent(dataset)}", tables)


def extent(dataset: xr.Dataset) -> str:
    """How much was run, in words."""

    def counted(dimension: str, noun: str) -> str:
        number = dataset.sizes[dimension]
        return f"{number} {noun}{'' if number == 1 else 's'}"

    plants = dataset.sizes["trial"] - 1  # trial 0 is the nominal plant
    return (
        f"{plants} uncertain plant{'' if plants == 1 else 's'}, {counted('motion', 'motion')}, "
        f"{counted('controller', 'controller')}, seed {dataset.attrs['seed']}"
    )


def number(value: float) -> str:
    """Four significant digits, three below one."""
    digits = 4 if abs(value) >= 1 else 3
    return "–" if np.isnan(value) else f"{value:#.{digits}g}".rstrip(".")


def with_interval(estimate: Estimate) -> str:
    """Value and confidence interval."""
    return f"{number(estimate.value)} [{number(estimate.low)}, {number(estimate.high)}]"


def _ends(dataset, cells) -> Table:
    rows = []
    for controller, motion in cells:
        status = dataset.status.sel(controller=controller, motion=motion).values[1:]
        volts = dataset.volt_peak.sel(controller=controller, motion=motion).values[1:]
        peak = np.nanmax(np.where(np.isfinite(volts), volts, np.nan), initial=0.0)
        counts = [str(int(np.sum(status == s))) for s in Status]
        rows.append((controller, motion, str(status.size), *counts, number(peak)))
    heads = ("controller", "motion", "trials", *(s.name.lower() for s in Status), "peak [V]")
    return Table("How the uncertain trials ended", heads, rows)


def _percentiles(dataset, controller: str, motion: str) -> Table:
    value = dataset.value.sel(controller=controller, motion=motion).values
    rows = []
    for i, name in enumerate(NAMES):
        found = [percentile(value[1:, i], p) for p in PERCENTS]
        unit = "ms" if name.startswith(("J1_", "J4_")) else "%"
        rows.append((
            f"{name} [{unit}]", *map(with_interval, found), str(found[0].trials),
            number(value[0, i]),
        ))  # fmt: skip
    heads = ("index", *(f"P{p}" for p in PERCENTS), "trials", "nominal")
    note = f"In brackets: {LEVEL:.0%} bootstrap confidence intervals."
    whole = int(np.sum(np.all(np.isfinite(value[1:]), axis=1)))
    title = f"{controller} on {motion}: {whole} of {len(value) - 1} trials"
    return Table(title, heads, rows, (note,), aside=("trials", "nominal"))


def _paired(dataset, motion: str) -> Table:
    first, second = (dataset.value.sel(controller=c, motion=motion).values[1:] for c in PAIR)
    rows = []
    for i, name in enumerate(NAMES):
        pair = compare(first[:, i], second[:, i])
        rows.append((
            name, with_interval(pair.difference),
            f"{pair.wins.value:.1%} [{pair.wins.low:.1%}, {pair.wins.high:.1%}]",
            str(pair.ties), str(pair.wins.trials),
        ))  # fmt: skip
    heads = ("index", "median difference", "win rate", "ties", "pairs")
    note = (
        f"Difference |{PAIR[0]}| - |{PAIR[1]}| of the same trial, negative = {PAIR[0]} is better; "
        f"win = {PAIR[0]} strictly better; only trials that neither controller lost."
    )
    return Table(f"{PAIR[0]} versus {PAIR[1]} on {motion}", heads, rows, (note,))


def _nominal(dataset) -> Table:
    mean = dataset.value.sel(trial=0).mean("motion", skipna=False)
    columns = {"lqg": published.LQG, "adfc": published.ADFC}
    heads, pick = ["index"], []
    for controller in dataset.controller.values:
        if controller in columns:
            heads.append(f"{controller}, Table 4")
            pick.append(lambda name, c=columns[controller]: published.TABLE4[name][c])
        heads.append(f"{controller}, here")
        pick.append(lambda name, c=controller: float(mean.sel(controller=c, index=name)))
    rows = [(name, *(number(float(get(name))) for get in pick)) for name in NAMES]
    motions = ", ".join(dataset.motion.values)
    note = (
        f"Nominal plant (trial 0, one noise draw), mean over {motions}; Table 4 is over the "
        "El Centro, Kobe and Morgan Hill records at a scale of 0.40."
    )
    return Table("Nominal plant beside Table 4 of the paper", tuple(heads), rows, (note,))
