"""One small study with invented numbers, in the study's own files, for figures, tables and pages.

Running one takes a minute of compiling; what is tested here reads files only.  The numbers are
smooth, so that a test can work out what must be drawn.
"""

from __future__ import annotations

import shutil
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from martths_jax import ADFC, Motion
from martths_jax.campaign.dataset import read_dataset, write_dataset
from martths_jax.campaign.engine import Outcome
from martths_jax.campaign.plan import build_plan
from martths_jax.campaign.session import header
from martths_jax.campaign.store import FORMAT, RunFolder
from martths_jax.indices import DELAYS, NAMES
from martths_jax.signals import SIGNALS
from martths_jax.study import make_config
from martths_jax.study.runner import write_results
from martths_jax.study.signals import choose_trials, group, stored_signal
from martths_jax.watch import Status
from tests.engine.motions import burst

TRIALS = 30
#: A trial of LQG on the first motion that is stored as diverged.
LOST = 7
SAMPLES = 1500
#: The second name would end a page's data, or its table of LaTeX, if it were taken for markup.
MOTIONS = ("elcentro-like", "short & <!--<script><quick>")


@cache
def build(parent: Path) -> Path:
    """Write the study into a folder under `parent`."""
    motions = [Motion(name, burst(0.3).acceleration, 1024.0) for name in MOTIONS]
    plan = build_plan(make_config(trials=TRIALS, seed=1, motions=motions, out=str(parent / "run")))
    run = RunFolder.start(parent / "run", header(plan, "martths study"))
    trials = np.arange(TRIALS + 1)
    for i, (controller, motion) in enumerate(run.cells):
        run.write(controller, motion, trials, outcome(i))
    dataset = write_results(run).dataset
    run.close()
    path = run.path / "signals.nc"
    write_dataset(xr.Dataset(attrs={"format": FORMAT, "label": "-"}), path)
    for motion in MOTIONS:
        write_dataset(shared(), path, group(motion))
        for controller in plan.controllers:
            roles = choose_trials(dataset, controller, motion, ())
            write_dataset(signals(roles, controller), path, group(motion, controller))
    return run.path


def outcome(cell: int) -> Outcome:
    """Indices that spread about a level of their own in every cell."""
    rng = np.random.default_rng(cell)
    level = np.array([1.0 if n in DELAYS else 5.0 + i for i, n in enumerate(NAMES)])
    value = level * (2.0 - 0.8 * (cell % 2)) * (1 + 0.1 * rng.standard_normal((TRIALS + 1, 24)))
    status = np.full(TRIALS + 1, int(Status.OK), dtype=np.int32)
    if cell == 0:
        value[LOST], status[LOST] = np.nan, int(Status.DIVERGED)
    arrays = {
        "value": value,
        "status": status,
        "first": np.full((TRIALS + 1, 4, 2), np.nan),
        "volt_peak": np.ones((TRIALS + 1, 2)),
        "counts": {"held": np.zeros(TRIALS + 1, dtype=np.int32)},
    }
    return Outcome(**arrays, names=NAMES)


def shared() -> xr.Dataset:
    """Time, ground acceleration and reference response of a motion."""
    time = np.arange(SAMPLES) / 1024
    return xr.Dataset(
        {
            "ground": ("time", np.sin(9 * time)),
            "reference": (("time", "dof"), np.zeros((SAMPLES, 6))),
        },
        {"time": time},
    )


def signals(roles: dict[int, str], controller: str) -> xr.Dataset:
    """Strokes that lag by 4 samples (LQG) or 1 (ADFC), and coefficients that tell themselves."""
    time = np.arange(SAMPLES) / 1024
    lag = {"lqg": 4, "adfc": 1}[controller] / 1024
    kept = len(roles)

    def waves(columns: int, late: float = 0.0, size: float = 1.0) -> np.ndarray:
        t = time[None, :, None] - late
        number = 1 + np.arange(columns) + 0.1 * np.arange(kept)[:, None, None]
        return size * number * (np.sin(15 * t) + 0.4 * np.sin(31 * t))

    arrays = {
        "x_a": waves(2), "x_m": waves(2, lag), "x_hat": waves(2, lag), "u": waves(2),
        "num": waves(6, size=1e-3), "est": waves(2, lag, 1e-3), "force": waves(3, size=100.0),
    }  # fmt: skip
    if controller == "adfc":
        numbers = 10 * np.arange(8)[:, None] + np.arange(2)
        arrays["C_A"] = np.broadcast_to(numbers, (kept, SAMPLES, 8, 2)).astype(float)
    told = {signal.name: signal for signal in (*SIGNALS, *ADFC.signals)}
    variables = {name: stored_signal(told[name], name, a) for name, a in arrays.items()}
    variables["role"] = ("kept", np.array(list(roles.values())))
    variables["trial"] = ("kept", np.array(list(roles), dtype=np.int32))
    return xr.Dataset(variables)


def enlarge(folder: Path, out: Path, trials: int) -> Path:
    """A study of more trials from the small one: its trials again and again, with other values."""
    dataset = read_dataset(folder / "study.nc")
    number = np.arange(trials + 1)
    large = dataset.isel(trial=number % dataset.sizes["trial"])
    large = large.assign_coords(trial=number.astype(np.int32))
    large["value"] = large.value * xr.DataArray(1 + 1e-4 * number, dims="trial")
    large.attrs["trials"] = trials
    out.mkdir()
    write_dataset(large, out / "study.nc")
    shutil.copy(folder / "signals.nc", out / "signals.nc")
    return out


@pytest.fixture(scope="session")
def study_folder(tmp_path_factory) -> Path:
    """Folder of the study, with signals."""
    return build(tmp_path_factory.getbasetemp() / "small_study")
