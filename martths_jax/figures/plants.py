"""The drawn control plants in the frequency domain, and the delay before and after compensation."""

from __future__ import annotations

import numpy as np

from martths_jax.figures.source import Source
from martths_jax.figures.style import (
    DOUBLE,
    Drawing,
    controller_label,
    line,
    motion_label,
    new_figure,
)
from martths_jax.plant import NOMINAL_HZ, frequency_response
from martths_jax.text import counted

FREQUENCY = np.geomspace(0.1, 100.0, 160)  # Hz
BANDS = ((5, 95, "0.86"), (25, 75, "0.70"))


def bode(source: Source) -> Drawing:
    """Magnitude and phase of the four channels: percentile bands of the plants over the nominal."""
    plants = np.asarray(source.study.dataset.plant_hz.values)[1:]
    drawn = _response(plants)  # (F, 2, 2, T)
    nominal = _response(NOMINAL_HZ[None])[..., 0]
    figure = new_figure(DOUBLE, 118)
    axes = figure.subplots(4, 4, sharex=True)
    data = {"frequency_hz": FREQUENCY}
    rows = (("magnitude_db", _magnitude, "dB"), ("phase_deg", _phase, "°"))
    for column, (i, j) in enumerate(np.ndindex(2, 2)):
        axes[0, column].set_title(f"$H_{{{i + 1}{j + 1}}}$")
        axes[-1, column].set_xlabel("frequency [Hz]")
        for k, (what, measure, unit) in enumerate(rows):
            values, middle = measure(drawn[:, i, j]), measure(nominal[:, i, j])
            name = f"H{i + 1}{j + 1}_{what}"
            absolute, relative = axes[2 * k : 2 * k + 2, column]
            _bands(absolute, values, data, name)
            _bands(relative, values - middle[:, None], data, f"{name}_from_nominal")
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


def _response(plants_hz: np.ndarray) -> np.ndarray:
    return np.asarray(frequency_response(plants_hz, FREQUENCY))


def _magnitude(response: np.ndarray) -> np.ndarray:
    return 20 * np.log10(np.abs(response))


def _phase(response: np.ndarray) -> np.ndarray:
    return np.rad2deg(np.unwrap(np.angle(response), axis=0))


def _bands(axis, values: np.ndarray, data: dict, name: str) -> None:
    for low, high, shade in BANDS:
        a, b = np.percentile(values, [low, high], axis=-1)
        axis.fill_between(FREQUENCY, a, b, color=shade, lw=0, label=f"P{low}–P{high}")
        data[f"{name}_P{low}"], data[f"{name}_P{high}"] = a, b


def delay(source: Source) -> Drawing:
    """Delay against frequency: of the drawn plants, and of the controlled strokes of one trial.

    Before compensation, both actuators commanded alike: minus the phase of the row sum H_i1 + H_i2
    over the circular frequency, and half a sample for the command's hold.  After it: minus the
    phase of the cross spectrum of target and measured stroke (Welch, 4 s windows), where the target
    has at least a ten-thousandth of its largest power density.
    """
    omega = 2 * np.pi * FREQUENCY[:, None]
    half_sample = 0.5 / source.fs

    def plant_delay(plants):
        response = np.unwrap(np.angle(_response(plants).sum(axis=2)), axis=0)  # (F, 2, T)
        return 1e3 * (half_sample - response / omega[..., None])

    drawn, nominal = (
        plant_delay(source.study.dataset.plant_hz.values[1:]),
        plant_delay(NOMINAL_HZ[None]),
    )
    figure = new_figure(DOUBLE, 72)
    axes = figure.subplots(1, 2, sharey=True)
    data: dict[str, np.ndarray] = {}
    for i, axis in enumerate(axes):
        _bands(axis, drawn[:, i], data, f"plant_{i + 1}_ms")
        axis.plot(
            FREQUENCY,
            nominal[:, i, 0],
            color="black",
            lw=1.0,
            label="nominal plant, no compensation",
        )
        data[f"plant_{i + 1}_ms_nominal"] = nominal[:, i, 0]
        for name in source.controllers:
            run = source.history(name, source.motion)
            f, late = spectral_delay(run["x_a"][:, i], run["x_m"][:, i], source.fs)
            axis.plot(
                f, late, **line(source.position(name)), label=f"with {controller_label(name)}"
            )
            data[f"{name}_{i + 1}_ms"] = np.interp(FREQUENCY, f, late, np.nan, np.nan)
        axis.axhline(0, color="0.4", lw=0.6)
        axis.set_xscale("log")
        axis.set(xlim=(0.2, 30), xlabel="frequency [Hz]", title=f"actuator {i + 1}")
    high = np.max(np.percentile(drawn, 95, axis=-1)[FREQUENCY >= 0.2])
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
