"""The drawn control plants in the frequency domain, and the delay before and after compensation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from martths_jax.figures.source import Source
from martths_jax.figures.style import (
    DOUBLE,
    Drawing,
    line,
    motion_label,
    new_figure,
)
from martths_jax.text import counted
from martths_jax.transfer import NOMINAL_HZ, frequency_response

FREQUENCY = np.geomspace(0.1, 100.0, 160)  # Hz
BANDS = ((5, 95, "0.86"), (25, 75, "0.70"))
PERCENTS = [percent for low, high, _ in BANDS for percent in (low, high)]
#: Responses worked on at once: memory does not grow with plants times frequencies.
BLOCK = 2_000_000


def bode(source: Source) -> Drawing:
    """Magnitude and phase of the four channels: percentile bands of the plants over the nominal."""
    plants = np.asarray(source.study.dataset.plant_hz.values)[1:]
    drawn = _magnitude_and_phase(plants, _percentiles)
    nominal = _magnitude_and_phase(NOMINAL_HZ[None], _only)
    figure = new_figure(DOUBLE, 118)
    axes = figure.subplots(4, 4, sharex=True)
    data = {"frequency_hz": FREQUENCY}
    rows = (("magnitude_db", "dB"), ("phase_deg", "°"))
    for column, (i, j) in enumerate(np.ndindex(2, 2)):
        axes[0, column].set_title(f"$H_{{{i + 1}{j + 1}}}$")
        axes[-1, column].set_xlabel("frequency [Hz]")
        for k, (what, unit) in enumerate(rows):
            bands, middle = drawn[k][..., i, j], nominal[k][:, i, j]
            name = f"H{i + 1}{j + 1}_{what}"
            absolute, relative = axes[2 * k : 2 * k + 2, column]
            _bands(absolute, bands, data, name)
            _bands(relative, bands - middle, data, f"{name}_from_nominal")
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
        f"Bode diagrams of {counted(plants.shape[0], 'drawn plant')} (mm of stroke a mm of "
        "command): percentile bands over the nominal plant, and their distance from it; the "
        "uncertainty of the paper's Table 2 seen."
    )
    return Drawing(figure, data, caption)


def _responses(plants_hz: np.ndarray, of: Callable = lambda response: response):
    """Responses of plants in blocks of frequencies, so that any number of plants fits in memory.

    Args:
        plants_hz: (T, 9) as in ``Plants.parameters_hz``.
        of: what is wanted of the responses (B, 2, 2, T), such as a sum over the commands.

    Yields:
        frequencies (B,) [Hz], what `of` gives, and its phase [rad], continuous over all blocks.
    """
    size = max(1, BLOCK // (4 * len(plants_hz)))
    before = None
    for first in range(0, FREQUENCY.size, size):
        frequency = FREQUENCY[first : first + size]
        response = of(np.asarray(frequency_response(plants_hz, frequency)))
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


def _magnitude_and_phase(plants_hz: np.ndarray, reduce: Callable) -> list[np.ndarray]:
    """Magnitude [dB] and phase [degree] of the four channels, (..., F, 2, 2), plants reduced."""
    blocks = [
        (reduce(20 * np.log10(np.abs(response))), reduce(np.rad2deg(phase)))
        for _, response, phase in _responses(plants_hz)
    ]
    return [np.concatenate(parts, axis=-3) for parts in zip(*blocks, strict=True)]


def _bands(axis, percentiles: np.ndarray, data: dict, name: str) -> None:
    found = dict(zip(PERCENTS, percentiles, strict=True))
    for low, high, shade in BANDS:
        a, b = found[low], found[high]
        axis.fill_between(FREQUENCY, a, b, color=shade, lw=0, label=f"P{low}–P{high}")
        data[f"{name}_P{low}"], data[f"{name}_P{high}"] = a, b


def _plant_delay(plants_hz: np.ndarray, fs: float, reduce: Callable) -> np.ndarray:
    """Delay [ms] with both actuators commanded alike, (..., F, 2), plants reduced."""
    blocks = [
        reduce(1e3 * (0.5 / fs - phase / (2 * np.pi * frequency[:, None, None])))
        for frequency, _, phase in _responses(plants_hz, lambda response: response.sum(axis=2))
    ]
    return np.concatenate(blocks, axis=-2)


def delay(source: Source) -> Drawing:
    """Delay against frequency: of the drawn plants, and of the controlled strokes of one trial.

    Before compensation, both actuators commanded alike: minus the phase of the row sum H_i1 + H_i2
    over the circular frequency, and half a sample for the command's hold.  After it: minus the
    phase of the cross spectrum of target and measured stroke (Welch, 4 s windows), where the target
    has at least a ten-thousandth of its largest power density.
    """
    plants = np.asarray(source.study.dataset.plant_hz.values)[1:]
    drawn = _plant_delay(plants, source.fs, _percentiles)
    nominal = _plant_delay(NOMINAL_HZ[None], source.fs, _only)
    figure = new_figure(DOUBLE, 72)
    axes = figure.subplots(1, 2, sharey=True)
    data: dict[str, np.ndarray] = {}
    for i, axis in enumerate(axes):
        _bands(axis, drawn[..., i], data, f"plant_{i + 1}_ms")
        axis.plot(
            FREQUENCY,
            nominal[:, i],
            color="black",
            lw=1.0,
            label="nominal plant, no compensation",
        )
        data[f"plant_{i + 1}_ms_nominal"] = nominal[:, i]
        for name in source.controllers:
            run = source.history(name, source.motion)
            f, late = spectral_delay(run["x_a"][:, i], run["x_m"][:, i], source.fs)
            axis.plot(
                f, late, **line(source.position(name)), label=f"with {source.label(name)}"
            )
            data[f"{name}_{i + 1}_ms"] = np.interp(FREQUENCY, f, late, np.nan, np.nan)
        axis.axhline(0, color="0.4", lw=0.6)
        axis.set_xscale("log")
        axis.set(xlim=(0.2, 30), xlabel="frequency [Hz]", title=f"actuator {i + 1}")
    high = np.max(drawn[PERCENTS.index(95), FREQUENCY >= 0.2])
    axes[0].set(ylabel="delay [ms]", ylim=(-0.25 * high, 1.1 * high))
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    caption = (
        "Delay against frequency before compensation (drawn plants, both actuators commanded "
        f"alike) and after it (cross spectra of target and measured strokes, {source.who}, "
        f"{motion_label(source.motion)})."
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
