"""A trial of a study run again, bit for bit, with all its signals kept."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from martths_jax.campaign.progress import Reporter
from martths_jax.campaign.store import RunFolder
from martths_jax.errors import InputError
from martths_jax.study.merge import engine_again
from martths_jax.study.results import Study, open_study
from martths_jax.study.signals import store_signals


@dataclass(frozen=True)
class Replay:
    """What came of running a trial again.

    Attributes:
        study: with the trial's signals among those kept.
        differing: (controller, motion, index) whose bits are not those stored.
    """

    study: Study
    differing: list[tuple[str, str, str]]


def replay(
    folder: Path | str,
    trial: int,
    *,
    records: str | None = None,
    reporter: Reporter | None = None,
) -> Replay:
    """Run a trial again under every controller and motion and keep its signals in ``signals.nc``.

    The indices are computed anew and compared with those of the study, bit by bit.

    Args:
        folder: of a finished study.
        trial: its number, 0 = nominal plant.
        records: where the ground motions are here, if not where the study found them.
        reporter: is told what happens.

    Raises:
        InputError: no such study or trial, or the study cannot be run again here (motions that are
            not there or have changed, other versions, a read-only folder).
    """
    folder, reporter = Path(folder), reporter or Reporter()
    study = open_study(folder)
    known = study.dataset.trial.values
    if trial not in known:
        raise InputError(
            f"Argument `trial` must be from {known[0]} to {known[-1]}, the trials of {folder}, but "
            f"got {trial}."
        )
    keep = sorted({trial} | kept_trials(study))
    notices = _Listener(reporter)
    run = RunFolder.open(folder)
    engine = engine_again(run, records, keep, notices)
    if engine is None:
        raise InputError(notices.last.replace("No signals are stored, since the", "The"))
    differing = []
    names = study.dataset["index"].values
    for controller, motion in run.cells:
        found = engine.run(controller, motion, np.array([trial])).value[0]
        stored = study.dataset.value.sel(controller=controller, motion=motion, trial=trial).values
        other = found.view(np.int64) != stored.astype(float).view(np.int64)
        other &= ~(np.isnan(found) & np.isnan(stored))
        differing += [(controller, motion, str(name)) for name in names[other]]
    store_signals(engine, study.dataset, folder / "signals.nc", keep, run.digest)
    return Replay(open_study(folder), differing)


def kept_trials(study: Study) -> set[int]:
    """Trials that were asked for, beside those every study keeps."""
    if not (study.folder / "signals.nc").is_file():
        return set()
    found: set[int] = set()
    for motion in map(str, study.dataset.motion.values):
        for controller in map(str, study.dataset.controller.values):
            stored = study.signals(motion, controller)
            asked = ["kept" in str(role) for role in stored.role.values]
            found |= {int(t) for t in stored.trial.values[asked]}
    return found


class _Listener(Reporter):
    """Passes notices on and remembers the last one."""

    def __init__(self, other: Reporter):
        self.other, self.last = other, ""

    def notice(self, text: str) -> None:
        self.last = text
        self.other.notice(text)
