"""What all tests share: where the real records are, if they are, and strict numerics."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import martths_jax  # first: it switches float64 on before any test touches JAX

SIBLING = Path(__file__).resolve().parents[2] / "shared" / "benchmark"


@pytest.fixture(scope="session")
def records() -> Path:
    """Folder of the real records, reference matrices and oracle signals."""
    folder = Path(os.environ.get("MARTHS_RECORDS") or SIBLING)
    if not (folder / "ElCentroAccelNoScaling.mat").exists():
        pytest.skip(
            f"the benchmark's real records are not at {folder}; set MARTHS_RECORDS to their folder"
        )
    return folder


@pytest.fixture(scope="session")
def benchmark():
    """The benchmark with its defaults."""
    return martths_jax.build_benchmark()
