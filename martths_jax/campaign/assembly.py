"""What comes of any campaign: its results in memory, and the files that all of them write."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from martths_jax.campaign.dataset import save_dataset
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

    @property
    def failed(self) -> int:
        """Number of runs that diverged."""
        return int(np.sum(self.dataset.status.values >= Status.DIVERGED))


def write_results(
    run: RunFolder,
    name: str,
    dataset: xr.Dataset,
    write_csv: Callable[[xr.Dataset, Path], None],
    summary: Summary,
    remark: str = "",
) -> None:
    """``NAME.nc``, ``NAME.csv``, ``summary.md`` and the effective configuration of a run.

    Args:
        run: a complete one.
        name: of its kind.
        dataset: everything.
        write_csv: writes the tidy table of a dataset.
        summary: to be read.
        remark: comment at the head of the configuration.
    """
    save_dataset(dataset, run.path / f"{name}.nc")
    write_csv(dataset, run.path / f"{name}.csv")
    write_text(run.path / "summary.md", summary.markdown())
    write_config(run.header["config"], run.path / "config.toml", remark)
