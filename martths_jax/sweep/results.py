"""`Sweep`: the results of a sweep, its result file, tidy table and summary."""

from __future__ import annotations

import json
from collections.abc import Iterable
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
from martths_jax.campaign.statistics import percentile
from martths_jax.campaign.store import RunFolder
from martths_jax.campaign.tables import Summary, Table, extent, number
from martths_jax.campaign.tidy import write_runs
from martths_jax.indices.table import shown_of
from martths_jax.sweep.axes import Axis, Scalar
from martths_jax.sweep.config import SHOWN, SweepConfig
from martths_jax.sweep.grid import cell_numbers
from martths_jax.text import counted
from martths_jax.watch import Status


class Sweep(Results):
    """Results of a sweep, ``sweep.nc``: ``value`` (axes ..., controller, motion, trial, index)."""

    def write_csv(self, path: Path) -> None:
        """One row a cell, controller, motion and trial: axes, status, counts, indices.

        Numbers have all their digits; an index of a trial that diverged is empty.
        """
        write_runs(self.dataset, path, before=list(json.loads(self.dataset.attrs["counts"])))

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The axes of the grid."""
        found = []
        for name in self.dataset.value.dims[: self.dataset.value.ndim - 4]:
            stored = self.dataset[name]
            about = stored.attrs
            whole = stored.dtype.kind == "i"
            scalar = Scalar(
                about["setting"], lambda v: True, "", about["units"], about["long_name"], whole,
                bool(np.ravel(about["own"])[0]),
            )  # fmt: skip
            kind = int if whole else float
            found.append(Axis(name, tuple(kind(v) for v in stored.values), scalar))
        return tuple(found)

    @property
    def lost(self) -> int:
        """``failed``."""
        return self.failed

    def statistics(self, index: str, percent: float) -> xr.DataArray:
        """A percentile of an index over the uncertain trials that finished (NaN: none did).

        Returns:
            (axes ..., controller, motion).
        """
        value = self.dataset.value.sel(index=index).isel(trial=slice(1, None))
        flat = value.values.reshape(-1, value.sizes["trial"])
        found = [percentile(sample, percent).value for sample in flat]
        dims = value.dims[:-1]
        return xr.DataArray(
            np.reshape(found, value.shape[:-1]), [(d, self.dataset[d].values) for d in dims]
        )

    def lost_share(self) -> xr.DataArray:
        """Share of the uncertain trials that diverged, (axes ..., controller, motion)."""
        status = self.dataset.status.isel(trial=slice(1, None))
        return (status >= Status.DIVERGED).mean("trial")

    def summary(self, shown: Iterable[str] = SHOWN) -> Summary:
        """Median and P95 of chosen indices and lost trials, cell by cell."""
        return summarise(self, shown_of(shown, SHOWN, index_names(self.dataset)))

    def __str__(self) -> str:
        sizes = " x ".join(f"{axis.name} {len(axis.values)}" for axis in self.axes)
        return f"Sweep in {self.folder}: {sizes}, {counted(self.lost, 'run')} lost"


def open_sweep(folder: str | Path) -> Sweep:
    """A finished sweep from its folder.

    Raises:
        InputError: if there is none, or it is of another version.
    """
    return Sweep(read_results(folder, "sweep.nc", "sweep"), Path(folder))


def write_results(run: RunFolder, config: SweepConfig) -> Sweep:
    """``sweep.nc``, ``sweep.csv``, ``summary.md`` and the configuration of the study behind it."""
    done = Sweep(assemble(run, config), run.path)
    axes = " ".join(f"{a.name}={','.join(map(repr, a.values))}" for a in config.axes)
    remark = (
        "The study that a sweep repeats: `martths sweep --config FILE --axis NAME=VALUES ...`\n"
        f"with these axes: {axes}"
    )
    write_files(run, "sweep", done, done.summary(config.shown), remark)
    return done


def assemble(run: RunFolder, config: SweepConfig) -> xr.Dataset:
    """All results of a complete sweep.

    Raises:
        InputError: trials are missing, or a part is damaged.
    """
    grid, motions = config.grid, run.header["identity"]["motions"]
    names = [axis.name for axis in grid.axes]
    read = {
        (job, m): run.read(job.label, m)
        for jobs in grid.jobs.values()
        for job in dict.fromkeys(jobs)
        for m in motions
    }

    def gather(pick):
        cells = [
            [[pick(read[jobs[i], m]) for m in motions] for jobs in grid.jobs.values()]
            for i in range(len(grid.places))
        ]
        values = np.array(cells)
        return values.reshape(*grid.shape, *values.shape[1:])

    cell = (*names, "controller", "motion", "trial")
    identity = run.header["identity"]
    variables = outcome_variables(identity, cell, gather)
    variables["draw"] = (("trial", "parameter"), run.draws().plants(
        np.arange(run.trials + 1)).draws, {
            "long_name": "standard normal draws of the plant, before any spread", "units": "1"},
    )  # fmt: skip
    for name, (values, text, unit) in cell_numbers(grid, config.study).items():
        words = {"long_name": f"{text} of a cell; NaN for a controller without", "units": unit}
        variables[name] = ((*names, "controller"), values, words)
    coordinates = {
        axis.name: (axis.name, np.array(axis.values),
                    {"long_name": axis.scalar.label, "units": axis.scalar.unit,
                     "setting": axis.scalar.setting, "own": int(axis.scalar.own)})
        for axis in grid.axes
    } | {
        "controller": np.array(list(grid.jobs)),
        "motion": np.array(motions),
        "trial": np.arange(run.trials + 1, dtype=np.int32),
        "index": np.array(identity["indices"]),
        "actuator": places(run.problem.layout.actuators),
        "parameter": np.array(run.problem.parameters),
    }  # fmt: skip
    about = attributes(run) | {
        "title": f"{title_of(run.problem)}: sweep",
        "axes": json.dumps(run.header["identity"]["axes"]),
        "counts": json.dumps(list(identity["counts"])),
    }
    return xr.Dataset(variables, coordinates, about)


def summarise(sweep: Sweep, shown: tuple[str, ...]) -> Summary:
    """Tables of a sweep: one a controller and motion."""
    data, axes = sweep.dataset, sweep.axes
    median = [sweep.statistics(n, 50).values for n in shown]
    high = [sweep.statistics(n, 95).values for n in shown]
    lost = sweep.lost_share().values
    tables = []
    for m, motion in enumerate(data.motion.values):
        for c, controller in enumerate(data.controller.values):
            rows = []
            for place in np.ndindex(*lost.shape[:-2]):
                at = (*place, c, m)
                where = [a.text(a.values[i]) for a, i in zip(axes, place, strict=True)]
                pairs = [
                    f"{number(float(x[at]))} / {number(float(y[at]))}"
                    for x, y in zip(median, high, strict=True)
                ]
                rows.append((*where, f"{100 * float(lost[at]):.1f}", *pairs))
            heads = (*(a.name for a in axes), "lost [%]", *shown)
            note = "Median / 95th percentile over the uncertain trials that finished."
            tables.append(Table(f"{controller} on {motion}", heads, rows, (note,), keys=len(axes)))
    sizes = " x ".join(f"{len(a.values)} {a.name}" for a in axes)
    return Summary(f"Sweep of {sizes}: {extent(data)}", tables)
