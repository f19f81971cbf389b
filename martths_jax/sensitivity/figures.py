"""Tornado charts: the factors of an index, the one that moves it most on top."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from martths_jax.campaign.dataset import index_names
from martths_jax.figures.style import (
    BLUE,
    DOUBLE,
    Drawing,
    Names,
    house_style,
    index_label,
    new_figure,
    save,
)
from martths_jax.files import safe_name
from martths_jax.sensitivity.estimators import LEVEL
from martths_jax.sensitivity.results import Sensitivity, indices_of

#: Shares are drawn up to here, at most; an interval of few samples may end anywhere.
WIDEST = 10.0


def draw_figures(found: Sensitivity, folder: Path, shown: Sequence[str]) -> list[Path]:
    """Draw a tornado chart of each controller: PDF, PNG and the CSV of what is drawn.

    Raises:
        InputError: files that cannot be written.
    """
    paths = []
    for controller in found.dataset.controller.values:
        with house_style():
            drawing = tornado(found, str(controller), shown)
            paths += save(drawing, folder, f"tornado_{safe_name(controller)}")
    return paths


def tornado(found: Sensitivity, controller: str, shown: Sequence[str]) -> Drawing:
    """Total (light) and first-order (dark) indices of each factor, sorted, with intervals."""
    one = indices_of(found, controller)
    factors = [str(f) for f in found.dataset.factor.values]
    names = index_names(found.dataset)
    across = min(3, len(shown))
    down = -(-len(shown) // across)
    figure = new_figure(DOUBLE, 58 * down + 10)
    axes = figure.subplots(down, across, squeeze=False).ravel()
    heads = ("index", "factor", "total", "total_low", "total_high", "first", "first_low",
             "first_high")  # fmt: skip
    columns: dict[str, list] = {head: [] for head in heads}
    for panel, name in zip(axes, shown, strict=False):
        i = names.index(name)
        panel.set_title(index_label(name))
        panel.set_xlim(0, 1)
        if not one.varies[i]:
            panel.set_yticks([])
            panel.text(0.5, 0.5, "does not vary", ha="center", va="center",
                       transform=panel.transAxes)  # fmt: skip
            continue
        order = np.argsort(one.total[i])
        places = np.arange(order.size)
        for value, low, high, colour, shift, label in (
            (one.total, one.total_low, one.total_high, "#B9D3E3", 0.19, "total"),
            (one.first, one.first_low, one.first_high, BLUE, -0.19, "first order"),
        ):
            x = value[i, order]
            error = np.maximum([x - low[i, order], high[i, order] - x], 0)
            panel.barh(places + shift, x, height=0.38, color=colour, label=label)
            panel.errorbar(x, places + shift, xerr=error, fmt="none", lw=0.7, capsize=1.2,
                           capthick=0.7, ecolor="k")  # fmt: skip
        panel.set_yticks(places, [factors[j] for j in order], fontsize=6)
        ends = (one.first_low[i], one.total_high[i], one.first_high[i])
        low, high = float(ends[0].min()), max(float(e.max()) for e in ends)
        panel.set_xlim(max(-WIDEST, min(0.0, low)), min(WIDEST, max(1.0, high)))
        panel.grid(axis="y", visible=False)
        for j in order[::-1]:
            cells = (name, factors[j], one.total[i, j], one.total_low[i, j], one.total_high[i, j],
                     one.first[i, j], one.first_low[i, j], one.first_high[i, j])  # fmt: skip
            for column, cell in zip(columns.values(), cells, strict=True):
                column.append(cell)
    for panel in axes[len(shown) :]:
        panel.set_visible(False)
    figure.supxlabel("share of the variance", fontsize=7.5)
    drawn = [h for panel in axes for h in [panel.get_legend_handles_labels()] if h[0]]
    if drawn:
        figure.legend(*drawn[0], loc="outside upper center", ncols=2)
    label = Names(found.dataset).label(controller)
    caption = (
        f"Sobol' indices of {label}: share of an index's variance that a "
        f"factor moves alone (first order) and with all its interactions (total), with {LEVEL:.0%} "
        f"bootstrap confidence intervals, N = {one.used}."
    )
    return Drawing(figure, columns, caption)
