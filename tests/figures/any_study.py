"""Invented studies of any problem, in a study's own files: what shows results reads no more.

folder = invented(folder, "uniaxial", 2, ("pi-lead",))
with three_actuators(): invented(folder, "three", None, ("passthrough", "adfc"))
"""

from __future__ import annotations

import json
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import xarray as xr

from martths_jax.campaign.dataset import places, write_dataset
from martths_jax.campaign.store import FORMAT
from martths_jax.control.base import Signal
from martths_jax.indices import groups_of
from martths_jax.layout import Layout, Valves
from martths_jax.problem import PROBLEMS, Problem, find_problem
from martths_jax.problem.registry import _made
from martths_jax.rig import plants
from martths_jax.rig.dynamics import TransferMatrix
from martths_jax.rig.entries import ZerosPoles
from martths_jax.rig.model import PlantModel
from martths_jax.rig.uncertainty import Uncertainty
from martths_jax.signals import SIGNALS, in_units
from martths_jax.study.signals import choose_trials, group, stored_signal
from martths_jax.watch import Status

TRIALS, SAMPLES, MOTION = 12, 1200, "shake"
#: Coefficients of the derivatives of the targets.
ADAPTED = Signal("C_A", ("coefficient", "actuator"), "1", "coefficients")
NAMES = ("east", "west", "north")
LAYOUT = Layout(
    actuators=NAMES,
    interface=("a", "b", "c"),
    outputs=("a", "b", "c", "7", "8", "9"),
    forces=("a", "b", "c"),
    valves=Valves((0.1,) * 3, (0.0,) * 3, 5.0),
    paper="nobody",
    units=("m", "rad", "m", "m", "m", "m"),
    force_units=("N", "N m", "N"),
)


def three() -> Problem:
    """Three actuators, each pulled a little by the next one's command; two uncertain numbers."""
    lag = ZerosPoles((), ("pole", -60.0), 1.0)
    pulled = ZerosPoles((), (-30.0, -80.0), "gain")
    rows = [[lag if i == j else pulled if j == (i + 1) % 3 else None for j in range(3)]
            for i in range(3)]  # fmt: skip
    uncertain = Uncertainty(("pole", "gain"), (-9.0, 0.05), (0.1, 0.2))
    model = PlantModel(TransferMatrix(rows), uncertain)
    return Problem(
        name="three", title="three actuators benchmark", paper="nobody", layout=LAYOUT,
        parameters=uncertain.names, build=None,
        plants=lambda draws, trial, spread: plants.TransferPlants(draws, trial, model, spread),
        draw=None, check=plants.check, readings={}, stored=("plant_value", "parameters", "Hz"),
    )  # fmt: skip


@contextmanager
def three_actuators():
    """Lets ``find_problem`` know the problem of ``three``."""
    PROBLEMS["three"] = {None: three}
    try:
        yield find_problem("three")
    finally:
        del PROBLEMS["three"]
        _made.cache_clear()


def invented(
    folder: Path, name: str, case: int | None, controllers: tuple[str, ...], lost: bool = False
) -> Path:
    """Write a study: indices that spread about their number, strokes late by two samples.

    With `lost` the first controller has lost all of its trials, and its strokes are no numbers.
    """
    problem = find_problem(name, case)
    layout, rng = problem.layout, np.random.default_rng(1)
    indices = groups_of(layout)["benchmark"]
    cell, n = (len(controllers), 1, TRIALS + 1), len(layout.actuators)
    level = 1.0 + np.arange(len(indices))
    draws = rng.standard_normal((TRIALS + 1, len(problem.parameters)))
    draws[0] = 0.0
    runs = ("controller", "motion", "trial")
    status = np.full(cell, int(Status.OK), dtype=np.int32)
    value = level * (1 + 0.1 * rng.standard_normal((*cell, level.size)))
    if lost:
        value[0], status[0] = np.nan, int(Status.DIVERGED)
    dataset = xr.Dataset(
        {
            "value": ((*runs, "index"), value),
            "status": (runs, status),
            "volt_peak": ((*runs, "actuator"), np.ones((*cell, n))),
            "unit": ("index", ["ms" if i.unit == "ms" else "percent" for i in indices]),
            "draw": (("trial", "parameter"), draws),
        },
        {
            "controller": list(controllers), "motion": [MOTION],
            "trial": np.arange(TRIALS + 1, dtype=np.int32), "index": [i.name for i in indices],
            "actuator": places(layout.actuators), "parameter": list(problem.parameters),
        },
        {
            "format": FORMAT, "seed": 1, "fs": 1024.0, "trials": TRIALS, "configuration": "{}",
            "identity": json.dumps({"seed": 1, "problem": name, "case": case, "spread": 0.5}),
        },
    )  # fmt: skip
    folder.mkdir()
    write_dataset(dataset, folder / "study.nc")
    (folder / "provenance.json").write_text('{"sessions": []}')
    path = folder / "signals.nc"
    write_dataset(xr.Dataset(attrs={"format": FORMAT, "label": "-"}), path)
    write_dataset(_shared(layout), path, group(MOTION))
    for controller in controllers:
        roles = choose_trials(dataset, controller, MOTION, ())
        stored = _signals(layout, roles, adapted=controller == controllers[-1])
        if lost and controller == controllers[0]:
            stored["x_m"] = stored.x_m * np.nan
        write_dataset(stored, path, group(MOTION, controller))
    return folder


def _shared(layout: Layout) -> xr.Dataset:
    time = np.arange(SAMPLES) / 1024
    zeros = np.zeros((SAMPLES, len(layout.outputs)))
    variables = {"ground": ("time", np.sin(9 * time)), "reference": (("time", "dof"), zeros)}
    return xr.Dataset(variables, {"time": time})


def _signals(layout: Layout, roles: dict[int, str], adapted: bool) -> xr.Dataset:
    time, kept, n = np.arange(SAMPLES) / 1024, len(roles), len(layout.actuators)

    def waves(columns: int, late: int = 0, size: float = 1.0) -> np.ndarray:
        t = time[None, :, None] - late / 1024
        number = 1 + np.arange(columns) + 0.1 * np.arange(kept)[:, None, None]
        return size * number * (np.sin(15 * t) + 0.4 * np.sin(31 * t))

    arrays = {
        "x_a": waves(n), "x_m": waves(n, 2), "x_hat": waves(n, 2), "u": waves(n),
        "num": waves(len(layout.outputs), size=1e-3), "est": waves(len(layout.interface), 2, 1e-3),
        "force": waves(len(layout.forces), size=100.0),
    }  # fmt: skip
    told = {s.name: in_units(s, layout) for s in SIGNALS} | {"C_A": ADAPTED}
    if adapted:
        numbers = 10 * np.arange(4 * n)[:, None] + np.arange(n)
        arrays["C_A"] = np.broadcast_to(numbers, (kept, SAMPLES, 4 * n, n)).astype(float)
    variables = {name: stored_signal(told[name], name, a) for name, a in arrays.items()}
    variables["role"] = ("kept", np.array(list(roles.values())))
    variables["trial"] = ("kept", np.array(list(roles), dtype=np.int32))
    return xr.Dataset(variables)
