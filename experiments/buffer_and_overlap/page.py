"""Tables of a finished sweep over Nb and No: what to choose, what 1024 costs, what is lost.

    python experiments/buffer_and_overlap/page.py SWEEP [--out FOLDER]

Writes ``cells.csv`` (every cell), ``choice.csv`` (cells ranked), ``paper_cell.csv`` (the paper's
cell against the best one, trial by trial), ``lost.csv`` (what is lost, when, and which plants) and
``tables.md`` with the same in Markdown.
"""

from __future__ import annotations

import argparse
import itertools
from pathlib import Path

import numpy as np
import xarray as xr

from martths_jax.campaign.statistics import compare, percentile
from martths_jax.files import atomic
from martths_jax.plant import PARAMETERS
from martths_jax.study.summary import Table, number, with_interval
from martths_jax.sweep import open_sweep
from martths_jax.sweep.axes import OVERLAPS
from martths_jax.watch import Status

SHOWN = ("J2_1", "J2_2", "J5_4", "J6_4", "J8_2")
#: The paper's design: buffer length, and a fit every sample.
PAPER_NB = 1024


def variants(sweep) -> list[dict]:
    """Controller and values of all axes but Nb and the overlap: one choice is made for each."""
    others = [a for a in sweep.axes if a.name != "nb" and a.name not in OVERLAPS]
    return [
        {"controller": str(c), **{a.name: v for a, v in zip(others, place, strict=True)}}
        for c in sweep.dataset.controller.values
        for place in itertools.product(*(a.values for a in others))
    ]


def cells_of(sweep, variant: dict) -> list[dict]:
    """One entry a cell (nb, overlap) of a variant, with its data over motions and trials."""
    way = next(a for a in sweep.axes if a.name in OVERLAPS)
    nbs = next(a for a in sweep.axes if a.name == "nb").values
    found = []
    for nb, value in itertools.product(nbs, way.values):
        data = sweep.dataset.sel(variant | {"nb": nb, way.name: value})
        found.append({
            "nb": nb, way.name: value, "no": int(data.cell_no), "hop": int(data.cell_hop),
            "fb": float(data.cell_fb), "data": data,
        })  # fmt: skip
    return found


def first_loss(data: xr.Dataset) -> np.ndarray:
    """(motion, trial) first sample at which a lost trial left its range; NaN for the others."""
    events = [data[f"first_{n}"].values for n in ("command", "stroke", "nonfinite")]
    first = np.fmin.reduce([np.fmin.reduce(e, axis=-1) for e in events])
    return np.where(data.status.values >= Status.DIVERGED, first, np.nan)[:, 1:]


def cell_rows(sweep, variant: dict) -> list[dict]:
    """``cells.csv``: statistics of every cell and motion."""
    rows, fs = [], float(sweep.dataset.attrs["fs"])
    for cell in cells_of(sweep, variant):
        data = cell.pop("data")
        losses = first_loss(data) / fs
        for m, motion in enumerate(data.motion.values):
            one = data.isel(motion=m, trial=slice(1, None))
            lost = one.status.values >= Status.DIVERGED
            row = variant | cell | {
                "motion": str(motion), "trials": lost.size, "lost": int(lost.sum()),
                "saturated": int(np.sum(one.status.values == Status.SATURATED)),
                # The counter of a lost trial runs on over its NaN.
                "fits_not_used_mean": float(one.held.values[~lost].mean()) if (~lost).any()
                else np.nan,
                "first_loss_s": float(np.nanmin(losses[m])) if lost.any() else np.nan,
                "median_loss_s": float(np.nanmedian(losses[m])) if lost.any() else np.nan,
            }  # fmt: skip
            for name in SHOWN:
                sample = one.value.sel(index=name).values
                row[f"{name}_median"] = percentile(sample, 50).value
                row[f"{name}_P95"] = percentile(sample, 95).value
            rows.append(row)
    return rows


def choice_rows(sweep, variant: dict) -> list[dict]:
    """``choice.csv``: cells from best to worst.

    First the share of lost trials over all motions; then the geometric mean, over motions and
    ``SHOWN``, of the 95th percentile against that of the paper's cell: below one is better.
    """
    cells = cells_of(sweep, variant)

    def of(data, percent: float) -> np.ndarray:
        """(motion x index,) a percentile over the trials that finished."""
        sample = data.value.sel(index=list(SHOWN)).transpose("motion", "index", "trial")
        flat = sample.values[..., 1:].reshape(-1, sample.sizes["trial"] - 1)
        return np.array([percentile(row, percent).value for row in flat])

    paper = next((c for c in cells if c["nb"] == PAPER_NB and c["hop"] == 1), cells[-1])["data"]
    rows = []
    for cell in cells:
        data = cell.pop("data")
        lost = float((data.status.isel(trial=slice(1, None)) >= Status.DIVERGED).mean())
        mean = lambda ratio: float(np.exp(np.mean(np.log(ratio))))  # noqa: E731
        rows.append(variant | cell | {
            "lost_share": lost,
            "P95_to_paper": mean(of(data, 95) / of(paper, 95)),
            "median_to_paper": mean(of(data, 50) / of(paper, 50)),
            "worst_to_paper": float(np.max(of(data, 95) / of(paper, 95))),
        })  # fmt: skip
    return sorted(rows, key=lambda r: (r["lost_share"], np.nan_to_num(r["P95_to_paper"], nan=9e9)))


def paper_rows(sweep, variant: dict, best: dict) -> list[dict]:
    """``paper_cell.csv``: the paper's cell minus the best one, paired by trial."""
    cells = cells_of(sweep, variant)
    paper = next((c for c in cells if c["nb"] == PAPER_NB and c["hop"] == 1), None)
    if paper is None:
        return []
    chosen = next(c for c in cells if c["nb"] == best["nb"] and c["no"] == best["no"])
    rows = []
    for motion, name in itertools.product(paper["data"].motion.values, SHOWN):
        samples = [
            c["data"].value.sel(motion=motion, index=name).values[1:] for c in (paper, chosen)
        ]
        pair = compare(*samples)
        rows.append(variant | {
            "motion": str(motion), "index": name,
            "paper_median": percentile(samples[0], 50).value,
            "best_median": percentile(samples[1], 50).value,
            "paper_P95": percentile(samples[0], 95).value,
            "best_P95": percentile(samples[1], 95).value,
            "median_difference": with_interval(pair.difference),
            "paper_better_share": pair.wins.value,
        })  # fmt: skip
    return rows


def lost_rows(sweep, variant: dict) -> list[dict]:
    """``lost.csv``: cells with lost trials: when, how many fits were bad, and which plants.

    For every parameter of the plant the mean draw of the lost trials in standard errors: beyond
    about +-3 they are not lost by chance.
    """
    rows, fs = [], float(sweep.dataset.attrs["fs"])
    draws = sweep.dataset.draw.values[1:]
    for cell in cells_of(sweep, variant):
        data = cell.pop("data")
        losses = first_loss(data)
        for m, motion in enumerate(data.motion.values):
            lost = np.isfinite(losses[m])
            if not lost.any():
                continue
            late = losses[m][lost] - cell["nb"] - 4  # samples after the first fit
            error = draws[lost].mean(axis=0) * np.sqrt(lost.sum())
            order = np.argsort(-np.abs(error))[:2]
            rows.append(variant | cell | {
                "motion": str(motion), "lost": int(lost.sum()), "trials": lost.size,
                "first_s": float(np.nanmin(losses[m]) / fs),
                "median_s": float(np.nanmedian(losses[m]) / fs),
                "before_first_fit": int(np.sum(late < 0)),
                "within_a_second_of_it": int(np.sum((late >= 0) & (late < fs))),
                "plants": " ".join(f"{PARAMETERS[j]} {error[j]:+.1f}" for j in order),
            })  # fmt: skip
    return rows


def text(value) -> str:
    """A cell of a table."""
    if isinstance(value, float):
        return f"{value:g}" if value.is_integer() or 0 < abs(value) < 1e-3 else number(value)
    return str(value)


def write(rows: list[dict], path: Path) -> None:
    """CSV of rows that share their keys."""
    with atomic(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(rows[0]) + "\n")
        for row in rows:
            values = [f"{v:.6g}" if isinstance(v, float) else str(v) for v in row.values()]
            file.write(",".join(f'"{v}"' if "," in v else v for v in values) + "\n")


def table(title: str, rows: list[dict], most: int = 40) -> str:
    """Markdown of the first rows."""
    cut = [tuple(text(v) for v in row.values()) for row in rows[:most]]
    return Table(title, tuple(rows[0]), cut).markdown()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sweep", type=Path)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "results")
    given = parser.parse_args()
    sweep = open_sweep(given.sweep)
    cells, choices, paper, lost, pages = [], [], [], [], []
    for variant in variants(sweep):
        name = ", ".join(f"{k} {text(v)}" for k, v in variant.items())
        ranked = choice_rows(sweep, variant)
        against, gone = paper_rows(sweep, variant, ranked[0]), lost_rows(sweep, variant)
        cells += cell_rows(sweep, variant)
        choices, paper, lost = choices + ranked, paper + against, lost + gone
        pages.append(table(f"Cells from best to worst: {name}", ranked))
        if against:
            best = f"Nb {ranked[0]['nb']}, No {ranked[0]['no']}"
            pages.append(table(f"The paper's cell against the best ({best}): {name}", against))
        pages.append(table(f"Lost trials: {name}", gone) if gone else
                     f"No trial is lost in any cell: {name}.\n")  # fmt: skip
    for stem, rows in (("cells", cells), ("choice", choices), ("paper_cell", paper),
                       ("lost", lost)):  # fmt: skip
        if rows:
            write(rows, given.out / f"{stem}.csv")
    with atomic(given.out / "tables.md") as part:
        part.write_text("\n".join(pages), encoding="utf-8")
    print(f"Tables are in {given.out}")


if __name__ == "__main__":
    main()
