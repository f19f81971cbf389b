"""Small studies that the tests share: the same lengths everywhere, so programs compile once."""

import numpy as np

from martths_jax import Motion
from martths_jax.campaign.memory import lane_bytes
from martths_jax.simulation import LANES

SAMPLES = 600
#: Memory [GB] that holds exactly one block of such trials, so one device is used.
ONE_BLOCK = 1.2 * LANES * lane_bytes(SAMPLES, 1) / 1e9


def short_motion(name: str = "one", phase: float = 0.0, factor: float = 1.0) -> Motion:
    """A tone that dies away, long enough for delays to show."""
    time = np.arange(SAMPLES) / 1024
    tone = factor * np.sin(15 * time + phase) * np.exp(-time)
    return Motion(name, tone, 1024.0, sha256=f"{name}-sha")


def small(tmp_path, **changes) -> dict:
    """Settings of a study of a few seconds."""
    return {
        "trials": 20,
        "controllers": ("passthrough",),
        "motions": (short_motion("one"), short_motion("two", 1.0)),
        "out": str(tmp_path),
        "signals": False,
    } | changes


def result_bytes(folder) -> dict[str, bytes]:
    """The files that must not depend on how a study was run."""
    return {n: (folder / n).read_bytes() for n in ("study.nc", "study.csv", "summary.md")}
