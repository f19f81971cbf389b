"""`Scores`: what a track of the leaderboard hands from its runs to the judges."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from martths_jax.errors import InputError


@dataclass(frozen=True)
class Scores:
    """Indices of every entry on one track's plants, noise and motions.

    Everything is paired: trial ``k`` of a motion has the same plant and the same noise under
    every entry.

    Attributes:
        track: name of the track.
        entries: names of the entries, in the order of the board.
        motions: names of the motions, the strata of every comparison.
        indices: names of the indices; of all of them the smaller magnitude is the better one.
        units: unit of each index.
        values: (entry, motion, trial, index); NaN in lost trials.
        lost: (entry, motion, trial), True where the trial was lost.
        volts: (entry, motion, trial), largest valve command of all actuators [V].
        nominal: (entry, motion, index), on the nominal plant; NaN where the entry lost it.
        sources: entry to the folder and checksum of the study that holds its runs.
    """

    track: str
    entries: tuple[str, ...]
    motions: tuple[str, ...]
    indices: tuple[str, ...]
    units: tuple[str, ...]
    values: np.ndarray
    lost: np.ndarray
    volts: np.ndarray
    nominal: np.ndarray
    sources: Mapping[str, tuple[str, str]] = field(default_factory=dict)

    def __post_init__(self):
        entries, motions, indices = len(self.entries), len(self.motions), len(self.indices)
        trials = self.lost.shape[-1]
        for name, wanted in {
            "values": (entries, motions, trials, indices),
            "lost": (entries, motions, trials),
            "volts": (entries, motions, trials),
            "nominal": (entries, motions, indices),
        }.items():
            got = getattr(self, name).shape
            if got != wanted:
                raise InputError(f"Scores of {self.track}: {name} is {got}; wanted {wanted}.")

    @property
    def trials(self) -> int:
        return self.lost.shape[-1]

    def of(self, entry: str, index: str) -> np.ndarray:
        """Magnitudes of an index under an entry, (motion, trial); NaN in lost trials."""
        return np.abs(self.values[self.entries.index(entry), :, :, self.indices.index(index)])
