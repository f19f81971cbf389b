"""Picture of a motion: acceleration, Arias build-up, response spectrum."""

from __future__ import annotations

import os

import numpy as np

from ..errors import InputError
from .builtin import BUILTIN_NAMES, builtin_facts
from .builtin.facts import PERIODS
from .measures import husid, significant_duration
from .overview import FIRST_MODE
from .record import Record
from .spectra import response_spectrum
from .units import G


def draw_motion(record: Record, path: str | os.PathLike) -> None:
    """Write the picture of an unscaled record; the ending of `path` picks the format.

    A built-in motion's spectrum is drawn over that of the record it was made from.
    """
    from matplotlib.figure import Figure

    time = np.arange(record.acceleration.size) * record.dt
    figure = Figure(figsize=(9, 6), layout="constrained")
    axes = figure.subplot_mosaic([["a", "a"], ["h", "s"]], height_ratios=[1, 1.3])
    figure.suptitle(f"{record.name}, unscaled ({os.path.basename(record.source)})")
    axes["a"].plot(time, record.acceleration, lw=0.7)
    axes["a"].set(xlabel="time [s]", ylabel="acceleration [m/s²]", xlim=(0, time[-1]))
    _draw_husid(axes["h"], record, time)
    _draw_spectrum(axes["s"], record)
    for axis in axes.values():
        axis.grid(alpha=0.3)
    try:
        figure.savefig(path, dpi=150, bbox_inches="tight")
    except (OSError, ValueError) as error:
        raise InputError(f"Picture {path} cannot be written: {error}.") from None


def _draw_husid(axis, record: Record, time: np.ndarray) -> None:
    curve = husid(record.acceleration, record.dt)
    axis.plot(time, curve / curve[-1])
    for level in (0.05, 0.95):
        axis.axhline(level, color="0.6", lw=0.8, ls="--")
    duration = significant_duration(record.acceleration, record.dt)
    axis.set(
        xlabel="time [s]",
        ylabel=f"Arias intensity / {curve[-1]:.3g} m/s",
        title=f"D5-95 = {duration:.3g} s",
        xlim=(0, time[-1]),
    )


def _draw_spectrum(axis, record: Record) -> None:
    spectrum = response_spectrum(record.acceleration, record.dt, PERIODS)
    axis.loglog(PERIODS, spectrum / G, label=record.name)
    if record.name in BUILTIN_NAMES:
        target = builtin_facts(record.name).spectrum
        axis.loglog(PERIODS, target / G, "k:", label=f"target ({BUILTIN_NAMES[record.name]})")
    axis.axvline(1 / FIRST_MODE, color="0.6", lw=0.8, ls="--", label="first frame mode")
    axis.legend(fontsize="small")
    axis.set(xlabel="period [s]", ylabel="pseudo-acceleration, 5 % [g]", xlim=(0.02, 5))
