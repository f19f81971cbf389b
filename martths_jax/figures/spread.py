"""Indices over the uncertain plants: ranges (paper, Figure 14), histograms (15), ECDFs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from martths_jax.figures.source import Source
from martths_jax.figures.style import (
    DOUBLE,
    Drawing,
    index_label,
    line,
    look,
    motion_label,
    new_figure,
)

#: What an axis shows, by the unit of its indices.
WORDS = {"ms": "delay [ms]", "%": "error [%]"}
PERCENTS = (5, 25, 50, 75, 95)
#: Steps of a distribution function that are drawn, at most.
STEPS = 2000


def controllers(source: Source) -> Drawing:
    """Median and interquartile range of all indices, controller beside controller (Figure 14a)."""
    samples = {
        c: {n: source.values(c, source.motion, n) for n in source.indices}
        for c in source.controllers
    }
    places = {c: source.position(c) for c in samples}
    caption = (
        f"Median (marker), interquartile range (bar) and P5-P95 (line) of the indices over the "
        f"uncertain plants, {motion_label(source.motion)}."
    )
    return _ranges(source, samples, places, source.label, "controller", caption)


def motions(source: Source, controller: str) -> Drawing:
    """The same of one controller, motion beside motion (Figure 14b)."""
    samples = {
        m: {n: source.values(controller, m, n) for n in source.indices} for m in source.motions
    }
    places = {m: i for i, m in enumerate(samples)}
    caption = (
        f"Median (marker), interquartile range (bar) and P5-P95 (line) of the indices over the "
        f"uncertain plants, {source.label(controller)}, motion by motion."
    )
    return _ranges(source, samples, places, motion_label, "motion", caption)


def _ranges(
    source: Source, samples: Mapping[str, Mapping[str, np.ndarray]], places, label, what: str,
    caption: str,
) -> Drawing:  # fmt: skip
    figure = new_figure(DOUBLE, 82)
    units = source.units
    widths = [len(names) + (0.7 if unit == "ms" else 0.0) for unit, names in units.items()]
    axes = figure.subplots(1, len(units), width_ratios=widths, squeeze=False)[0]
    rows: dict[str, list] = {k: [] for k in (what, "index", *(f"P{p}" for p in PERCENTS))}
    width = 0.8 / len(samples)
    for axis, (unit, names) in zip(axes, units.items(), strict=True):
        smallest = np.inf
        for i, (key, found) in enumerate(samples.items()):
            shape = look(places[key])
            at = np.arange(len(names)) + (i - (len(samples) - 1) / 2) * width
            low, q1, middle, q3, high = np.array([_percentiles(found[n]) for n in names]).T
            smallest = min(smallest, np.nanmin(low, initial=np.inf))
            axis.vlines(at, low, high, color=shape["color"], lw=0.7)
            axis.vlines(at, q1, q3, color=shape["color"], lw=3.2, alpha=0.45)
            axis.plot(at, middle, ls="", marker=shape["marker"], ms=3, color=shape["color"],
                      mfc="white" if i % 2 == 0 else shape["color"], mew=0.8,
                      label=label(key))  # fmt: skip
            for n, values in zip(names, zip(low, q1, middle, q3, high, strict=True), strict=True):
                for column, value in zip(rows, (key, n, *values), strict=True):
                    rows[column].append(value)
        axis.set_xticks(np.arange(len(names)), [index_label(n) for n in names], rotation=60)
        axis.set_ylabel(WORDS.get(unit, f"[{unit}]"))
        axis.set_xlim(-0.6, len(names) - 0.4)
        axis.grid(axis="x", visible=False)
        for edge in range(len(names) - 1):
            axis.axvline(edge + 0.5, color="0.9", lw=0.4, zorder=0)
        if unit == "%" and 0 < smallest < np.inf:
            axis.set_yscale("log")
            _plain_log_ticks(axis.yaxis)
    handles, labels = axes[-1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return Drawing(figure, rows, caption)


def _percentiles(sample: np.ndarray) -> np.ndarray:
    sample = sample[np.isfinite(sample)]
    return np.percentile(sample, PERCENTS) if sample.size else np.full(len(PERCENTS), np.nan)


def _plain_log_ticks(axis) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def histograms(source: Source) -> Drawing:
    """Histograms of all indices of one motion but the delays (Figure 15)."""
    errors = [n for n in source.indices if source.unit(n) != "ms"] or source.indices
    tail = "_percent" if all(source.unit(n) == "%" for n in errors) else ""
    columns: dict[str, list] = {"index": [], f"from{tail}": [], f"to{tail}": []}
    columns |= {f"trials_{c}": [] for c in source.controllers}

    def panel(axis, name: str) -> None:
        samples = {c: source.values(c, source.motion, name) for c in source.controllers}
        edges = _edges(np.concatenate(list(samples.values())))
        for c, sample in samples.items():
            shape = look(source.position(c))
            filled = source.position(c) % 2 == 1
            counts, _ = np.histogram(sample[np.isfinite(sample)], edges)
            axis.stairs(counts, edges, fill=filled, lw=0.9, label=source.label(c),
                        color=shape["fill"] if filled else shape["color"],
                        zorder=1 if filled else 3)  # fmt: skip
            columns[f"trials_{c}"] += counts.tolist()
        columns["index"] += [name] * (edges.size - 1)
        columns[f"from{tail}"] += edges[:-1].tolist()
        columns[f"to{tail}"] += edges[1:].tolist()

    figure = _panels(source, errors, panel, 178, "trials")
    names = " and ".join(map(source.label, source.controllers))
    caption = (
        f"Histograms of the error indices over the uncertain plants, {names}, "
        f"{motion_label(source.motion)}; outside the drawn range lie 0.5 % of them a side."
    )
    return Drawing(figure, columns, caption)


def _edges(sample: np.ndarray, bins: int = 30) -> np.ndarray:
    sample = sample[np.isfinite(sample)]
    if not sample.size:
        return np.linspace(0, 1, bins + 1)
    low, high = np.percentile(sample, [0.5, 99.5])
    room = 0.02 * (high - low) or 0.5
    return np.linspace(low - room, high + room, bins + 1)


def ecdf(source: Source) -> Drawing:
    """Empirical distribution functions of all indices of one motion.

    Of curves of more than ``STEPS`` steps, so many are drawn, evenly by rank and with both ends:
    each is a point of the whole curve.
    """
    columns: dict[str, list] = {k: [] for k in ("index", "controller", "value", "share")}
    trials = int(source.study.dataset.sizes["trial"]) - 1

    def panel(axis, name: str) -> None:
        for c in source.controllers:
            sample = np.sort(source.values(c, source.motion, name))
            sample = sample[np.isfinite(sample)]
            share = np.arange(1, sample.size + 1) / max(sample.size, 1)
            drawn = _spaced(sample.size, STEPS)
            sample, share = sample[drawn], share[drawn]
            axis.step(sample, share, where="post", **line(source.position(c)),
                      label=source.label(c))  # fmt: skip
            for column, values in zip(
                columns, ([name] * sample.size, [c] * sample.size, sample, share), strict=True
            ):
                columns[column] += list(values)
        axis.set_ylim(0, 1)

    figure = _panels(source, source.indices, panel, 205, "share of trials")
    caption = (
        "Empirical distribution functions of the indices over the uncertain plants that "
        f"finished, {motion_label(source.motion)}."
    )
    if trials > STEPS:
        note = f"{STEPS} of {trials} trials drawn, evenly by rank"
        figure.supxlabel(f"of each curve {note}", fontsize=6)
        caption += f" Of each curve {note}; the shares are those of all."
    return Drawing(figure, columns, caption)


def _spaced(size: int, most: int) -> np.ndarray:
    """At most `most` of the positions 0 ... size - 1, evenly spaced, with both ends."""
    if size <= most:
        return np.arange(size)
    return np.linspace(0, size - 1, most).round().astype(int)


def _panels(source: Source, names, panel, height: float, ylabel: str):
    """Small panels, four in a row, one an index, with a common legend.

    Args:
        height: of a figure of four to six rows [mm]; more make it higher, fewer lower.
    """
    rows = -(-len(names) // 4)
    share = max(1.0, rows / 6) if rows > 3 else (rows + 0.8) / 5
    figure = new_figure(DOUBLE, height * share)
    axes = figure.subplots(rows, 4, squeeze=False)
    for axis, name in zip(axes.flat, names, strict=False):
        panel(axis, name)
        axis.set_xlabel(f"{index_label(name)} [{source.unit(name)}]", labelpad=1)
        axis.locator_params(axis="both", nbins=4)
    for axis in axes.flat[len(names) :]:
        axis.set_visible(False)
    for axis in axes[:, 0]:
        axis.set_ylabel(ylabel)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return figure
