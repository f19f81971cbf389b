"""Tidy tables in CSV: one row a run, or a row a number; all digits, empty where there is none."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from martths_jax.campaign.files import writing
from martths_jax.text import csv_field
from martths_jax.watch import Status


def write_rows(path: Path, heads: Sequence[str], rows: Iterable[Iterable]) -> None:
    """A table of texts and numbers.

    Raises:
        InputError: if the disk refuses.
    """
    with writing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(heads) + "\n")
        file.writelines(",".join(map(_field, row)) + "\n" for row in rows)


def _field(value) -> str:
    """Text, or a number with all its digits; nothing for NaN."""
    if isinstance(value, str):
        return csv_field(value)
    return "" if value != value else repr(value)


def write_runs(
    dataset: xr.Dataset, path: Path, before: Sequence[str] = (), after: Sequence[str] = ()
) -> None:
    """One row a run: where it stands, how it ended, its indices.

    Args:
        dataset: with ``status`` (..., trial) and ``value`` (..., trial, index).
        path: of the file.
        before, after: variables of a run that stand before and behind its indices; what has a
            further dimension gets a column for each of its places.

    Raises:
        InputError: if the disk refuses.
    """
    dims = [str(d) for d in dataset.status.dims]
    heads = [*dims, "status"]
    for name in (*before, "value", *after):
        more = dataset[name].dims[len(dims) :]
        own = [str(x) for x in dataset[more[0]].values] if more else []
        heads += own if name == "value" else [f"{name}_{x}" for x in own] or [name]
    write_rows(path, heads, _runs(dataset, dims, (*before, "value", *after)))


def _runs(dataset: xr.Dataset, dims: list[str], names: Sequence[str]) -> Iterator[list]:
    words = {int(s): s.name.lower() for s in Status}
    places = [dataset[d].values.tolist() for d in dims]
    trials = places.pop()
    for at in np.ndindex(*map(len, places)):
        start = [place[i] for place, i in zip(places, at, strict=True)]
        parts = [dataset[n].values[at].reshape(len(trials), -1).tolist() for n in names]
        for trial, status, *rows in zip(trials, dataset.status.values[at], *parts, strict=True):
            yield [*start, trial, words[int(status)], *(x for row in rows for x in row)]
