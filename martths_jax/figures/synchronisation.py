"""Synchronisation subspace plots: reached against wanted (paper, Figures 12 and 13)."""

from __future__ import annotations

import numpy as np

from martths_jax.figures.source import Source
from martths_jax.figures.style import (
    DOUBLE,
    SINGLE,
    Drawing,
    look,
    motion_label,
    new_figure,
)

#: Panels beside one another, at most.
ACROSS = 4
#: A degree of freedom as axes show it: unit -> word, factor, unit on the axis.
_WORDS = {"m": ("translation", 1e3, "mm"), "rad": ("rotation", 1e3, "mrad")}


def actuators(source: Source) -> Drawing:
    """Measured against target strokes."""
    pick = lambda run, i: (run["x_a"][:, i], run["x_m"][:, i])  # noqa: E731
    called = source.layout.actuators
    return _subspace(
        source, pick, [f"actuator {name}" for name in called], ["mm"] * len(called),
        "target stroke", "measured stroke", "actuator coordinates", called)  # fmt: skip


def interface(source: Source) -> Drawing:
    """Estimated motion of the interface against the numerical one."""
    layout = source.layout
    shown = [_WORDS.get(u, (u, 1.0, u)) for u in layout.output_units[: len(layout.interface)]]
    factors = [factor for _, factor, _ in shown]
    pick = lambda run, i: (factors[i] * run["num"][:, i], factors[i] * run["est"][:, i])  # noqa: E731
    words = [word for word, _, _ in shown]
    if len(set(words)) < len(words):
        words = [f"DOF {name}" for name in layout.interface]
    *most, last = layout.interface
    dofs = f"DOFs {', '.join(most)} and {last}" if most else f"DOF {last}"
    return _subspace(
        source, pick, words, [unit for _, _, unit in shown], "numerical", "estimated",
        f"interface coordinates ({dofs})", [str(i + 1) for i in range(len(words))])  # fmt: skip


def _subspace(source, pick, names, units, wanted, reached, coordinates, columns) -> Drawing:
    """A row of panels a controller, a panel a coordinate; `columns` are their names in the data."""
    runs = {c: source.history(c, source.motion) for c in source.controllers}
    across = min(len(names), ACROSS)
    lines = -(-len(names) // across)
    figure = new_figure(SINGLE if across <= 2 else DOUBLE, 8 + 42 * lines * len(runs))
    axes = figure.subplots(lines * len(runs), across, squeeze=False)
    data = {"time_s": source.shared(source.motion).time.values}
    for row, (name, run) in enumerate(runs.items()):
        panels = axes[lines * row : lines * (row + 1)].ravel()
        for axis in panels[len(names) :]:
            axis.set_visible(False)
        for i, column in enumerate(columns):
            axis = panels[i]
            x, y = pick(run, i)
            axis.plot(x, y, color=look(source.position(name))["color"], lw=0.4)
            sizes = np.abs(np.concatenate([x, y]))
            # A trial that ran away may hold no finite number at all.
            end = 1.08 * np.max(sizes[np.isfinite(sizes)], initial=0.0) or 1.0
            axis.plot([-end, end], [-end, end], color="black", ls=(0, (2, 2)), lw=0.7)
            axis.set(xlim=(-end, end), ylim=(-end, end), aspect="equal")
            axis.locator_params(nbins=5)
            axis.set_title(f"{source.label(name)}, {names[i]}")
            axis.set_xlabel(f"{wanted} [{units[i]}]")
            axis.set_ylabel(f"{reached} [{units[i]}]")
            data[f"{wanted.split()[0]}_{column}_{name}_{units[i]}"] = x
            data[f"{reached.split()[0]}_{column}_{name}_{units[i]}"] = y
    caption = (
        f"Synchronisation subspace plots in {coordinates}, {motion_label(source.motion)}, "
        f"{source.who}; dashed: perfect tracking."
    )
    return Drawing(figure, data, caption)
