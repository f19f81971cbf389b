"""The drawn control plants in the frequency domain, and the delay before and after compensation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from martths_jax.figures.source import Source
from martths_jax.figures.style import (
    DOUBLE,
    SINGLE,
    Drawing,
    line,
    motion_label,
    new_figure,
)
from martths_jax.text import counted

FREQUENCY = np.geomspace(0.1, 100.0, 160)  # Hz
BANDS = ((5, 95, "0.86"), (25, 75, "0.70"))
PERCENTS = [percent for low, high, _ in BANDS for percent in (low, high)]
#: Responses worked on at once: memory does not grow with plants times frequencies.
BLOCK = 2_000_000


def bode(source: Source) -> Drawing:
    """Magnitude and phase of all channels: percentile bands of the plants over the nominal."""
    plants, n = source.plants(), len(source.layout.actuators)
    drawn = _magnitude_and_phase(plants, n, _percentiles)
    nominal = _magnitude_and_phase(source.plants(nominal=True), n, _only)
    # Up to two actuators all channels stand side by side, else a band of rows an output.
    across = n * n if n <= 2 else n
    bands = n * n // across
    figure = new_figure(SINGLE if n == 1 else DOUBLE, 118 * bands)
    axes = figure.subplots(4 * bands, across, sharex=True, squeeze=False)
    data = {"frequency_hz": FREQUENCY}
    rows = (("magnitude_db", "dB"), ("phase_deg", "°"))
    for place, (i, j) in enumerate(np.ndindex(n, n)):
        band, column = divmod(place, across)
        channel = axes[4 * band : 4 * band + 4, column]
        channel[0].set_title(f"$H_{{{i + 1}{j + 1}}}$")
        channel[-1].set_xlabel("frequency [Hz]")
        for k, (what, unit) in enumerate(rows):
            spread, middle = drawn[k][..., i, j], nominal[k][:, i, j]
            name = f"H{i + 1}{j + 1}_{what}"
            absolute, relative = channel[2 * k : 2 * k + 2]
            _bands(absolute, spread, data, name)
            _bands(relative, spread - middle, data, f"{name}_from_nominal")
            for axis, curve in ((absolute, middle), (relative, 0 * middle)):
                axis.plot(FREQUENCY, curve, color="black", lw=0.9, label="nominal")
                axis.set(xscale="log", xlim=(FREQUENCY[0], FREQUENCY[-1]))
            data[f"{name}_nominal"] = middle
            if column == 0:
                absolute.set_ylabel(f"{what.partition('_')[0]} [{unit}]")
                relative.set_ylabel(f"from nominal [{unit}]")
    figure.align_ylabels()
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    caption = (
        f"Bode diagrams of {counted(len(plants), 'drawn plant')} (mm of stroke a mm of "
        "command): percentile bands over the nominal plant, and their distance from it."
    )
    return Drawing(figure, data, caption)


def _responses(plants, strokes: int, of: Callable = lambda response: response):
    """Responses of plants in blocks of frequencies, so that any number of plants fits in memory.

    Args:
        plants: T of them, with ``frequency_response``.
        strokes: their first n outputs, which are as many as the commands.
        of: what is wanted of the responses (B, n, n, T), such as a sum over the commands.

    Yields:
        frequencies (B,) [Hz], what `of` gives, and its phase [rad], continuous over all blocks.
    """
    size = max(1, BLOCK // (strokes**2 * len(plants)))
    before = None
    for first in range(0, FREQUENCY.size, size):
        frequency = FREQUENCY[first : first + size]
        response = of(np.asarray(plants.frequency_response(frequency))[:, :strokes])
        angle = np.angle(response)
        joined = angle if before is None else np.concatenate([before, angle])
        phase = np.unwrap(joined, axis=0)[-frequency.size :]
        before = phase[-1:]
        yield frequency, response, phase


def _percentiles(values: np.ndarray) -> np.ndarray:
    """(B, ..., T) as (percents, B, ...)."""
    return np.percentile(values, PERCENTS, axis=-1)


def _only(values: np.ndarray) -> np.ndarray:
    """(B, ..., 1) as (B, ...)."""
    return values[..., 0]


def _magnitude_and_phase(plants, strokes: int, reduce: Callable) -> list[np.ndarray]:
    """Magnitude [dB] and phase [degree] of the channels, (..., F, n, n), plants reduced."""
    blocks = [
        (reduce(20 * np.log10(_above_zero(np.abs(response)))), reduce(np.rad2deg(phase)))
        for _, response, phase in _responses(plants, strokes)
    ]
    return [np.concatenate(parts, axis=-3) for parts in zip(*blocks, strict=True)]


def _above_zero(size: np.ndarray) -> np.ndarray:
    """Magnitudes, NaN where no command reaches a stroke."""
    return np.where(size > 0, size, np.nan)


def _bands(axis, percentiles: np.ndarray, data: dict, name: str) -> None:
    found = dict(zip(PERCENTS, percentiles, strict=True))
    for low, high, shade in BANDS:
        a, b = found[low], found[high]
        axis.fill_between(FREQUENCY, a, b, color=shade, lw=0, label=f"P{low}–P{high}")
        data[f"{name}_P{low}"], data[f"{name}_P{high}"] = a, b


def _plant_delay(plants, strokes: int, fs: float, reduce: Callable) -> np.ndarray:
    """Delay [ms] with all actuators commanded alike, (..., F, n), plants reduced."""
    blocks = [
        reduce(1e3 * (0.5 / fs - phase / (2 * np.pi * frequency[:, None, None])))
        for frequency, _, phase in _responses(plants, strokes, lambda response: response.sum(2))
    ]
    return np.concatenate(blocks, axis=-2)


def delay(source: Source) -> Drawing:
    """Delay against frequency: of the drawn plants, and of the controlled strokes of one trial.

    Before compensation, all actuators commanded alike: minus the phase of the row sum of H_ij over
    the circular frequency, and half a sample for the command's hold.  After it: minus the phase
    of the cross spectrum of target and measured stroke (Welch, 4 s windows), where the target has
    at least a ten-thousandth of its largest power density.
    """
    called = source.layout.actuators
    n = len(called)
    drawn = _plant_delay(source.plants(), n, source.fs, _percentiles)
    nominal = _plant_delay(source.plants(nominal=True), n, source.fs, _only)
    figure = new_figure(DOUBLE, 72)
    axes = figure.subplots(1, n, sharey=True, squeeze=False)[0]
    data: dict[str, np.ndarray] = {}
    for i, axis in enumerate(axes):
        _bands(axis, drawn[..., i], data, f"plant_{called[i]}_ms")
        axis.plot(
            FREQUENCY,
            nominal[:, i],
            color="black",
            lw=1.0,
            label="nominal plant, no compensation",
        )
        data[f"plant_{called[i]}_ms_nominal"] = nominal[:, i]
        for name in source.controllers:
            run = source.history(name, source.motion)
            f, late = spectral_delay(run["x_a"][:, i], run["x_m"][:, i], source.fs)
            axis.plot(f, late, **line(source.position(name)), label=f"with {source.label(name)}")
            known = np.interp(FREQUENCY, f, late, np.nan, np.nan) if f.size else np.nan * FREQUENCY
            data[f"{name}_{called[i]}_ms"] = known
        axis.axhline(0, color="0.4", lw=0.6)
        axis.set_xscale("log")
        axis.set(xlim=(0.2, 30), xlabel="frequency [Hz]", title=f"actuator {called[i]}")
    high = np.max(drawn[PERCENTS.index(95), FREQUENCY >= 0.2])
    axes[0].set(ylabel="delay [ms]", ylim=(-0.25 * high, 1.1 * high))
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    alike = {1: "", 2: ", both actuators commanded alike"}.get(n, ", all actuators commanded alike")
    caption = (
        f"Delay against frequency before compensation (drawn plants{alike}) and after it (cross "
        f"spectra of target and measured strokes, {source.who}, {motion_label(source.motion)})."
    )
    return Drawing(figure, {"frequency_hz": FREQUENCY} | data, caption)


def spectral_delay(target: np.ndarray, reached: np.ndarray, fs: float):
    """Delay of `reached` behind `target` at the frequencies where the target has power.

    Args:
        target, reached: (N,) signals of one unit.
        fs: sampling rate [Hz].

    Returns:
        frequencies [Hz], delays [ms], positive = late.
    """
    from scipy import signal

    size = int(min(target.size, 4 * fs))
    f, cross = signal.csd(target, reached, fs, nperseg=size)
    _, power = signal.welch(target, fs, nperseg=size)
    good = (f > 0) & (power >= 1e-4 * power[1:].max())
    return f[good], -1e3 * np.angle(cross[good]) / (2 * np.pi * f[good])
