"""Signals of chosen trials: the nominal one, the median, the worst, and those asked for.

All of a default study's signals would take gigabytes, so the chosen trials are run again (to the
same bits) and stored in ``signals.nc``: a group ``/motion/controller`` each, with the dimensions
(kept, time, ...) and the variables of ``simulation.Result.signals``; in ``/motion`` time, ground
acceleration and the response of the reference structure.
"""

from __future__ import annotations

import hashlib
import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import xarray as xr

from martths_jax.campaign.dataset import index_names, places, read_dataset, write_dataset
from martths_jax.campaign.engine import Engine
from martths_jax.campaign.files import writing
from martths_jax.campaign.store import FORMAT
from martths_jax.control.base import Signal
from martths_jax.errors import InputError
from martths_jax.files import safe_name
from martths_jax.signals import REFERENCE, declared, in_units
from martths_jax.simulation import FEW
from martths_jax.watch import Status

#: The index that ranks trials; the first one of a study that has it not.
RANKED_BY = "J2_1"


def choose_trials(dataset: xr.Dataset, controller: str, motion: str, keep) -> dict[int, str]:
    """Trials whose signals are stored, and in what role.

    Median and worst are by the magnitude of ``RANKED_BY`` among the uncertain trials that finished;
    the first that diverged, if any, is stored as ``failed``.
    """
    cell = dataset.sel(controller=controller, motion=motion)
    names = index_names(dataset)
    by = names.index(RANKED_BY) if RANKED_BY in names else 0
    score = np.abs(cell.value.values[1:, by])
    roles: dict[int, list[str]] = {0: ["nominal"]}
    finished = np.flatnonzero(np.isfinite(score))
    if finished.size:
        order = finished[np.argsort(score[finished], kind="stable")]
        roles.setdefault(int(order[(order.size - 1) // 2]) + 1, []).append("median")
        roles.setdefault(int(order[-1]) + 1, []).append("worst")
    failed = np.flatnonzero(cell.status.values[1:] >= Status.DIVERGED)
    if failed.size:
        roles.setdefault(int(failed[0]) + 1, []).append("failed")
    for trial in keep:
        roles.setdefault(int(trial), []).append("kept")
    return {trial: "+".join(names) for trial, names in roles.items()}


def store_signals(engine: Engine, dataset: xr.Dataset, path: Path, keep, identity: str) -> None:
    """Run the chosen trials again and write their signals, whole or not at all.

    Args:
        engine: of the study; dataset: its results.
        path: the file; keep: trials that are stored beside the chosen ones.
        identity: digest of what decides the study's numbers.

    Raises:
        InputError: if the disk refuses.
    """
    chosen = {
        (c, m): choose_trials(dataset, c, m, keep)
        for m in dataset.motion.values
        for c in dataset.controller.values
    }
    asked = json.dumps([identity, [[*k, v] for k, v in chosen.items()]])
    label = hashlib.sha256(asked.encode()).hexdigest()
    if path.exists() and _is_whole(path, label, chosen):
        return
    for cell in chosen:
        engine.setup(*cell)  # before the threads start
    about = {k: dataset.attrs[k] for k in ("version_martths_jax", "git_commit", "seed")}
    devices = engine.devices
    with writing(path) as temporary:
        write_dataset(xr.Dataset(attrs=about | {"format": FORMAT, "label": label}), temporary)
        for motion in dataset.motion.values:
            write_dataset(_shared(engine, motion), temporary, group=group(motion))
        # A controller keeps to its device, whose program it compiles; written in order, so that the
        # file is reproducible.
        controllers = list(dataset.controller.values)
        pools = [ThreadPoolExecutor(1) for _ in devices]
        place = {c: i % len(devices) for i, c in enumerate(controllers)}
        runs = {
            cell: pools[place[cell[0]]].submit(_run, engine, *cell, roles, devices[place[cell[0]]])
            for cell, roles in chosen.items()
        }
        try:
            for (controller, motion), run in runs.items():
                write_dataset(run.result(), temporary, group=group(motion, controller))
        finally:
            for pool in pools:
                pool.shutdown(cancel_futures=True)


def group(motion: str, controller: str | None = None) -> str:
    """Name of the group that holds the signals of a motion, or of a controller on it."""
    return "/" + "/".join(safe_name(n) for n in (motion, controller) if n is not None)


def _is_whole(path: Path, label: str, chosen) -> bool:
    """Whether a file holds the signals that were asked for, and every bit of them is right."""
    motions = {m for _, m in chosen}
    try:
        if read_dataset(path).attrs.get("label") != label:
            return False
        for name in [*(group(m) for m in motions), *(group(m, c) for c, m in chosen)]:
            read_dataset(path, name)
    except InputError:  # another version's or a damaged file: written anew
        return False
    return True


def _shared(engine: Engine, motion: str) -> xr.Dataset:
    setup = next(s for (_, m), s in engine.setups.items() if m == motion)
    ground, layout = np.asarray(setup.ground), engine.plan.problem.layout
    response = in_units(REFERENCE, layout)
    return xr.Dataset(
        {
            "ground": ("time", ground, {"units": "m s-2", "long_name": "ground acceleration"}),
            "reference": (("time", *response.dims), np.asarray(setup.reference), {
                "units": response.unit, "long_name": response.label}),
        },
        {
            "time": ("time", np.arange(ground.size) / engine.plan.benchmark.fs, {"units": "s"}),
            "dof": places(layout.outputs),
        },
    )  # fmt: skip


def stored_signal(signal: Signal | None, name: str, values: np.ndarray) -> tuple:
    """A variable of (kept, time, ...) values, with what is declared of the signal, if anything."""
    if signal is None:
        dims = tuple(f"{name}_{i}" for i in range(values.ndim - 2))
        return ("kept", "time", *dims), values, {"long_name": name}
    attrs = {"units": signal.unit, "long_name": signal.label or name}
    if signal.elements:
        attrs["elements"] = "; ".join(signal.elements)
    if signal.count:
        attrs["count"] = "what it counted by then"
    return ("kept", "time", *signal.dims), values, attrs


def _run(engine: Engine, controller: str, motion: str, roles: dict, device) -> xr.Dataset:
    trials = np.array(list(roles))
    batches = [
        engine.signals(controller, motion, trials[i : i + FEW], device)
        for i in range(0, trials.size, FEW)
    ]
    layout = engine.plan.problem.layout
    variables, told = {}, declared(engine.setup(controller, motion).controller, layout)
    for name in batches[0]:
        values = np.concatenate([np.asarray(b[name]) for b in batches])
        variables[name] = stored_signal(told.get(name), name, values)
    variables["role"] = ("kept", np.array(list(roles.values())))
    variables["trial"] = ("kept", trials.astype(np.int32))
    return xr.Dataset(variables)
