"""`Sensitivity`: Sobol' indices of all outputs, their file, table and summary."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from martths_jax.campaign.assembly import Results
from martths_jax.campaign.assembly import write_results as write_files
from martths_jax.campaign.dataset import (
    attributes,
    index_names,
    outcome_variables,
    places,
    read_results,
    title_of,
)
from martths_jax.campaign.plan import Plan
from martths_jax.campaign.store import RunFolder
from martths_jax.campaign.tables import Summary, Table
from martths_jax.campaign.tidy import write_rows
from martths_jax.sensitivity.design import Design
from martths_jax.sensitivity.estimators import LEVEL, RESAMPLES, SobolIndices, sobol, verdicts
from martths_jax.sensitivity.store import ROWS
from martths_jax.text import counted

ESTIMATES = ("first", "first_low", "first_high", "total", "total_low", "total_high")
_WORDS = {
    "first": "first-order Sobol' index",
    "total": "total Sobol' index",
    "low": "lower end of its confidence interval",
    "high": "upper end of its confidence interval",
}


class Sensitivity(Results):
    """Results of a global sensitivity analysis, ``sensitivity.nc``.

    ``first``, ``total`` and the ends of their intervals (controller, index, factor), ``note``
    (controller, index), and the runs themselves: ``value`` (controller, sample, row, index) and so
    on.
    """

    def write_csv(self, path: Path) -> None:
        """One row a controller, index and factor; empty where the index does not vary."""
        names = [self.dataset[d].values.tolist() for d in ("controller", "index", "factor")]
        numbers = np.stack([self.dataset[name].values for name in ESTIMATES], axis=-1).tolist()
        notes = self.dataset.note.values.tolist()
        rows = (
            [controller, name, factor, *numbers[c][i][j], notes[c][i]]
            for c, controller in enumerate(names[0])
            for i, name in enumerate(names[1])
            for j, factor in enumerate(names[2])
        )
        write_rows(path, ["controller", "index", "factor", *ESTIMATES, "note"], rows)

    @property
    def notes(self) -> dict[tuple[str, str], str]:
        """Sentence about each (controller, index) whose Sobol' indices mean little."""
        note = self.dataset.note
        return {
            (str(c), str(n)): str(note.sel(controller=c, index=n).values)
            for c in note.controller.values
            for n in note["index"].values
            if str(note.sel(controller=c, index=n).values)
        }

    @property
    def warnings(self) -> list[str]:
        """What a user should read before the numbers."""
        found = []
        N = self.dataset.sizes["sample"]
        for controller in self.dataset.controller.values:
            used = int(self.dataset.used.sel(controller=controller))
            if used < N:
                found.append(
                    f"{controller}: {N - used} of {N} base samples left out, since a run of theirs "
                    "was lost; the indices are those of the plants that finish."
                )
        grouped: dict[tuple[str, str], list[str]] = {}
        for (controller, name), text in self.notes.items():
            kind = text.split(":")[0].split(";")[0]
            grouped.setdefault((controller, kind), []).append(name)
        for (controller, kind), names in grouped.items():
            found.append(f"{controller}: {', '.join(names)}: {kind}.")
        return found

    def summary(self) -> Summary:
        """Total and first-order indices as tables."""
        return summarise(self)

    def __str__(self) -> str:
        sizes = self.dataset.sizes
        return (
            f"Sensitivity in {self.folder}: N = {sizes['sample']}, "
            f"{counted(sizes['factor'], 'factor')}, {counted(sizes['controller'], 'controller')}"
        )


def open_sensitivity(folder: str | Path) -> Sensitivity:
    """A finished analysis from its folder.

    Raises:
        InputError: if there is none, or it is of another version.
    """
    return Sensitivity(read_results(folder, "sensitivity.nc", "analysis"), Path(folder))


def write_results(run: RunFolder, design: Design, plan: Plan) -> Sensitivity:
    """``sensitivity.nc``, ``sensitivity.csv``, ``summary.md`` and the configuration."""
    done = Sensitivity(assemble(run, design, plan), run.path)
    remark = "An analysis: `martths sensitivity --config FILE`; `trials` are its base samples."
    write_files(run, "sensitivity", done, done.summary(), remark)
    return done


def assemble(run: RunFolder, design: Design, plan: Plan) -> xr.Dataset:
    """Runs and Sobol' indices of a complete analysis."""
    names = list(plan.controllers)
    shape = design.unit.shape[:2]
    outcomes = [run.read(c, ROWS) for c in names]
    identity = run.header["identity"]

    def gather(pick):
        return np.stack([x.reshape(*shape, *x.shape[1:]) for x in map(pick, outcomes)])

    found = [sobol(v, seed=plan.config.seed) for v in gather(lambda o: o.value)]
    notes = [list(verdicts(identity["indices"], f, design.samples).values()) for f in found]
    cell = ("controller", "index", "factor")
    variables = {
        name: (cell, np.stack([getattr(f, name) for f in found]), {
            "long_name": f"{_WORDS[name.split('_')[0]]}"
            + (f": {_WORDS[name.split('_')[1]]}" if "_" in name else ""), "units": "1"})
        for name in ESTIMATES
    } | {
        "mean": (cell[:2], np.stack([f.mean for f in found]), {"long_name": "mean of the index"}),
        "deviation": (cell[:2], np.stack([f.deviation for f in found]), {
            "long_name": "standard deviation of the index"}),
        "used": ("controller", np.array([f.used for f in found], dtype=np.int32), {
            "long_name": "base samples whose runs all finished"}),
        "note": (cell[:2], np.array(notes), {"long_name": "what limits these indices"}),
        "point": (("sample", "row", "factor"), design.unit, {
            "long_name": "points of the design in the unit cube", "units": "1"}),
    } | outcome_variables(identity, ("controller", "sample", "row"), gather)  # fmt: skip
    coordinates = {
        "controller": np.array(names),
        "index": np.array(identity["indices"]),
        "factor": np.array(design.factors),
        "row": np.array(["A", "B", *(f"AB {f}" for f in design.factors)]),
        "sample": np.arange(design.samples, dtype=np.int32),
        "actuator": places(run.problem.layout.actuators),
    }
    about = attributes(run) | {
        "title": f"{title_of(run.problem)}: global sensitivity",
        "confidence": f"{LEVEL:g}, percentile bootstrap, {RESAMPLES} resamples of base samples",
        "base_samples": design.samples,
    }
    about["trials"] = design.samples
    return xr.Dataset(variables, coordinates, about)


def indices_of(sensitivity: Sensitivity, controller: str) -> SobolIndices:
    """The Sobol' indices of a controller as arrays (index, factor)."""
    cell = sensitivity.dataset.sel(controller=controller)
    order = ("first", "total", "first_low", "first_high", "total_low", "total_high")
    columns = [cell[name].values for name in order]
    return SobolIndices(*columns, cell["mean"].values, cell.deviation.values, int(cell.used))


def summarise(found: Sensitivity) -> Summary:
    """Tables of total and of first-order indices, and what limits them."""
    data = found.dataset
    factors = [str(f) for f in data.factor.values]
    tables = []
    for controller in data.controller.values:
        one = indices_of(found, controller)
        for title, value, low, high in (
            ("Total", one.total, one.total_low, one.total_high),
            ("First-order", one.first, one.first_low, one.first_high),
        ):
            rows = [
                (name, *(_cell(*x) for x in zip(value[i], low[i], high[i], strict=True)))
                for i, name in enumerate(index_names(found.dataset))
            ]
            note = (
                f"In brackets: {LEVEL:.0%} bootstrap confidence intervals, {one.used} of "
                f"{data.sizes['sample']} base samples."
            )
            title = f"{title} Sobol' indices, {controller}"
            tables.append(Table(title, ("index", *factors), rows, (note,)))
        rows = [(n, text) for (c, n), text in found.notes.items() if c == controller]
        if rows:
            tables.append(
                Table(f"What limits them, {controller}", ("index", "note"), rows, text=("note",))
            )
    heading = (
        f"Global sensitivity: N = {data.sizes['sample']} base samples, "
        f"{counted(len(factors), 'factor')}, "
        f"{data.sizes['sample'] * data.sizes['row']} runs a controller, seed {data.attrs['seed']}"
    )
    return Summary(heading, tables)


def leading(found: Sensitivity, controller: str, most: int = 3) -> Table:
    """For each index the factors with the largest total indices: a table for the screen."""
    one, rows = indices_of(found, controller), []
    factors = found.dataset.factor.values
    for i, name in enumerate(index_names(found.dataset)):
        note = found.notes.get((controller, name), "")
        order = np.argsort(-one.total[i])[:most] if one.varies[i] else []
        cells = [
            f"{factors[j]} {_cell(one.total[i, j], one.total_low[i, j], one.total_high[i, j])}"
            for j in order
        ]
        rows.append((name, *cells, *[""] * (most - len(cells)), note.split(":")[0]))
    heads = ("index", *(f"{n}." for n in range(1, most + 1)), "note")
    return Table(f"Largest total Sobol' indices, {controller}", heads, rows, text=heads[1:])


def _cell(value: float, low: float, high: float) -> str:
    if np.isnan(value):
        return "–"
    # Few samples of an index that hardly varies make the ends of an interval as large as can be.
    value, low, high = (f"{x:.2f}" if abs(x) < 1000 else f"{x:.0e}" for x in (value, low, high))
    return f"{value} [{low}, {high}]"
