"""One controller against another on the same plants and noise: differences and win rates."""

from __future__ import annotations

import numpy as np

from martths_jax.campaign.statistics import LEVEL, compare
from martths_jax.figures.source import Source
from martths_jax.figures.style import (
    DOUBLE,
    Drawing,
    index_label,
    look,
    motion_label,
    new_figure,
)


def paired(source: Source, pair: tuple[str, str]) -> Drawing:
    """Median relative difference and win rate of every index, motion by motion.

    The difference is that of magnitudes of the same trial, in percent of the second controller's
    median, so that milliseconds and percents share an axis.
    """
    names = source.indices
    figure = new_figure(DOUBLE, 100)
    top, bottom = figure.subplots(2, 1, sharex=True)
    columns: dict[str, list] = {
        k: []
        for k in (
            "motion", "index", "difference", "difference_low", "difference_high",
            "median_of_second", "win_rate", "win_low", "win_high", "ties", "pairs",
        )
    }  # fmt: skip
    width = 0.66 / len(source.motions)
    for i, motion in enumerate(source.motions):
        shape = look(i)
        at = np.arange(len(names)) + (i - (len(source.motions) - 1) / 2) * width
        bars, wins = [], []
        for name in names:
            first, second = (source.values(c, motion, name) for c in pair)
            found = compare(first, second)
            size = float(np.nanmedian(np.abs(second))) if np.isfinite(second).any() else np.nan
            d, w = found.difference, found.wins
            # Where the second one's median is zero, as a delay's can be, there is no percentage.
            bars.append(100 * np.array([d.low, d.value, d.high]) / (size or np.nan))
            wins.append(100 * np.array([w.low, w.value, w.high]))
            row = (motion, name, d.value, d.low, d.high, size, w.value, w.low, w.high, found.ties,
                   w.trials)  # fmt: skip
            for column, value in zip(columns.values(), row, strict=True):
                column.append(value)
        for axis, triples in ((top, bars), (bottom, wins)):
            low, middle, high = np.array(triples).T
            axis.vlines(at, low, high, color=shape["color"], lw=1.4)
            axis.plot(at, middle, ls="", marker=shape["marker"], color=shape["color"], ms=3.2,
                      mfc="white" if i % 2 == 0 else shape["color"], mew=0.8,
                      label=motion_label(motion))  # fmt: skip
    first, second = map(source.label, pair)
    top.axhline(0, color="black", lw=0.7)
    bottom.axhline(50, color="black", lw=0.7)
    top.set_ylabel(f"median |{first}| − |{second}|\n[% of {second}'s median]")
    bottom.set_ylabel(f"{first} better\n[% of trials]")
    bottom.set_ylim(-3, 103)
    bottom.set_xticks(np.arange(len(names)), [index_label(n) for n in names], rotation=60)
    for axis in (top, bottom):
        axis.grid(axis="x", visible=False)
        axis.set_xlim(-0.6, len(names) - 0.4)
        for edge in range(len(names) - 1):
            axis.axvline(edge + 0.5, color="0.9", lw=0.4, zorder=0)
    handles, labels = top.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    caption = (
        f"{first} against {second} on the same plants and noise: median difference of the "
        f"magnitudes (below zero: {first} is better) and share of trials in which {first} is "
        f"strictly better (equal delays count for neither), with {LEVEL:.0%} bootstrap intervals."
    )
    return Drawing(figure, columns, caption)
