"""Specimens: what answers the interface motion with a force, one file each."""

from martths_jax.rig.specimen.base import History, Specimen
from martths_jax.rig.specimen.linear import LinearSpecimen

__all__ = ["History", "LinearSpecimen", "Specimen"]
