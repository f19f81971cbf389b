"""Synchronisation subspace plots: reached against wanted (paper, Figures 12 and 13)."""

from __future__ import annotations

import numpy as np

from martths_jax.figures.source import Source
from martths_jax.figures.style import (
    SINGLE,
    Drawing,
    look,
    motion_label,
    new_figure,
)


def actuators(source: Source) -> Drawing:
    """Measured against target strokes."""
    pick = lambda run, i: (run["x_a"][:, i], run["x_m"][:, i])  # noqa: E731
    return _subspace(
        source, pick, ("actuator 1", "actuator 2"), ("mm", "mm"), "target stroke",
        "measured stroke", "actuator coordinates")  # fmt: skip


def interface(source: Source) -> Drawing:
    """Estimated motion of the interface against the numerical one."""
    pick = lambda run, i: (1e3 * run["num"][:, i], 1e3 * run["est"][:, i])  # noqa: E731
    return _subspace(
        source, pick, ("translation", "rotation"), ("mm", "mrad"), "numerical",
        "estimated", "interface coordinates (DOFs 4 and 28)")  # fmt: skip


def _subspace(source, pick, names, units, wanted, reached, coordinates) -> Drawing:
    runs = {c: source.history(c, source.motion) for c in source.controllers}
    figure = new_figure(SINGLE, 8 + 42 * len(runs))
    axes = figure.subplots(len(runs), 2, squeeze=False)
    data = {"time_s": source.shared(source.motion).time.values}
    for row, (name, run) in enumerate(runs.items()):
        for i in (0, 1):
            axis = axes[row, i]
            x, y = pick(run, i)
            axis.plot(x, y, color=look(source.position(name))["color"], lw=0.4)
            end = 1.08 * max(np.nanmax(np.abs(x)), np.nanmax(np.abs(y)))
            axis.plot([-end, end], [-end, end], color="black", ls=(0, (2, 2)), lw=0.7)
            axis.set(xlim=(-end, end), ylim=(-end, end), aspect="equal")
            axis.locator_params(nbins=5)
            axis.set_title(f"{source.label(name)}, {names[i]}")
            axis.set_xlabel(f"{wanted} [{units[i]}]")
            axis.set_ylabel(f"{reached} [{units[i]}]")
            data[f"{wanted.split()[0]}_{i + 1}_{name}_{units[i]}"] = x
            data[f"{reached.split()[0]}_{i + 1}_{name}_{units[i]}"] = y
    caption = (
        f"Synchronisation subspace plots in {coordinates}, {motion_label(source.motion)}, "
        f"{source.who}; dashed: perfect tracking."
    )
    return Drawing(figure, data, caption)
