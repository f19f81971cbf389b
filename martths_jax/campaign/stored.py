"""Which trials of a run are done, and their results: the parts in its folder."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path

import numpy as np

from martths_jax.campaign.checksum import json_digest
from martths_jax.campaign.engine import COLUMNS, COUNT, Outcome
from martths_jax.campaign.files import set_aside, write_bytes
from martths_jax.campaign.machine import machine_digest
from martths_jax.campaign.owner import Owner
from martths_jax.campaign.parts import Damaged, Foreign, check_part, part_bytes, read_part
from martths_jax.errors import InputError, raise_all
from martths_jax.files import safe_name

_PART = re.compile(r"(\d+)-(\d+)\.npz")


class Stored:
    """The parts of a run.

    Attributes:
        path: the run's folder.
        header: what ``run.json`` holds.
        owner: this process's right to write there; None for a folder that is only read.
    """

    def __init__(self, path: Path, header: dict, owner: Owner | None = None):
        self.path, self.header, self.owner = path, header, owner

    @property
    def trials(self) -> int:
        """Number of uncertain plants; trial 0 comes on top."""
        return self.header["trials"]

    @property
    def cells(self) -> list[tuple[str, str]]:
        """(controller, motion) in the order they run: controllers within a motion."""
        identity = self.header["identity"]
        return [(c, m) for m in identity["motions"] for c in identity["controllers"]]

    @property
    def indices(self) -> list[str]:
        """Names of the indices that are stored."""
        return self.header["identity"]["indices"]

    @cached_property
    def digest(self) -> str:
        """Digest of what decides the numbers."""
        return json_digest(self.header["identity"])

    def folder(self, controller: str, motion: str) -> Path:
        """Where the parts of a controller and motion are."""
        return self.path / "parts" / safe_name(controller, space=False) / safe_name(motion)

    def parts(self, controller: str, motion: str) -> Iterator[tuple[int, int, Path]]:
        """(first trial, last trial, path) of every part, by first trial."""
        found = []
        folder = self.folder(controller, motion)
        for path in folder.iterdir() if folder.is_dir() else ():
            match = _PART.fullmatch(path.name)
            if match:
                found.append((int(match[1]), int(match[2]), path))
        return iter(sorted(found))

    def done(self, controller: str, motion: str, notice=lambda text: None) -> np.ndarray:
        """(trials + 1,) which trials are finished.

        A part that is damaged, or of something else, is set aside, so that its trials are computed
        again; `notice` is told.
        """
        done = np.zeros(self.trials + 1, dtype=bool)
        for first, last, path in self.parts(controller, motion):
            try:
                self._part(controller, motion, first, last, path)
            except (Damaged, Foreign) as error:
                aside = set_aside(path)
                notice(
                    f"{path} cannot be used ({error}); it was set aside as {aside.name} and its "
                    "trials are computed again."
                )
                continue
            done[first : last + 1] = True
        return done

    def write(self, controller: str, motion: str, trial: np.ndarray, outcome: Outcome) -> None:
        """Store finished trials, run by run of consecutive numbers.

        Raises:
            InputError: the disk refuses, or the folder is no longer this run's.
        """
        if list(outcome.names) != self.indices:
            raise ValueError(f"a run of {self.indices} is given {outcome.names}")
        for span in np.split(np.arange(trial.size), np.flatnonzero(np.diff(trial) != 1) + 1):
            first, last = int(trial[span[0]]), int(trial[span[-1]])
            about = self._about(controller, motion, first, last)
            about["machine"] = machine_digest()
            if self.owner is not None:
                self.owner.check()
            path = self.folder(controller, motion) / f"{first:06d}-{last:06d}.npz"
            write_bytes(path, part_bytes(about, outcome[span].arrays()))

    def _about(self, controller: str, motion: str, first: int, last: int) -> dict:
        return {"identity": self.digest, "controller": controller, "motion": motion,
                "first": first, "last": last, "indices": self.indices}  # fmt: skip

    def _part(self, controller, motion, first: int, last: int, path: Path) -> dict[str, np.ndarray]:
        """Columns of a part of this run.

        Raises:
            Damaged, Foreign: see ``parts``.
            InputError: if it cannot be read.
        """
        try:
            about, columns = read_part(path)
        except OSError as error:
            raise InputError(f"{path} cannot be read ({error.strerror or error}).") from None
        check_part(about, self._about(controller, motion, first, last), self.header["machines"])
        own = {name for name in columns if not name.startswith(COUNT)}
        if own != set(COLUMNS) or any(x.shape[0] != last - first + 1 for x in columns.values()):
            raise Foreign("it holds other columns")
        if columns["value"].shape[1:] != (len(self.indices),):
            raise Foreign("it holds other indices than it says")
        return columns

    def read(self, controller: str, motion: str) -> Outcome:
        """All trials 0 ... N of a controller and motion.

        Raises:
            InputError: a part is damaged (it is set aside, so that a rerun replaces it), or trials
                are missing.
        """
        columns: dict[str, np.ndarray] = {}
        seen = np.zeros(self.trials + 1, dtype=bool)
        for first, last, path in self.parts(controller, motion):
            try:
                arrays = self._part(controller, motion, first, last, path)
            except (Damaged, Foreign) as error:
                aside = set_aside(path)
                raise InputError(
                    f"{path} is damaged ({error}); it was set aside as {aside.name}.  Repeat the "
                    "command to compute its trials again."
                ) from None
            for name, values in arrays.items():
                shape = (self.trials + 1, *values.shape[1:])
                columns.setdefault(name, np.empty(shape, values.dtype))[first : last + 1] = values
            seen[first : last + 1] = True
        raise_all(missing_spans(seen, f"{controller} on {motion}"), f"{self.path} is not complete")
        return Outcome.of(columns, self.indices)

    def missing(self) -> list[str]:
        """Sentences about trials that are not there yet."""
        return [
            text
            for controller, motion in self.cells
            for text in missing_spans(self.done(controller, motion), f"{controller} on {motion}")
        ]


def missing_spans(done: np.ndarray, where: str) -> list[str]:
    """One sentence that names the trials which are not done, or none."""
    gaps = np.flatnonzero(~done)
    if not gaps.size:
        return []
    spans = np.split(gaps, np.flatnonzero(np.diff(gaps) != 1) + 1)
    text = ", ".join(f"{s[0]}-{s[-1]}" if s.size > 1 else f"{s[0]}" for s in spans[:5])
    return [f"{where}: trials {text}{' ...' if len(spans) > 5 else ''} are missing."]
