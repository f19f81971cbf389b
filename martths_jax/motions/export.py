"""Motions written as files that `load_motion` reads back."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np

from ..errors import InputError
from .builtin import BUILTIN_NAMES, Facts, builtin_facts, ensemble, measure
from .builtin.facts import stored_facts
from .load import load_record
from .record import Record

SUMMARY = "ensemble.json"


def write_csv(record: Record, path: Path) -> None:
    """Time [s] and acceleration [m/s^2] in two columns with a header."""
    time = np.arange(record.acceleration.size) * record.dt
    np.savetxt(
        path,
        np.column_stack([time, record.acceleration]),
        fmt=("%.9g", "%.6f"),
        delimiter=",",
        header="time [s],acceleration [m/s^2]",
        comments="",
    )


def target_facts(
    like: str,
    records: str | os.PathLike | None = None,
    units: str | None = None,
    dt: float | None = None,
    variable: str | int | None = None,
) -> Facts:
    """Facts of a stored record (``elcentro`` or ``elcentro-like``), else of a motion's file."""
    if like in BUILTIN_NAMES or like in stored_facts():
        return builtin_facts(like)
    return measure(load_record(like, records=records, units=units, dt=dt, variable=variable))


def write_ensemble(
    like: str,
    count: int,
    folder: str | os.PathLike,
    *,
    seed: int = 0,
    records: str | os.PathLike | None = None,
    units: str | None = None,
    dt: float | None = None,
    variable: str | int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[dict]:
    """Make `count` motions compatible with one target and write them, and how well they fit.

    Args:
        like: target: name of a stored record, or a motion that `load_motion` finds.
        count: number of motions.
        folder: where ``NAME-001.csv``, ... and ``ensemble.json`` go; made if missing.
        seed: seed of the ensemble; member i depends on (seed, i) alone.
        records, units, dt, variable: as for `load_motion`.
        progress: called as progress(done, count).

    Returns:
        One entry a motion: file, accepted or not, and the misfits of `Fit`.

    Raises:
        InputError: unknown target, bad counts, a folder that cannot be written or that already
            holds an ensemble.
    """
    folder = Path(folder)
    facts = target_facts(like, records, units, dt, variable)
    name = Path(like).stem.removesuffix("-like")
    if (folder / SUMMARY).exists():
        raise InputError(f"Folder {folder} already holds an ensemble ({SUMMARY}); give another.")
    lines = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for record, fit in ensemble(facts, count, seed, f"{name}-like-s{seed}"):
            write_csv(record, folder / f"{record.name}.csv")
            lines.append({"file": f"{record.name}.csv", "accepted": fit.accepted, **asdict(fit)})
            if progress is not None:
                progress(len(lines), count)
        summary = {"like": name, "seed": seed, "count": count, "motions": lines}
        (folder / SUMMARY).write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"Folder {folder} cannot be written: {error.strerror}.") from None
    return lines
