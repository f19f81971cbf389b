"""`Sweep`: the results of a sweep, its result file, tidy table and summary."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from martths_jax.campaign.dataset import (
    INDEX_UNITS,
    STATUS_FLAGS,
    attributes,
    count_variables,
    index_names,
    index_variables,
    read_results,
    save_dataset,
)
from martths_jax.campaign.engine import FIRSTS
from martths_jax.campaign.files import write_text, writing
from martths_jax.campaign.statistics import percentile
from martths_jax.campaign.store import RunFolder
from martths_jax.indices.table import shown_of
from martths_jax.plant import PARAMETERS
from martths_jax.study.summary import Summary, Table, extent, number
from martths_jax.sweep.axes import Axis, Scalar
from martths_jax.sweep.config import SHOWN, SweepConfig
from martths_jax.sweep.grid import cell_numbers
from martths_jax.text import counted, csv_field
from martths_jax.watch import Status


@dataclass(frozen=True)
class Sweep:
    """Results of a sweep.

    Attributes:
        dataset: as in ``sweep.nc``: ``value`` (axes ..., controller, motion, trial, index) etc.
        folder: of the sweep.
    """

    dataset: xr.Dataset
    folder: Path

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
        """Number of runs (cell, controller, motion, trial) that diverged."""
        return int(np.sum(self.dataset.status.values >= Status.DIVERGED))

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
    """``sweep.nc``, ``sweep.csv`` and ``summary.md``."""
    done = Sweep(assemble(run, config), run.path)
    save_dataset(done.dataset, run.path / "sweep.nc")
    write_csv(done, run.path / "sweep.csv")
    write_text(run.path / "summary.md", done.summary(config.shown).markdown())
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
    variables = {
        "value": ((*cell, "index"), gather(lambda o: o.value), {
            "long_name": "evaluation indices; NaN where the trial diverged"} | INDEX_UNITS),
        "status": (cell, gather(lambda o: o.status), {
            "long_name": "how the trial ended"} | STATUS_FLAGS),
        "volt_peak": ((*cell, "actuator"), gather(lambda o: o.volt_peak), {
            "long_name": "largest valve command", "units": "V"}),
    }  # fmt: skip
    identity = run.header["identity"]
    variables |= index_variables(identity) | count_variables(identity, cell, gather)
    variables["draw"] = (("trial", "parameter"), run.draws().plants(
        np.arange(run.trials + 1)).draws, {
            "long_name": "standard normal draws of the plant, before any spread", "units": "1"},
    )  # fmt: skip
    for i, name in enumerate(FIRSTS):
        variables[f"first_{name}"] = ((*cell, "actuator"), gather(lambda o, i=i: o.first[:, i]), {
            "long_name": f"first sample of `{name}` (see Watch); NaN = never",
            "units": "samples"})  # fmt: skip
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
        "index": np.array(run.header["identity"]["indices"]),
        "actuator": np.array([1, 2], dtype=np.int32),
        "parameter": np.array(PARAMETERS),
    }  # fmt: skip
    about = attributes(run) | {
        "title": "Virtual multi-axial real-time hybrid simulation: sweep",
        "axes": json.dumps(run.header["identity"]["axes"]),
        "counts": json.dumps(list(identity["counts"])),
    }
    return xr.Dataset(variables, coordinates, about)


def write_csv(sweep: Sweep, path: Path) -> None:
    """One row a cell, controller, motion and trial: axes, status, counts, indices.

    Numbers have all their digits; an index of a trial that diverged is empty.
    """
    data, axes = sweep.dataset, sweep.axes
    words = {int(s): s.name.lower() for s in Status}
    counts = list(json.loads(data.attrs["counts"]))
    heads = [*(a.name for a in axes), "controller", "motion", "trial", "status", *counts,
             *index_names(data)]  # fmt: skip
    with writing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(heads) + "\n")
        for place in np.ndindex(*data.value.shape[:-2]):
            values = [repr(a.values[i]) for a, i in zip(axes, place, strict=False)]
            names = [str(data.controller.values[place[-2]]), str(data.motion.values[place[-1]])]
            start = ",".join([*values, *map(csv_field, names)])
            numbers = [data[name].values[place].tolist() for name in counts]
            for trial, status, *counted, row in zip(
                data.trial.values, data.status.values[place], *numbers,
                data.value.values[place].tolist(), strict=True,
            ):  # fmt: skip
                cells = ["" if x != x else repr(x) for x in (*counted, *row)]
                file.write(",".join([f"{start},{trial},{words[int(status)]}", *cells]) + "\n")


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
