"""The tidy table of a campaign as CSV."""

from __future__ import annotations

from pathlib import Path

from martths_jax.campaign.assembly import Results
from martths_jax.campaign.formats.base import Format


def _write(done: Results, path: Path, signals: bool) -> None:
    done.write_csv(path)


CSV = Format("csv", "Tidy CSV file to write", _write)
