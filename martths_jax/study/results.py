"""`Study`: the results of a study in memory, and where they are."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import xarray as xr

from martths_jax.campaign.assembly import Results
from martths_jax.campaign.dataset import read_dataset, read_results
from martths_jax.campaign.tidy import write_runs
from martths_jax.errors import InputError
from martths_jax.study.signals import group
from martths_jax.study.summary import Summary, summarise
from martths_jax.text import counted
from martths_jax.watch import Status


class Study(Results):
    """Results of a study, ``study.nc``: ``value`` (controller, motion, trial, index) and so on."""

    def summary(self) -> Summary:
        """Percentiles, paired comparison and Table 4 as tables; ``str`` of it is Markdown."""
        return summarise(self.dataset)

    @property
    def failures(self) -> list[tuple[str, str, int]]:
        """(controller, motion, trial) of every run that diverged."""
        status = self.dataset.status
        return [
            (str(status.controller.values[i]), str(status.motion.values[j]), int(k))
            for i, j, k in np.argwhere(status.values >= Status.DIVERGED)
        ]

    def write_csv(self, path: Path) -> None:
        """One row a controller, motion and trial: status, indices, peak volts.

        Numbers have all their digits; an index of a trial that diverged is empty.
        """
        write_runs(self.dataset, path, after=["volt_peak"])

    def stored_signals(self) -> Iterator[xr.Dataset]:
        """Signals of each motion and controller with what all share on it."""
        if not (self.folder / "signals.nc").is_file():
            return
        for motion in self.dataset.motion.values:
            shared = self.signals(str(motion))
            for controller in self.dataset.controller.values:
                own = self.signals(str(motion), str(controller))
                yield own.merge(shared).assign_attrs(motion=str(motion), controller=str(controller))

    def signals(self, motion: str, controller: str | None = None) -> xr.Dataset:
        """Stored signals of a controller on a motion; without one, what all share there.

        Raises:
            InputError: if the study stored none, or knows no such name.
        """
        path = self.folder / "signals.nc"
        if not path.is_file():
            raise InputError(f"{self.folder} holds no signals; run the study with signals=True.")
        for name, known in ((motion, self.dataset.motion), (controller, self.dataset.controller)):
            if name is not None and name not in known.values:
                raise InputError(f"{name!r} is not in the study; it has {', '.join(known.values)}.")
        return read_dataset(path, group(motion, controller))

    def __str__(self) -> str:
        sizes = self.dataset.sizes
        return (
            f"Study in {self.folder}: {counted(sizes['controller'], 'controller')}, "
            f"{counted(sizes['motion'], 'motion')}, {counted(sizes['trial'] - 1, 'trial')}, "
            f"{counted(self.failed, 'run')} failed"
        )


def open_study(folder: str | Path) -> Study:
    """A finished study from its folder.

    Raises:
        InputError: if there is none, or it is of another version.
    """
    return Study(read_results(folder, "study.nc", "study"), Path(folder))
