"""The folder of a sweep: that of a study, with a folder of parts for each job and motion."""

from __future__ import annotations

from martths_jax.campaign.store import OWN, RunFolder
from martths_jax.sweep.config import SweepConfig

#: What a sweep leaves in its folder, beside the figures.
SWEEP_OWN = (*OWN, "sweep.nc", "sweep.csv")


class SweepFolder(RunFolder):
    """A sweep's folder; ``write``, ``read`` and ``done`` take ``Job.label`` for the controller."""

    own = SWEEP_OWN
    what = "sweep"


def sweep_identity(config: SweepConfig) -> dict:
    """What decides a sweep's numbers beside what decides the study's."""
    return {"axes": {axis.name: list(axis.values) for axis in config.axes}}
