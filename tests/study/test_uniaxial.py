"""The uniaxial benchmark through every command: one actuator, its own indices and controller."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from scipy.io import loadmat
from typer.testing import CliRunner

from martths_jax import InputError, build_benchmark
from martths_jax.campaign.store import RunFolder
from martths_jax.cli import app
from martths_jax.nominal import compare_with_table4
from martths_jax.problem import find_problem
from martths_jax.sensitivity import open_sensitivity
from martths_jax.study import open_study
from martths_jax.sweep import open_sweep
from martths_jax.sweep.config import make_sweep
from martths_jax.tune.objective import Objective
from martths_jax.tune.search import Options
from tests.engine.motions import burst

ASKED = ["--problem", "uniaxial", "--case", "3", "--units", "m/s2"]
INDICES = [f"J{i}" for i in range(1, 10)]


def command(*words):
    done = CliRunner().invoke(app, list(map(str, words)))
    assert done.exit_code == 0, (done.output, done.exception)
    return " ".join(done.output.split())


@pytest.fixture(scope="module")
def shake(tmp_path_factory):
    """A burst of ground acceleration as a file."""
    motion, path = burst(0.2), tmp_path_factory.mktemp("motion") / "shake.csv"
    time = np.arange(motion.acceleration.size) / 1024
    np.savetxt(path, np.c_[time, motion.acceleration], delimiter=",")
    return path


@pytest.fixture(scope="module")
def study(shake, tmp_path_factory):
    """Three trials, then five in the same folder."""
    out = tmp_path_factory.mktemp("uniaxial") / "study"
    words = ["study", *ASKED, "--motion", shake, "--out", out, "--devices", 1]
    command(*words, "--trials", 3)
    first = RunFolder.open(out).read("pi-lead", "shake")
    command(*words, "--trials", 5)
    return out, first


@pytest.mark.slow
def test_a_study_goes_on_and_shows_its_own_table(study):
    out, first = study
    done = open_study(out)
    assert [done.dataset.sizes[d] for d in ("trial", "index", "actuator")] == [6, 9, 1]
    kept = done.dataset.value.sel(controller="pi-lead", motion="shake").values
    assert np.array_equal(kept[:4], first.value) and np.isfinite(kept).all()
    text = (out / "summary.md").read_text()
    assert "case 3" in text.splitlines()[0] and "Table 4" not in text
    assert "| J4 | 49.90 |" in text
    signals = done.signals("shake", "pi-lead")
    assert signals.force.attrs["units"] == "N" and signals.num.attrs["units"] == "m"
    assert done.signals("shake").reference.attrs["units"] == "m"
    assert "uniaxial" in done.dataset.attrs["title"]


@pytest.mark.slow
def test_a_run_of_a_trial_is_the_study_s(study, shake, tmp_path):
    out, _ = study
    words = ["run", *ASKED, "--motion", shake, "--trial", 2, "--seed", 1, "--matlab"]
    assert "J1 in ms" in command(*words, "--out", tmp_path)
    with (tmp_path / "shake_pi-lead_indices.csv").open() as file:
        found = {row["index"]: float(row["value"]) for row in csv.DictReader(file)}
    stored = open_study(out).dataset.value.sel(controller="pi-lead", motion="shake", trial=2)
    assert list(found) == INDICES
    np.testing.assert_allclose(list(found.values()), stored.values, rtol=1e-9)
    about = json.loads((tmp_path / "shake_pi-lead_run.json").read_text())
    assert (about["problem"], about["case"], about["fs"]) == ("uniaxial", 3, 4096.0)
    assert loadmat(tmp_path / "shake_pi-lead.mat")["x_m"].shape[1] == 1


@pytest.mark.slow
def test_exports_and_the_page(study, tmp_path):
    out, _ = study
    files = {kind: tmp_path / f"a.{kind}" for kind in ("mat", "csv", "plants")}
    command("export", out, *(word for kind, file in files.items() for word in (f"--{kind}", file)))
    done = open_study(out)
    back = loadmat(files["mat"], simplify_cells=True)
    assert np.array_equal(np.squeeze(back["value"]), np.squeeze(done.dataset.value))
    assert np.asarray(back["signals"]["num"]).shape[-1] == 3
    with files["csv"].open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6 and float(rows[0]["J3"]) == float(done.dataset.value[0, 0, 0, 2])
    assert (
        files["plants"]
        .read_text()
        .splitlines()[0]
        .startswith("trial,a3_draw,b1_draw,b2_draw,k_e_draw")
    )
    page = command("report", out, "--only", "frame", "--out", tmp_path / "r.html")
    assert "Wrote" in page


@pytest.mark.slow
def test_a_sweep_moves_the_controller_s_own_numbers(shake, tmp_path):
    axes = ["--axis", "proportional=1,2", "--axis", "spread=0.5,1"]
    told = command("sweep", *ASKED, *axes, "--motion", shake, "--trials", 2, "--out", tmp_path,
                   "--devices", 1)  # fmt: skip
    assert "Results are in" in told
    assert "| J1 | J2 | J3 | J4 | J5 |" in (tmp_path / "summary.md").read_text()
    error = open_sweep(tmp_path).dataset.value.sel(controller="pi-lead", motion="shake", trial=0)
    error = error.sel(index="J2").values
    assert (error[0] > 1.2 * error[1]).all(), "half the gain, more error"
    assert np.array_equal(error[:, 0], error[:, 1]), "the nominal plant has no spread"
    assert (tmp_path / "figures" / "map_spread_proportional_pi-lead_shake.png").is_file() or (
        tmp_path / "figures" / "map_proportional_spread_pi-lead_shake.png"
    ).is_file()


@pytest.mark.slow
def test_a_sensitivity_analysis_has_the_plant_s_factors(shake, tmp_path):
    command("sensitivity", *ASKED, "--motion", shake, "--trials", 2, "--out", tmp_path,
            "--devices", 1)  # fmt: skip
    found = open_sensitivity(tmp_path)
    assert list(found.dataset.factor.values) == ["a3", "b1", "b2", "k_e", "noise"]
    assert (tmp_path / "figures" / "tornado_pi-lead.csv").is_file()


@pytest.mark.slow
def test_the_sample_controller_is_tuned(shake, tmp_path):
    other = tmp_path / "other.csv"
    other.write_bytes(shake.read_bytes())
    words = ["--objective", "j2+J1text", "--free", "proportional", "--steps", 2, "--trials", 2]
    told = command("tune", *ASKED, *words, "--motion", shake, "--check-motion", other,
                   "--check-trials", 2, "--out", tmp_path / "out", "--devices", 1)  # fmt: skip
    assert "Table 3 (nominal" in told
    history = json.loads((tmp_path / "out" / "state.json").read_text())["history"]
    assert history[1]["objective"] < history[0]["objective"]
    with (tmp_path / "out" / "comparison.csv").open() as file:
        rows = {row["index"]: row for row in csv.DictReader(file)}
    assert list(rows)[:9] == INDICES and rows["J4"]["published"] == "49.9"


def test_tables_of_the_marths_benchmark_refuse_it():
    for words, what in ((["table4"], "Table 4 is of the maRTHS"), (["modes"], "Table 1 is of")):
        done = CliRunner().invoke(app, [*words, "--problem", "uniaxial", "--case", "2"])
        assert isinstance(done.exception, InputError) and what in str(done.exception)
        assert "case 2" in str(done.exception)
    benchmark = find_problem("uniaxial", 1).build()
    with pytest.raises(InputError, match="`benchmark` must be the maRTHS benchmark"):
        compare_with_table4(benchmark, [burst()])


def test_objectives_and_their_volts_are_the_problem_s():
    layout = find_problem("uniaxial", 1).layout
    objective = Objective.parse("J4 + 2*j1text", layout=layout)
    assert objective.names == ("J4", "J1text") and objective.volt_limit == 3.8
    assert [i.name for i in objective.smooth] == ["J4", "J1text"]
    with pytest.raises(InputError, match="the indices J1, J2"):
        Objective.parse("J2_1", layout=layout)
    objective, _ = Options("pi-lead", "j3", volts=1.5).check(layout)
    assert objective.volt_limit == 1.5
    assert Options("lqg", "j2").check()[0].volt_limit == build_benchmark().layout.valves.limit


def test_a_sweep_and_a_tuning_take_the_problem_s_own_controller():
    sweep = make_sweep({"proportional": (1, 2)}, problem="uniaxial", trials=2)
    assert sweep.study.controllers == ("pi-lead",) and sweep.study.fs == 4096
    assert sweep.shown == ("J1", "J2", "J3", "J4", "J5")
    assert make_sweep({"nb": (64, 128)}, trials=2).study.controllers == ("adfc",)
