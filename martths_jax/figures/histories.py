"""Histories of one trial: strokes (paper, Figures 8-10) and identified coefficients (Figure 11)."""

from __future__ import annotations

import numpy as np

from martths_jax.figures.source import Source
from martths_jax.figures.style import (
    DOUBLE,
    TARGET,
    Drawing,
    line,
    motion_label,
    new_figure,
    typeset,
)


def strokes(source: Source, motion: str) -> Drawing:
    """Target and measured strokes of all actuators: the whole record, then three windows."""
    time = source.shared(motion).time.values
    runs = {c: source.history(c, motion) for c in source.controllers}
    windows = source.zoom_windows(motion)
    actuators = source.layout.actuators
    figure = new_figure(DOUBLE, 79 * len(actuators))
    grid = figure.add_gridspec(2 * len(actuators), 3, height_ratios=[1, 1.15] * len(actuators))
    for actuator, called in enumerate(actuators):
        whole = figure.add_subplot(grid[2 * actuator, :])
        _strokes(whole, source, time, runs, actuator, (time[0], time[-1]), widths=(1.4, 0.6))
        whole.set(xlabel="time [s]", ylabel=f"actuator {called}:\nstroke [mm]")
        for a, b in windows:
            whole.axvspan(a, b, color="0.9", zorder=0)
        if actuator == 0:
            handles, labels = whole.get_legend_handles_labels()
            figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
        for i, window in enumerate(windows):
            axis = figure.add_subplot(grid[2 * actuator + 1, i])
            _strokes(axis, source, time, runs, actuator, window, widths=(2.2, 0.9))
            if i == 0:
                axis.set_ylabel(f"actuator {called}:\nstroke [mm]")
            axis.set_xlabel("time [s]")
    data = {"time_s": time}
    for actuator, called in enumerate(actuators):
        # The target answers the motion that was reached, so every controller has its own.
        for name, run in runs.items():
            data[f"target_{called}_{name}_mm"] = run["x_a"][:, actuator]
            data[f"measured_{called}_{name}_mm"] = run["x_m"][:, actuator]
    caption = (
        f"Target and measured strokes under {motion_label(motion)}, {source.who}; whole record and "
        "the three shaded windows. The target drawn is that of "
        f"{source.label(source.controllers[-1])}."
    )
    return Drawing(figure, data, caption)


def _strokes(axis, source, time, runs, actuator, window, widths) -> None:
    inside = (time >= window[0]) & (time <= window[1])
    last = runs[source.controllers[-1]]
    axis.plot(
        time[inside], last["x_a"][inside, actuator], **TARGET | {"lw": widths[0]}, label="target"
    )
    for name, run in runs.items():
        axis.plot(
            time[inside],
            run["x_m"][inside, actuator],
            **line(source.position(name)),
            lw=widths[1],
            label=f"measured, {source.label(name)}",
        )
    axis.set_xlim(window)
    axis.margins(y=0.08)


def coefficients(source: Source, controller: str) -> Drawing:
    """The identified coefficients of all actuators over time, four a target stroke.

    The simulation works with scaled derivatives dt^j x^(j); drawn are the coefficients of the
    derivatives themselves, with milliseconds as the unit of time.
    """
    motion, actuators = source.motion, source.layout.actuators
    time = source.shared(motion).time.values
    history = source.coefficients(controller, motion)  # (N, 4 n, n)
    step = 1e3 / source.fs  # ms
    units = ("1", "ms", "ms²", "ms³")
    figure = new_figure(DOUBLE, 130)
    axes = figure.subplots(4, len(actuators), sharex=True, squeeze=False)
    data = {"time_s": time}
    for stroke, moved in enumerate(actuators):
        for order in range(4):
            axis = axes[order, stroke]
            for actuator, called in enumerate(actuators):
                value = history[:, 4 * stroke + order, actuator] * step**order
                axis.plot(time, value, **line((1, 0)[actuator] if actuator < 2 else actuator),
                          lw=0.8, label=f"command of actuator {called}")  # fmt: skip
                data[f"a{called}_x{moved}_d{order}_ms{order}"] = value
            axis.set_ylabel(f"{_derivative(moved, order)}\n[{units[order]}]")
            _robust_limits(axis, history[:, 4 * stroke + order] * step**order)
            axis.set_xlim(time[0], time[-1])
        axes[-1, stroke].set_xlabel("time [s]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    figure.align_ylabels()
    caption = (
        f"Identified coefficients of {source.label(controller)} under {motion_label(motion)}, "
        f"{source.who}: what multiplies the target strokes and their derivatives in each command."
    )
    return Drawing(figure, data, caption)


def _derivative(stroke: str, order: int) -> str:
    dots = ("{}", r"\dot{{{}}}", r"\ddot{{{}}}", r"\dddot{{{}}}")[order].format("x")
    return f"of ${dots}_{{a,{typeset(stroke)}}}$"


def _robust_limits(axis, values: np.ndarray) -> None:
    """Limits that one bad second cannot blow up: the middle 98 % and what lies around it."""
    low, high = np.nanpercentile(values, [1, 99])
    room = 0.35 * (high - low) or 0.5
    axis.set_ylim(max(low - room, np.nanmin(values) - 0.1 * room),
                  min(high + room, np.nanmax(values) + 0.1 * room))  # fmt: skip
