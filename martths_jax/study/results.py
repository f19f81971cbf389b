"""`Study`: the results of a study in memory, and where they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from martths_jax.campaign.assembly import Results
from martths_jax.campaign.dataset import read_dataset, read_results
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
