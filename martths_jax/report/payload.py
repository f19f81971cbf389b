"""What the page's script works on: all trials' indices, and the kept trials' histories.

Histories travel as 16-bit integers with a scale, in base64: a step of 1/65534 of a signal's range,
which is less than a line's width on any screen, at a seventh of the size of decimal numbers.
"""

from __future__ import annotations

import base64
from typing import NamedTuple

import numpy as np
import xarray as xr

from martths_jax.campaign.dataset import index_names, unit_of
from martths_jax.layout import Layout
from martths_jax.signals import SIGNALS
from martths_jax.study import Study
from martths_jax.watch import Status

#: Runs in the table of all trials, at most; of a larger study it holds a sample of the trials.
RUNS = 12_000
#: What only one controller gives, such as coefficients, changes slowly: every so manieth of the
#: samples kept of the other signals.
SLOWER = 4
STEPS = 32767
#: Forces as the page shows them: unit -> panel, size of its unit.
FORCES = {"N": ("force [kN]", 1e3), "N m": ("moment [N m]", 1.0)}
#: What goes with a signal beside its values [bytes].
HEAD = 150


class Kept(NamedTuple):
    """Stored signals of a controller on a motion, (kept, time, ...)."""

    controller: str
    motion: str
    stored: xr.Dataset


def kept_signals(study: Study) -> list[Kept]:
    """All stored signals of a study; none if it has not kept any."""
    if not (study.folder / "signals.nc").is_file():
        return []
    return [
        Kept(str(c), str(m), study.signals(str(m), str(c)))
        for m in study.dataset.motion.values
        for c in study.dataset.controller.values
    ]


def chosen_trials(study: Study, kept: list[Kept], runs: int = RUNS) -> np.ndarray:
    """Numbers of the trials in the table, ascending: all, or a sample of at most `runs` runs.

    Always there are the nominal plant and the kept trials.  Of the rest at most a quarter are
    trials that some run lost, if there are any, and the others are drawn from all; which ones
    depends on the study's seed alone.
    """
    dataset = study.dataset
    trials = int(dataset.sizes["trial"])
    room = max(1, runs // (dataset.sizes["controller"] * dataset.sizes["motion"]))
    if trials <= room:
        return np.arange(trials)
    order = np.random.default_rng(int(np.ravel(dataset.attrs["seed"])[0])).permutation(trials)
    always = np.unique([0, *(int(t) for cell in kept for t in cell.stored.trial.values)])
    lost = np.any(dataset.status.values >= Status.DIVERGED, axis=(0, 1))
    some_lost = order[lost[order]][: room // 4]
    wanted = np.concatenate([always, some_lost, order])
    _, first = np.unique(wanted, return_index=True)
    return np.sort(wanted[np.sort(first)][: max(room, always.size)])


def trial_payload(study: Study, trials: np.ndarray) -> dict:
    """Indices of the runs of some trials, column by column, six digits each; None if diverged."""
    dataset = study.dataset
    cells = []
    for controller in map(str, dataset.controller.values):
        for motion in map(str, dataset.motion.values):
            cell = dataset.sel(controller=controller, motion=motion).isel(trial=trials)
            cells.append({
                "controller": controller,
                "motion": motion,
                "status": cell.status.values.tolist(),
                "values": [_rounded(cell.value.values[:, i]) for i in range(cell.value.shape[1])],
            })  # fmt: skip
    return {
        "indices": [{"name": n, "unit": unit_of(dataset, n)} for n in index_names(dataset)],
        "status": {int(s): s.name.lower() for s in Status},
        "trials": trials.tolist(),
        "cells": cells,
    }


def _rounded(values: np.ndarray) -> list:
    return [float(f"{x:.6g}") if np.isfinite(x) else None for x in values.tolist()]


def history_payload(kept: list[Kept], fs: float, room: int, layout: Layout) -> list[dict]:
    """Histories of the kept trials, thinned so that all of them fit into `room` bytes.

    Args:
        kept: see ``kept_signals``.
        fs: sampling rate [Hz].
        room: for all histories in the file [bytes of base64].
        layout: of the problem.

    Returns:
        one mapping a controller, motion and kept trial: ``dt`` [s], and ``signals`` with ``name``,
        ``panel``, ``stride`` and the encoded values.
    """
    full = sum(
        stored.sizes["time"] * 2 * 4 / 3 * _weight(stored) * stored.sizes["kept"]
        for _, _, stored in kept
    )
    plain = 2 * len(layout.actuators) + len(layout.forces)
    names = sum(
        (plain + _coefficients(stored)) * HEAD * stored.sizes["kept"] for _, _, stored in kept
    )
    stride = max(1, int(np.ceil(full / max(room - names, room / 4))))
    return [
        {
            "controller": controller,
            "motion": motion,
            "trial": int(stored.trial.values[k]),
            "role": str(stored.role.values[k]),
            "dt": 1 / fs,
            "samples": int(stored.sizes["time"]),
            "signals": list(_signals(stored.isel(kept=k), stride, layout)),
        }
        for controller, motion, stored in kept
        for k in range(stored.sizes["kept"])
    ]


def _weight(stored) -> float:
    """Signals of a trial, in units of one that is not thinned further."""
    plain = 2 * stored["x_a"].shape[-1] + stored["force"].shape[-1]
    return plain + _coefficients(stored) / SLOWER


def _own(stored) -> list[str]:
    """Names of the signals that only this controller gives."""
    shared = {signal.name for signal in SIGNALS}
    return [
        str(name) for name, v in stored.data_vars.items()
        if "time" in v.dims and name not in shared and "count" not in v.attrs
    ]  # fmt: skip


def _coefficients(stored) -> int:
    """Number of the histories that only this controller has."""
    return sum(int(np.prod(stored[name].shape[2:])) for name in _own(stored))


def _signals(run, stride: int, layout: Layout):
    target, measured = run["x_a"].values, run["x_m"].values
    force = run["force"].values
    called = list(enumerate(layout.actuators))
    fast = [
        *((f"target {name}", "stroke [mm]", target[:, i]) for i, name in called),
        *((f"error {name}", "error [mm]", (measured - target)[:, i]) for i, name in called),
    ]
    for i, (name, unit) in enumerate(zip(layout.load_labels, layout.load_units, strict=True)):
        panel, size = FORCES.get(unit, (f"force [{unit}]", 1.0))
        fast.append((name, panel, force[:, i] / size))
    for name, panel, values in fast:
        yield _encoded(name, panel, values, stride)
    for name in _own(run):
        attrs, values = run[name].attrs, run[name].values
        values = values.reshape(len(values), -1)
        told = sorted(
            zip(str(attrs.get("elements", "")).split("; "), values.T, strict=False),
            key=lambda line: line[0],
        )
        if len(told) != values.shape[1]:
            tails = [f" {i + 1}" for i in range(values.shape[1])] if values.shape[1] > 1 else [""]
            told = [(name + tail, x) for tail, x in zip(tails, values.T, strict=True)]
        unit, dims = str(attrs.get("units", "")), run[name].dims[1:]
        panel = f"{dims[0] if dims else name} [{'–' if unit == '1' else unit}]" if unit else name
        for line, history in told:
            yield _encoded(line, panel, history, SLOWER * stride)


def _encoded(name: str, panel: str, values: np.ndarray, stride: int) -> dict:
    values = values[::stride]
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    middle, scale = (low + high) / 2, (high - low) / 2 / STEPS or 1.0
    steps = np.where(np.isfinite(values), np.round((values - middle) / scale), -STEPS - 1)
    data = base64.b64encode(steps.astype("<i2").tobytes()).decode()
    return {"name": name, "panel": panel, "stride": stride, "middle": middle, "scale": scale,
            "data": data}  # fmt: skip
