"""What comes of any campaign: its results in memory, and the files that all of them write."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from martths_jax.campaign.dataset import FOLDER, save_dataset
from martths_jax.campaign.files import write_text
from martths_jax.campaign.store import RunFolder
from martths_jax.campaign.tables import Summary
from martths_jax.campaign.template import write_config
from martths_jax.watch import Status


@dataclass(frozen=True)
class Results:
    """Results of a campaign.

    Attributes:
        dataset: as in its result file.
        folder: of the run.
    """

    dataset: xr.Dataset
    folder: Path

    def __post_init__(self):
        self.dataset.encoding[FOLDER] = str(self.folder)

    @property
    def failed(self) -> int:
        """Number of runs that diverged."""
        return int(np.sum(self.dataset.status.values >= Status.DIVERGED))

    def write_csv(self, path: Path) -> None:
        """Write the tidy table of this kind of campaign."""
        raise NotImplementedError

    def stored_signals(self) -> Iterable[xr.Dataset]:
        """Signals that were kept, one dataset a motion and controller; none, if none were."""
        return ()


def write_results(
    run: RunFolder,
    name: str,
    done: Results,
    summary: Summary,
    remark: str = "",
) -> None:
    """``NAME.nc``, ``NAME.csv``, ``summary.md`` and the effective configuration of a run.

    Args:
        run: a complete one.
        name: of its kind.
        done: everything.
        summary: to be read.
        remark: comment at the head of the configuration.
    """
    save_dataset(done.dataset, run.path / f"{name}.nc")
    done.write_csv(run.path / f"{name}.csv")
    write_text(run.path / "summary.md", summary.markdown())
    write_config(run.header["config"], run.path / "config.toml", remark)
