"""The summary of a study as tables, on screen (rich) and as Markdown."""

from __future__ import annotations

import numpy as np
import xarray as xr

from martths_jax import published
from martths_jax.campaign.dataset import controllers_of, index_names, problem_of, unit_of
from martths_jax.campaign.statistics import LEVEL, PERCENTS, Estimate, compare, percentile
from martths_jax.campaign.tables import Summary, Table, extent, number
from martths_jax.problem import find_problem
from martths_jax.text import counted
from martths_jax.watch import Status


def summarise(dataset: xr.Dataset) -> Summary:
    """Summary of a study's results (see ``dataset.assemble``)."""
    cells = [(c, m) for m in dataset.motion.values for c in dataset.controller.values]
    tables = [_ends(dataset, cells)]
    tables += [_percentiles(dataset, *cell) for cell in cells]
    for pair in pairs(dataset):
        tables += [_paired(dataset, motion, pair) for motion in dataset.motion.values]
    tables.append(_nominal(dataset))
    problem = problem_of(dataset)
    of = "" if problem is find_problem() else f": {problem.title}"
    return Summary(f"Study of {extent(dataset)}{of}", tables)


def pairs(dataset: xr.Dataset) -> list[tuple[str, str]]:
    """(first, second) controllers that are compared trial by trial.

    The paper's comparison, by the kinds of the controllers, and each further setting of a kind
    against the first of that kind.
    """
    names = [str(name) for name in dataset.controller.values]
    about = controllers_of(dataset)
    kind = {name: about[name]["kind"] for name in names}
    kind |= {name: name for name in published.PAIR if name in names}
    of = {k: [name for name in names if kind[name] == k] for k in dict.fromkeys(kind.values())}
    for k, group in of.items():
        group.sort(key=lambda name: name != k)  # the one called like its kind comes first
    one, other = published.PAIR
    found = [(of[one][0], of[other][0])] if {one, other} <= set(of) else []
    return found + [(other, group[0]) for group in of.values() for other in group[1:]]


def _or_dash(value: float | None) -> str:
    return "–" if value is None else number(float(value))


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
    names = ("controller", "motion")
    return Table("How the uncertain trials ended", heads, rows, keys=2, text=names)


def _percentiles(dataset, controller: str, motion: str) -> Table:
    value = dataset.value.sel(controller=controller, motion=motion).values
    rows = []
    for i, name in enumerate(index_names(dataset)):
        found = [percentile(value[1:, i], p) for p in PERCENTS]
        unit = unit_of(dataset, name)
        rows.append((
            f"{name} [{unit}]", *map(with_interval, found), str(found[0].trials),
            number(value[0, i]),
        ))  # fmt: skip
    heads = ("index", *(f"P{p}" for p in PERCENTS), "trials", "nominal")
    note = f"In brackets: {LEVEL:.0%} bootstrap confidence intervals."
    whole = int(np.sum(np.all(np.isfinite(value[1:]), axis=1)))
    title = f"{controller} on {motion}: {whole} of {counted(len(value) - 1, 'trial')}"
    return Table(title, heads, rows, (note,), aside=("trials", "nominal"))


def _paired(dataset, motion: str, pair: tuple[str, str]) -> Table:
    first, second = (dataset.value.sel(controller=c, motion=motion).values[1:] for c in pair)
    rows = []
    for i, name in enumerate(index_names(dataset)):
        found = compare(first[:, i], second[:, i])
        rows.append((
            name, with_interval(found.difference),
            f"{found.wins.value:.1%} [{found.wins.low:.1%}, {found.wins.high:.1%}]",
            str(found.ties), str(found.wins.trials),
        ))  # fmt: skip
    heads = ("index", "median difference", "win rate", "ties", "pairs")
    note = (
        f"Difference |{pair[0]}| - |{pair[1]}| of the same trial, negative = {pair[0]} is better; "
        f"win = {pair[0]} strictly better; only trials that neither controller lost."
    )
    return Table(f"{pair[0]} versus {pair[1]} on {motion}", heads, rows, (note,))


def _nominal(dataset) -> Table:
    mean = dataset.value.sel(trial=0).mean("motion", skipna=False)
    paper = problem_of(dataset).published
    names = [str(name) for name in dataset.controller.values]
    heads, pick = ["index"], []
    for controller in names:
        if controller in paper.values:
            heads.append(f"{controller}, {paper.table}")
            pick.append(lambda name, c=controller: paper.printed(name, c))
        heads.append(f"{controller}, here")
        pick.append(lambda name, c=controller: float(mean.sel(controller=c, index=name)))
    rows = [(name, *(_or_dash(get(name)) for get in pick)) for name in index_names(dataset)]
    title = "Nominal plant"
    note = f"Nominal plant (trial 0, one noise draw), mean over {', '.join(dataset.motion.values)}"
    if any(name in paper.values for name in names):
        title += f" beside {paper.table} of the paper"
        note += f"; {paper.table} is {paper.conditions}"
    return Table(title, tuple(heads), rows, (f"{note}.",))
