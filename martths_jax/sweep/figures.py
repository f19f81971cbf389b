"""Heat maps over two axes and lines with confidence bands over one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from martths_jax.campaign.dataset import unit_of
from martths_jax.campaign.statistics import LEVEL, percentile, proportion
from martths_jax.figures.style import (
    DOUBLE,
    Drawing,
    Names,
    house_style,
    index_label,
    line,
    look,
    motion_label,
    new_figure,
    save,
)
from martths_jax.files import safe_name
from martths_jax.sweep.axes import Axis
from martths_jax.sweep.results import Sweep
from martths_jax.watch import Status

PERCENTS = (50, 95)
_WORDS = {50: "median", 95: "P95"}


def draw_figures(sweep: Sweep, folder: Path, shown: Sequence[str]) -> list[Path]:
    """Draw a sweep's figures into a folder: PDF, PNG and the CSV of what is drawn.

    Raises:
        InputError: files that cannot be written.
    """
    paths = []
    for name, drawing in drawings(sweep, shown):
        paths += save(drawing, folder, name)
    return paths


def drawings(sweep: Sweep, shown: Sequence[str]) -> Iterator[tuple[str, Drawing]]:
    """Figures one after the other, in the house style while the caller uses them.

    With one axis of several values: lines, a figure a motion.  With more: heat maps over two of
    them (Nb and the overlap if they are there, else the first two), a figure for each controller,
    motion and combination of the others.
    """
    moving = [axis for axis in sweep.axes if len(axis.values) > 1] or list(sweep.axes[:1])
    with house_style():
        for motion in sweep.dataset.motion.values:
            if len(moving) == 1:
                name = f"lines_{moving[0].name}_{safe_name(motion)}"
                yield name, lines(sweep, moving[0], motion, shown)
                continue
            pair = map_axes(moving)
            others = [axis for axis in sweep.axes if axis not in pair]
            for controller in sweep.dataset.controller.values:
                for place in np.ndindex(*(len(a.values) for a in others)):
                    fixed = {a.name: a.values[i] for a, i in zip(others, place, strict=True)}
                    tail = "".join(
                        f"_{a.name}={a.text(fixed[a.name])}" for a in others if len(a.values) > 1
                    )
                    names = f"{safe_name(controller)}_{safe_name(motion)}"
                    head = f"map_{pair[0].name}_{pair[1].name}_{names}"
                    drawing = heat_map(sweep, pair, str(controller), str(motion), fixed, shown)
                    yield head + tail, drawing


def map_axes(moving: Sequence[Axis]) -> tuple[Axis, Axis]:
    """The two axes of a heat map, the one that goes upwards first."""
    own = [axis for axis in moving if axis.scalar.own]
    # Two settings of a controller before what surrounds it; the count that comes first across.
    first, second, *_ = own if len(own) > 1 else moving
    whole = [axis for axis in (first, second) if axis.name == axis.scalar.setting]
    across = whole[0] if whole else first
    return (second if across is first else first), across


def heat_map(
    sweep: Sweep, pair: tuple[Axis, Axis], controller: str, motion: str, fixed: dict, shown
) -> Drawing:
    """Median (top) and P95 (bottom) of indices over two axes, with the share of lost trials."""
    up, across = pair
    where = {"controller": controller, "motion": motion, **fixed}
    order = (up.name, across.name)
    lost = sweep.lost_share().sel(where).transpose(*order).values
    left = (1 - lost) * (sweep.dataset.sizes["trial"] - 1)
    figure = new_figure(DOUBLE, 92)
    axes = figure.subplots(2, len(shown), sharex=True, sharey=True, squeeze=False)
    columns: dict[str, list] = {k: [] for k in ("index", *order, "median", "P95")}
    columns |= {"lost_share": [], "trials": []}
    maps = {}
    for j, name in enumerate(shown):
        for i, percent in enumerate(PERCENTS):
            values = sweep.statistics(name, percent).sel(where).transpose(*order).values
            maps[name, percent] = values
            axis = axes[i, j]
            picture = axis.imshow(
                np.ma.masked_invalid(values), origin="lower", aspect="auto", cmap="cividis_r",
                norm=_norm(values),
            )  # fmt: skip
            axis.grid(visible=False)
            axis.set_facecolor("white")
            for y, x in np.ndindex(values.shape):
                _overprint(axis, x, y, lost[y, x], picture.norm, values[y, x])
            bar = figure.colorbar(picture, ax=axis, location="top", pad=0.02, aspect=14)
            unit = unit_of(sweep.dataset, name)
            bar.set_label(f"{_WORDS[percent]} {index_label(name)} [{unit}]", fontsize=6.5)
            _plain_ticks(bar, picture.norm)
        for y, x in np.ndindex(lost.shape):
            for column, value in zip(
                columns.values(),
                (name, up.values[y], across.values[x], maps[name, 50][y, x],
                 maps[name, 95][y, x], lost[y, x], round(float(left[y, x]))),
                strict=True,
            ):  # fmt: skip
                column.append(value)
    for axis in axes[-1]:
        axis.set_xticks(
            range(len(across.values)), [across.text(v) for v in across.values], rotation=60
        )
    for axis in axes[:, 0]:
        axis.set_yticks(range(len(up.values)), [up.text(v) for v in up.values])
    figure.supxlabel(_axis_label(across), fontsize=7.5)
    figure.supylabel(_axis_label(up), fontsize=7.5)
    caption = (
        f"Median and 95th percentile of the indices over the uncertain plants that finished, "
        f"{Names(sweep.dataset).label(controller)} on {motion_label(motion)}"
        + "".join(f", {k} = {v:g}" for k, v in fixed.items())
        + ". Printed in the cells: share of lost trials in percent; white: none finished."
    )
    return Drawing(figure, columns, caption)


def _norm(values: np.ndarray):
    """Linear colours; logarithmic ones where values differ by more than a factor of ten."""
    from matplotlib.colors import LogNorm, Normalize

    good = values[np.isfinite(values)]
    if not good.size:
        return Normalize(0, 1)
    low, high = float(good.min()), float(good.max())
    if low > 0 and high > 10 * low:
        return LogNorm(low, high)
    return Normalize(low, high if high > low else low + (abs(low) or 1.0) * 1e-3)


def _plain_ticks(bar, norm) -> None:
    from matplotlib.colors import LogNorm
    from matplotlib.ticker import NullFormatter

    ticks = [norm.vmin, norm.vmax]
    if isinstance(norm, LogNorm):
        ticks.insert(1, float(np.sqrt(norm.vmin * norm.vmax)))
    bar.set_ticks(ticks, labels=[f"{t:.3g}" for t in ticks])
    # Neighbouring bars stand close: their end labels stay inside.
    for side, label in (("left", 0), ("right", -1)):
        bar.ax.get_xticklabels()[label].set_horizontalalignment(side)
    bar.ax.minorticks_off()
    bar.ax.xaxis.set_minor_formatter(NullFormatter())
    bar.ax.tick_params(labelsize=6, pad=1)


def _overprint(axis, x: int, y: int, lost: float, norm, value: float) -> None:
    dark = np.isfinite(value) and norm(value) > 0.55
    text = f"{100 * lost:.0f}" if lost in (0, 1) or lost >= 0.1 else f"{100 * lost:.1f}"
    axis.text(x, y, text, ha="center", va="center", fontsize=5, color="w" if dark else "k",
              fontweight="bold" if lost else "normal")  # fmt: skip


def _axis_label(axis: Axis) -> str:
    unit = axis.scalar.unit
    return axis.scalar.label if unit == "1" else f"{axis.scalar.label} [{unit}]"


def lines(sweep: Sweep, axis: Axis, motion: str, shown: Sequence[str]) -> Drawing:
    """Median and P95 with bootstrap confidence bands along one axis, and the lost trials."""
    data = sweep.dataset.sel(motion=motion)
    for other in sweep.axes:
        if other is not axis and other.name != axis.name:
            data = data.isel({other.name: 0})
    names = [str(c) for c in data.controller.values]
    panels = len(shown) + 1
    columns = 3
    figure = new_figure(DOUBLE, 52 * -(-panels // columns) + 6)
    axes = figure.subplots(-(-panels // columns), columns, squeeze=False).ravel()
    heads = ["controller", "index", "percent", axis.name, "value", "low", "high", "trials"]
    table: dict[str, list] = {head: [] for head in heads}

    def add(*cells):
        for column, cell in zip(table.values(), cells, strict=True):
            column.append(cell)

    values = np.array(axis.values, dtype=float)
    order, called = np.argsort(values), Names(sweep.dataset)
    for controller in names:
        position = called.position(controller)
        shape = look(position)
        for panel, name in zip(axes, shown, strict=False):
            sample = data.value.sel(controller=controller, index=name).transpose(axis.name, "trial")
            for percent in PERCENTS:
                found = [percentile(row[1:], percent) for row in sample.values]
                low, middle, high = (
                    np.array([getattr(e, k) for e in found])[order]
                    for k in ("low", "value", "high")
                )
                panel.fill_between(values[order], low, high, color=shape["color"], alpha=0.18, lw=0)
                label = f"{called.label(controller)}, {_WORDS[percent]}"
                panel.plot(values[order], middle, label=label, marker=shape["marker"], ms=2.4,
                           mfc="white" if percent == 95 else None, **line(position))  # fmt: skip
                for value, e in zip(axis.values, found, strict=True):
                    add(controller, name, percent, value, e.value, e.low, e.high, e.trials)
        status = data.status.sel(controller=controller).transpose(axis.name, "trial").values[:, 1:]
        shares = [proportion(int(np.sum(row >= Status.DIVERGED)), row.size) for row in status]
        low, middle, high = (
            100 * np.array([getattr(e, k) for e in shares])[order] for k in ("low", "value", "high")
        )
        panel = axes[len(shown)]
        panel.fill_between(values[order], low, high, color=shape["color"], alpha=0.18, lw=0)
        panel.plot(values[order], middle, marker=shape["marker"], ms=2.4, **line(position))
        for value, e in zip(axis.values, shares, strict=True):
            add(controller, "lost", "", value, e.value, e.low, e.high, e.trials)
    _name_panels(axes, [f"{index_label(n)} [{unit_of(sweep.dataset, n)}]" for n in shown], axis)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=min(4, len(labels)))
    caption = (
        f"Indices along {axis.scalar.label} on {motion_label(motion)}: median (filled markers) and "
        f"95th percentile (open) over the uncertain plants that finished, with {LEVEL:.0%} "
        "bootstrap confidence bands; the last panel has the share of lost trials."
    )
    return Drawing(figure, table, caption)


def _name_panels(axes, labels: list[str], axis: Axis) -> None:
    """Label the panels of indices and, behind them, that of lost trials; hide the others."""
    for panel, label in zip(axes, [*labels, "lost trials [%]"], strict=False):
        panel.set_ylabel(label)
        panel.set_xlabel(_axis_label(axis))
        if _is_logarithmic(np.array(axis.values, dtype=float)):
            panel.set_xscale("log")
    lost = axes[len(labels)]
    lost.set_ylim(bottom=0, top=max(1.0, lost.get_ylim()[1]))
    for panel in axes[len(labels) + 1 :]:
        panel.set_visible(False)


def _is_logarithmic(values: np.ndarray) -> bool:
    """Whether values read better on a logarithmic axis: all positive, over more than a decade."""
    return bool(np.all(values > 0) and values.max() > 10 * values.min())
