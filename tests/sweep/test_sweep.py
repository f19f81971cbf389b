"""Sweeps end to end: a cell is what `simulate` gives, and no interruption changes a bit."""

import csv
import json

import jax
import numpy as np
import pytest
import xarray as xr
from scipy.io import loadmat
from typer.testing import CliRunner

from martths_jax import (
    ADFC,
    InputError,
    Passthrough,
    SensorNoise,
    build_benchmark,
    build_coupler,
    draw_plants,
    indices,
    load_motion,
    simulate,
)
from martths_jax.campaign.config import make_config
from martths_jax.campaign.draws import read_plants
from martths_jax.campaign.statistics import percentile
from martths_jax.cli import app
from martths_jax.indices import NAMES
from martths_jax.motions import Motion
from martths_jax.report.beside import open_beside
from martths_jax.study import Reporter
from martths_jax.sweep import open_sweep, run_sweep
from tests.study.places import short_motion

TRIALS = 70  # one more than a block, and blocks that hold trials of two cells


def grid(out, **changes):
    """Passthrough over motion scale x noise power; at the largest scale every trial is lost."""
    axes = changes.pop("axes", {"scale": (0.5, 1.0, 2000.0), "noise_power": (0.0, 1.5e-7, 3e-7)})
    settings = {
        "trials": TRIALS, "controllers": ("passthrough",),
        "motions": (short_motion("one"), short_motion("two", 1.0)), "out": str(out), "devices": 1,
    }  # fmt: skip
    return run_sweep(axes, settings, shown=("J2_1", "J8_2"), **changes)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The grid in one go, with its figures."""
    return grid(tmp_path_factory.mktemp("whole"))


def table(result) -> np.ndarray:
    """(trials, 24) indices."""
    found = indices(result)
    return np.stack([found[name] for name in NAMES], axis=-1)


def files(folder) -> dict[str, bytes]:
    return {n: (folder / n).read_bytes() for n in ("sweep.nc", "sweep.csv", "summary.md")}


def test_a_cell_is_what_simulate_gives(whole):
    benchmark, plants = build_benchmark(), draw_plants(TRIALS, seed=1)
    motion = short_motion("two", 1.0)
    half = Motion("two", 0.5 * motion.acceleration, 1024.0)
    result = simulate(benchmark, Passthrough(), plants, half, SensorNoise(3e-7, seed=1))
    cell = whole.dataset.sel(
        scale=0.5, noise_power=3e-7, controller="passthrough", motion="two", trial=plants.trial
    )
    assert np.array_equal(cell.value.values, table(result))
    assert np.array_equal(cell.status.values, result.status)
    assert np.array_equal(cell.volt_peak.values, result.watch.volt_peak)
    assert not np.array_equal(
        cell.value.values,
        whole.dataset.value.sel(
            scale=0.5,
            noise_power=1.5e-7,
            controller="passthrough",
            motion="two",
            trial=plants.trial,
        ),
    )


def test_an_adfc_cell_is_what_simulate_gives(tmp_path):
    """Hops and pulls beside each other in one block, each as if alone."""
    motion = short_motion("one")
    sweep = run_sweep(
        {"nb": (48,), "hop": (1, 16), "pull": (1e-6, 1e-4)}, trials=20, motions=(motion,),
        controllers=("adfc", "passthrough"), out=str(tmp_path), figures=False, devices=1,
    )  # fmt: skip
    plants = draw_plants(20, seed=1)
    chosen = [ADFC(nb=48, no=no, pull=pull, towards="inverse")
              for no, pull in ((47, 1e-4), (32, 1e-6))]  # fmt: skip
    both = [chosen[i >= 10] for i in range(20)]
    values = table(simulate(build_benchmark(), both, plants, motion, SensorNoise(seed=1)))
    cells = sweep.dataset.value.sel(nb=48, controller="adfc", motion="one", trial=plants.trial)
    first = cells.sel({"hop": 1, "pull": 1e-4}).values
    second = cells.sel({"hop": 16, "pull": 1e-6}).values
    assert np.all(np.isfinite(values))
    assert np.array_equal(first[:10], values[:10]) and np.array_equal(second[10:], values[10:])
    assert not np.array_equal(first[10:], values[10:]), "the cells differ"
    assert sweep.dataset.cell_no.sel({"hop": 16, "pull": 1e-6, "controller": "adfc"}).item() == 32
    # What has no buffer is run once and stands in all cells.
    assert len(list((tmp_path / "parts").iterdir())) == 4 + 1
    other = sweep.dataset.value.sel(controller="passthrough", motion="one").values
    assert np.array_equal(other, np.broadcast_to(other[:1, :1, :1], other.shape), equal_nan=True)


def test_surroundings_are_axes_too(tmp_path):
    motion = short_motion("one")
    sweep = grid(
        tmp_path, axes={"alpha": (20.0, 30.0), "arm": (0.25,), "spread": (0.5, 1.0)},
        motions=(motion,), trials=5, figures=False,
    )  # fmt: skip
    benchmark = build_benchmark(coupler=build_coupler(0.25, 20.0))
    plants = draw_plants(5, seed=1, spread=0.5)
    result = simulate(benchmark, Passthrough(), plants, motion, SensorNoise(seed=1))
    cells = sweep.dataset.value.sel(controller="passthrough", motion="one", trial=plants.trial)
    cells = cells.squeeze("arm")
    assert np.array_equal(cells.sel(alpha=20.0, spread=0.5).values, table(result))
    flat = cells.stack(cell=("alpha", "spread")).transpose("cell", ...).values
    assert all(not np.array_equal(flat[0], other) for other in flat[1:])


class Stop(Reporter):
    """Interrupts a session after some blocks, and counts the trials it ran."""

    def __init__(self, after: int | None = None):
        self.after, self.blocks, self.before = after, 0, 0

    def begin(self, cells):
        super().begin(cells)
        self.before = sum(t.done for t in cells.values())

    def advanced(self, cell, tally):
        self.blocks += 1
        if self.blocks == self.after:
            raise KeyboardInterrupt

    @property
    def ran(self) -> int:
        return sum(t.ran for t in self.cells.values())


def test_interrupted_and_repeated_gives_the_same_files(whole, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        grid(tmp_path, reporter=Stop(after=6))
    left = len(list((tmp_path / "parts").rglob("[!.]*.npz")))
    assert 0 < left < 18 and not (tmp_path / "sweep.nc").exists()
    again = Stop()
    grid(tmp_path, reporter=again, figures=False)
    total = 18 * (TRIALS + 1)
    assert (again.before, again.ran) == (left * (TRIALS + 1), total - left * (TRIALS + 1))
    assert files(tmp_path) == files(whole.folder)
    third = Stop()
    grid(tmp_path, reporter=third, figures=False)
    assert (third.before, third.ran) == (total, 0)


def test_devices_change_no_bit(whole, tmp_path):
    if len(jax.local_devices()) < 2:
        pytest.skip("needs two devices")
    grid(tmp_path, devices=2, figures=False)
    about = json.loads((tmp_path / "provenance.json").read_text())["sessions"][0]
    assert len(about["devices"]) == 2
    assert files(tmp_path) == files(whole.folder)


def test_another_configuration_is_refused_by_key(whole):
    before = files(whole.folder)
    with pytest.raises(InputError) as caught:
        grid(whole.folder, axes={"scale": (0.5, 1.0), "noise_power": (0.0, 1.5e-7)}, seed=2)
    text = str(caught.value)
    assert "axes.scale: [0.5, 1.0, 2000.0] in the folder, [0.5, 1.0] asked for" in text
    assert "axes.noise_power" in text and "seed: 1 in the folder, 2 asked for" in text
    assert files(whole.folder) == before


def test_the_dataset_is_labelled_and_reads_back(whole):
    with xr.open_dataset(whole.folder / "sweep.nc", engine="h5netcdf") as stored:
        assert stored.value.dims == (
            "scale", "noise_power", "controller", "motion", "trial", "index")  # fmt: skip
        assert stored.noise_power.attrs["units"] == "mm^2 s"
        assert {"status", "held", "first_command"} <= set(stored)
    again = open_sweep(whole.folder)
    assert again.axes == whole.axes and again.dataset.value.equals(whole.dataset.value)
    lost = whole.lost_share().sel(controller="passthrough", motion="one")
    assert lost.values.tolist() == [[0, 0, 0], [0, 0, 0], [1, 1, 1]]
    with (whole.folder / "sweep.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 9 * 2 * (TRIALS + 1)
    assert {r["J2_1"] for r in rows if r["scale"] == "2000.0"} == {""}, "every trial was lost"
    row = next(r for r in rows if (r["scale"], r["noise_power"], r["motion"], r["trial"]) == (
        "0.5", "3e-07", "two", "7"))  # fmt: skip
    there = whole.dataset.value.sel(scale=0.5, noise_power=3e-7, motion="two", trial=7)
    assert float(row["J6_28"]) == there.sel(controller="passthrough", index="J6_28").item()


def test_numbers_of_a_heat_map_are_those_of_the_dataset(whole):
    folder = whole.folder / "figures"
    name = "map_noise_power_scale_passthrough_two"
    assert {f"{name}.pdf", f"{name}.png"} <= {p.name for p in folder.iterdir()}
    with (folder / f"{name}.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * 9
    for row in rows:
        cell = whole.dataset.sel(
            scale=float(row["scale"]), noise_power=float(row["noise_power"]), motion="two",
            controller="passthrough", trial=slice(1, None),
        )  # fmt: skip
        sample = cell.value.sel(index=row["index"]).values
        lost = np.isnan(sample)
        assert float(row["lost_share"]) == lost.mean()
        assert int(row["trials"]) == np.sum(~lost)
        if lost.all():
            assert row["median"] == row["P95"] == ""
            continue
        assert float(row["median"]) == pytest.approx(np.median(sample), rel=1e-8)
        assert float(row["P95"]) == pytest.approx(np.percentile(sample, 95), rel=1e-8)


def test_one_axis_gives_lines_with_bands(tmp_path):
    sweep = grid(
        tmp_path, axes={"noise_power": (0.0, 1.5e-7, 3e-7)}, motions=(short_motion("one"),)
    )
    with (tmp_path / "figures" / "lines_noise_power_one.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3 * (2 * 2 + 1)
    row = next(r for r in rows if (r["index"], r["percent"], r["noise_power"]) == (
        "J8_2", "95", "3e-07"))  # fmt: skip
    sample = sweep.dataset.value.sel(
        noise_power=3e-7, controller="passthrough", motion="one", index="J8_2"
    ).values[1:]
    wanted = percentile(sample, 95)
    found = [float(row[k]) for k in ("low", "value", "high")]
    assert found == pytest.approx([wanted.low, wanted.value, wanted.high], rel=1e-8)
    assert wanted.low < wanted.value < wanted.high


def test_command_line(tmp_path):
    """`martths sweep` with a record that is sampled anew at another rate."""
    motion = short_motion("tone")
    path = tmp_path / "tone.csv"
    rows = np.column_stack([motion.time, motion.acceleration])
    np.savetxt(path, rows, delimiter=",", header="time [s],acceleration [m/s^2]", comments="")
    out = tmp_path / "out"
    words = ["sweep", "--axis", "fs=512", "--axis", "scale=0.5:1:lin2", "--controllers",
             "passthrough", "--motion", path, "--trials", 3, "--out", out, "--devices", 1,
             "--no-figures", "--index", "J2_1,J8_2"]  # fmt: skip
    done = CliRunner().invoke(app, [str(w) for w in words], terminal_width=200)
    assert done.exit_code == 0, done.output
    assert "passthrough on tone" in done.output and not (out / "figures").exists()
    value = open_sweep(out).dataset.value.sel(controller="passthrough", motion="tone")
    loaded = load_motion(path, scale=0.5, fs=512)
    plants = draw_plants(3, seed=1)
    result = simulate(build_benchmark(512), Passthrough(), plants, loaded, SensorNoise(seed=1))
    assert np.array_equal(value.sel(fs=512, scale=0.5, trial=plants.trial), table(result))
    again = CliRunner().invoke(app, ["sweep", "--no", "1", "--hop", "3", "--axis", "gain=2"])
    assert isinstance(again.exception, InputError)
    assert "gain" in str(again.exception) and "all set the overlap" in str(again.exception)


def test_a_report_shows_it(whole):
    found, pictures = open_beside(whole.folder)
    assert found.tables[0].rows == whole.summary().tables[0].rows
    assert pictures and all(p.suffix == ".png" for p in pictures)


def test_it_is_exported_like_a_study(whole, tmp_path):
    mat, table_ = tmp_path / "a.mat", tmp_path / "a.csv"
    words = ["export", whole.folder, "--mat", mat, "--csv", table_, "--plants", tmp_path / "p.csv"]
    done = CliRunner().invoke(app, [str(w) for w in words])
    assert done.exit_code == 0, done.output
    assert table_.read_bytes() == (whole.folder / "sweep.csv").read_bytes()
    back = loadmat(mat, simplify_cells=True)
    assert np.array_equal(back["value"], whole.dataset.value.squeeze().values, equal_nan=True)
    assert list(back["dims"]["status"]) == list(whole.dataset.status.dims)
    assert len(read_plants(tmp_path / "p.csv")) == TRIALS


def test_its_configuration_reads_back(whole):
    path = whole.folder / "config.toml"
    config = make_config(path)
    assert (config.trials, config.motions) == (TRIALS, ("one", "two"))
    assert "scale=0.5,1.0,2000.0 noise_power=0.0,1.5e-07,3e-07" in path.read_text()
