"""What the page's script works on: all trials' indices, and the kept trials' histories.

Histories travel as 16-bit integers with a scale, in base64: a step of 1/65534 of a signal's range,
which is less than a line's width on any screen, at a seventh of the size of decimal numbers.
"""

from __future__ import annotations

import base64

import numpy as np

from martths_jax.indices import NAMES
from martths_jax.report.tables import unit_of
from martths_jax.study import Study
from martths_jax.watch import Status

#: Room for all histories in the file [bytes of base64].
ROOM = 12_000_000
#: Coefficients change slowly: every so manieth of the samples kept of the other signals.
SLOWER = 4
STEPS = 32767


def trial_payload(study: Study) -> dict:
    """Indices of all runs, column by column, six digits each; None where a trial diverged."""
    dataset = study.dataset
    cells = []
    for controller in map(str, dataset.controller.values):
        for motion in map(str, dataset.motion.values):
            cell = dataset.sel(controller=controller, motion=motion)
            cells.append({
                "controller": controller,
                "motion": motion,
                "status": cell.status.values.tolist(),
                "values": [_rounded(cell.value.values[:, i]) for i in range(len(NAMES))],
            })  # fmt: skip
    return {
        "indices": [{"name": n, "unit": unit_of(n)} for n in NAMES],
        "status": {int(s): s.name.lower() for s in Status},
        "trials": int(dataset.sizes["trial"]),
        "cells": cells,
    }


def _rounded(values: np.ndarray) -> list:
    return [float(f"{x:.6g}") if np.isfinite(x) else None for x in values.tolist()]


def history_payload(study: Study, room: int = ROOM) -> list[dict]:
    """Histories of the kept trials, thinned so that all of them fit into `room` bytes.

    Returns:
        one mapping a controller, motion and kept trial: ``dt`` [s], and ``signals`` with ``name``,
        ``panel``, ``stride`` and the encoded values.
    """
    if not (study.folder / "signals.nc").is_file():
        return []
    cells = [
        (str(c), str(m), study.signals(str(m), str(c)))
        for m in study.dataset.motion.values
        for c in study.dataset.controller.values
    ]
    full = sum(
        stored.sizes["time"] * 2 * 4 / 3 * _weight(stored) * stored.sizes["kept"]
        for _, _, stored in cells
    )
    stride = max(1, int(np.ceil(full / room)))
    fs = float(np.ravel(study.dataset.attrs["fs"])[0])
    return [
        {
            "controller": controller,
            "motion": motion,
            "trial": int(stored.trial.values[k]),
            "role": str(stored.role.values[k]),
            "dt": 1 / fs,
            "samples": int(stored.sizes["time"]),
            "signals": list(_signals(stored.isel(kept=k), stride)),
        }
        for controller, motion, stored in cells
        for k in range(stored.sizes["kept"])
    ]


def _weight(stored) -> float:
    """Signals of a trial, in units of one that is not thinned further."""
    slow = stored["C_A"].shape[2] * stored["C_A"].shape[3] / SLOWER if "C_A" in stored else 0
    return 2 + 2 + stored["force"].shape[-1] + slow


def _signals(run, stride: int):
    target, measured = run["x_a"].values, run["x_m"].values
    force = run["force"].values
    fast = [
        *((f"target {i + 1}", "stroke [mm]", target[:, i]) for i in (0, 1)),
        *((f"error {i + 1}", "error [mm]", (measured - target)[:, i]) for i in (0, 1)),
        ("storey force", "force [kN]", force[:, 0] / 1e3),
        *((f"moment, node {node}", "moment [N m]", force[:, i]) for i, node in ((1, 4), (2, 7))),
    ]
    for name, panel, values in fast:
        yield _encoded(name, panel, values, stride)
    if "C_A" in run:
        coefficients = run["C_A"].values
        for actuator in (0, 1):
            for j in range(coefficients.shape[1]):
                name = f"u{actuator + 1}: x{j // 4 + 1}{chr(39) * (j % 4)}"
                yield _encoded(
                    name, "coefficient [–]", coefficients[:, j, actuator], SLOWER * stride
                )


def _encoded(name: str, panel: str, values: np.ndarray, stride: int) -> dict:
    values = values[::stride]
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    middle, scale = (low + high) / 2, (high - low) / 2 / STEPS or 1.0
    steps = np.where(np.isfinite(values), np.round((values - middle) / scale), -STEPS - 1)
    data = base64.b64encode(steps.astype("<i2").tobytes()).decode()
    return {"name": name, "panel": panel, "stride": stride, "middle": middle, "scale": scale,
            "data": data}  # fmt: skip
