"""Where tests find the benchmark's records, which are not part of this repository."""

import os
from pathlib import Path

import pytest


def need_records() -> Path:
    """The folder of the benchmark's records; skips the test where there is none."""
    sibling = Path(__file__).resolve().parents[3] / "shared" / "benchmark"
    folder = Path(os.environ.get("MARTHS_RECORDS") or sibling)
    if not (folder / "ElCentroAccelNoScaling.mat").is_file():
        pytest.skip("needs the benchmark's records: set MARTHS_RECORDS to their folder")
    return folder
