"""The sensitivity analysis end to end, on passthrough and short motions."""

import csv

import numpy as np
import pytest
from scipy.io import loadmat
from typer.testing import CliRunner

from martths_jax import InputError, Passthrough, SensorNoise, build_benchmark, indices, simulate
from martths_jax.campaign.config import make_config
from martths_jax.cli import app
from martths_jax.indices import NAMES
from martths_jax.plant import PARAMETERS
from martths_jax.report.beside import open_beside
from martths_jax.sensitivity import open_sensitivity, run_sensitivity, sobol
from martths_jax.sensitivity.design import make_design
from tests.study.places import short_motion
from tests.sweep.test_sweep import Stop

MOTIONS = (short_motion("one"), short_motion("two", 1.0))


def analysis(out, **changes):
    """32 base samples, 13 rows each, which fill blocks of two motions."""
    settings = {
        "trials": 32, "controllers": ("passthrough",), "motions": MOTIONS, "out": str(out),
        "devices": 1,
    }  # fmt: skip
    return run_sensitivity(settings, shown=("J2_1", "J1_1"), **changes)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return analysis(tmp_path_factory.mktemp("whole"))


def files(folder) -> dict[str, bytes]:
    names = ("sensitivity.nc", "sensitivity.csv", "summary.md")
    return {n: (folder / n).read_bytes() for n in names}


def test_a_row_is_what_simulate_gives(whole):
    """Plant, noise realisation and motion of a row are those the design says."""
    design = make_design(32, motions=2, seed=1)
    assert np.array_equal(whole.dataset.point, design.unit)
    picked, streams = design.motions(2), design.streams()
    rows = np.flatnonzero(picked == 1)[[0, 7, -1]]
    plants = design.plants(rows, 1.0)
    plants = type(plants)(plants.draws, streams[rows], 1.0)
    result = simulate(build_benchmark(), Passthrough(), plants, MOTIONS[1], SensorNoise(seed=1))
    values = whole.dataset.value.values.reshape(-1, 24)[rows]
    for i, name in enumerate(NAMES):
        assert np.array_equal(values[:, i], indices(result)[name])


def test_indices_of_the_file_are_those_of_its_runs(whole):
    found = sobol(whole.dataset.value.values[0], seed=1)
    assert np.array_equal(whole.dataset.total.values[0], found.total, equal_nan=True)
    assert np.array_equal(whole.dataset.first_low.values[0], found.first_low, equal_nan=True)
    total = whole.dataset.total.sel(controller="passthrough")
    # Physics: column 1 of the plant moves actuator 1, and the two zeros of H12 and H22 do not.
    assert total.sel(index="J2_1", factor="pole1_col1") > 0.1
    assert total.sel(index="J2_1", factor="zero_h22") < 0.05
    assert list(whole.dataset.factor.values) == [*PARAMETERS, "noise", "motion"]


def test_interrupted_repeated_and_extended(whole, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        analysis(tmp_path, trials=16, reporter=Stop(after=2), figures=False)
    analysis(tmp_path, trials=16, figures=False)
    again = Stop()
    analysis(tmp_path, reporter=again, figures=False)
    assert again.before == 16 * 13, "a sequence twice as long begins with the shorter one"
    assert np.array_equal(open_sensitivity(tmp_path).dataset.value, whole.dataset.value)
    first, second = files(tmp_path), files(whole.folder)
    assert first["sensitivity.csv"] == second["sensitivity.csv"]
    with pytest.raises(InputError, match=r"N = 32 base samples, but 8"):
        analysis(tmp_path, trials=8)
    with pytest.raises(InputError, match=r"seed: 1 in the folder, 2 asked for"):
        analysis(tmp_path, seed=2)


def test_tornado_and_table_hold_the_same_numbers(whole):
    assert (whole.folder / "figures" / "tornado_passthrough.pdf").exists()
    with (whole.folder / "figures" / "tornado_passthrough.csv").open() as file:
        rows = [r for r in csv.DictReader(file) if r["index"] == "J2_1"]
    totals = [float(r["total"]) for r in rows]
    assert len(rows) == 11 and totals == sorted(totals, reverse=True)
    with (whole.folder / "sensitivity.csv").open() as file:
        table = {(r["index"], r["factor"]): r for r in csv.DictReader(file)}
    assert len(table) == 24 * 11
    for row in rows:
        there = table["J2_1", row["factor"]]
        assert float(row["total"]) == pytest.approx(float(there["total"]), rel=1e-8)


def test_what_cannot_be_analysed(tmp_path):
    with pytest.raises(InputError) as caught:
        analysis(tmp_path, trials=100, noise_power=0.0, spread=0.0, draws="lhs")
    text = str(caught.value)
    for part in ("power of two", "128 is the nearest", "`noise_power`", "`spread`", "`draws`"):
        assert part in text
    assert list(tmp_path.iterdir()) == []


def test_command_line(tmp_path):
    motion = MOTIONS[0]
    path = tmp_path / "tone.csv"
    rows = np.column_stack([motion.time, motion.acceleration])
    np.savetxt(path, rows, delimiter=",", header="time [s],acceleration [m/s^2]", comments="")
    words = ["sensitivity", "--trials", 4, "--controllers", "passthrough", "--motion", path,
             "--out", tmp_path / "out", "--devices", 1, "--no-figures"]  # fmt: skip
    done = CliRunner().invoke(app, [str(w) for w in words], terminal_width=200)
    assert done.exit_code == 0, done.output
    assert "N = 4 base samples x (d + 2) = 12 rows = 48 runs" in done.output
    assert "is too small" in done.output
    found = open_sensitivity(tmp_path / "out")
    assert "motion" not in found.dataset.factor.values
    assert "too small" in (tmp_path / "out" / "summary.md").read_text()


def test_a_report_shows_it(whole):
    found, pictures = open_beside(whole.folder)
    assert found.heading == whole.summary().heading
    assert pictures


def test_it_is_exported_like_a_study(whole, tmp_path):
    mat, table = tmp_path / "a.mat", tmp_path / "a.csv"
    words = ["export", whole.folder, "--mat", mat, "--csv", table]
    done = CliRunner().invoke(app, [str(w) for w in words])
    assert done.exit_code == 0, done.output
    assert table.read_bytes() == (whole.folder / "sensitivity.csv").read_bytes()
    back = loadmat(mat, simplify_cells=True)
    assert np.array_equal(back["total"], whole.dataset.total.squeeze().values, equal_nan=True)
    assert np.array_equal(back["volt_peak"], whole.dataset.volt_peak.squeeze().values)
    refused = CliRunner().invoke(app, ["export", str(whole.folder), "--plants", "p.csv"])
    assert "whose design draws the plants" in str(refused.exception)


def test_its_configuration_reads_back_and_its_runs_say_how_they_ended(whole):
    config = make_config(whole.folder / "config.toml")
    assert (config.trials, config.controllers) == (32, ("passthrough",))
    assert whole.failed == 0 and whole.dataset.first_command.isnull().all()
