"""The result files as other tools see them, the command line, and memory."""

import csv
import json
import re
import shutil

import h5py
import jax
import numpy as np
import pytest
import xarray as xr
from scipy.io import loadmat
from typer.testing import CliRunner

from martths_jax import InputError
from martths_jax.campaign import memory as memory_module
from martths_jax.campaign.dataset import read_dataset, write_dataset
from martths_jax.campaign.files import writing
from martths_jax.campaign.formats.mat import write_mat
from martths_jax.campaign.memory import choose_chunk, lane_bytes, running_bytes
from martths_jax.campaign.progress import Lines, Tally
from martths_jax.campaign.store import FORMAT
from martths_jax.cli import app
from martths_jax.indices import NAMES, choose
from martths_jax.study import run_study
from martths_jax.study.signals import group
from tests.study.places import SAMPLES, short_motion, small


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    return run_study(small(folder, motions=(short_motion("one"), short_motion("größer", 1.0))))


def test_the_file_needs_no_xarray(study):
    """What MATLAB's ncread can hold: numbers, characters, fixed-length attributes."""
    with h5py.File(study.folder / "study.nc") as file:
        kinds = {name: item.dtype for name, item in file.items()}
        assert all(d.kind in "fi" or d == np.dtype("S1") for d in kinds.values()), kinds
        for item in [file, *file.values()]:
            for name, value in item.attrs.items():
                if name not in ("DIMENSION_LIST", "REFERENCE_LIST"):
                    assert not h5py.check_string_dtype(item.attrs.get_id(name).dtype) or (
                        h5py.check_string_dtype(item.attrs.get_id(name).dtype).length
                    ), (item.name, name)
                    assert np.asarray(value).dtype.kind in "SfiuV", (item.name, name)
        names = [b"".join(row).decode() for row in file["index"][:]]
        assert tuple(names) == NAMES
        assert b"".join(file["motion"][1]).decode() == "größer"
        assert [d.label or d[0].name for d in file["value"].dims] == [
            "/controller", "/motion", "/trial", "/index"
        ]  # fmt: skip
        assert np.array_equal(file["value"][:], study.dataset.value.values)
        attributes = {k: v for k, v in file.attrs.items()}
    assert json.loads(attributes["configuration"])["trials"] == 20
    for name in ("version_martths_jax", "version_jax", "version_numpy", "version_scipy", "platform",
                 "git_commit", "command_line", "record_sha256"):  # fmt: skip
        assert attributes[name]
    assert attributes["seed"] == 1 and b"one one-sha" in attributes["record_sha256"]


def test_plain_xarray_gives_text(study, tmp_path):
    with xr.open_dataset(study.folder / "study.nc", engine="h5netcdf") as file:
        at = {"controller": "passthrough", "motion": "größer", "index": "J2_1"}
        assert np.array_equal(file.value.sel(at), study.dataset.value.sel(at))
        assert file.attrs["version_jax"] == jax.__version__
        assert file.pga.attrs["units"] == "m s-2" and file.held.attrs["units"] == "1"
    # A group, with text along a dimension that has no coordinate, and attributes beyond ASCII.
    roles = xr.Dataset({"role": ("kept", np.array(["nominal", "median+kept"]), {"note": "é"})})
    with writing(tmp_path / "signals.nc") as path:
        write_dataset(xr.Dataset(attrs={"format": FORMAT, "name": "größer", "none": ""}), path)
        write_dataset(roles, path, group("größer", "lqg"))
    with xr.open_dataset(tmp_path / "signals.nc", engine="h5netcdf") as file:
        assert file.attrs["name"] == "größer" and file.attrs["none"] == ""
    inside = group("größer", "lqg")
    with xr.open_dataset(tmp_path / "signals.nc", group=inside, engine="h5netcdf") as file:
        assert list(file.role.values) == ["nominal", "median+kept"]
        assert file.role.attrs["note"] == "é"


def test_a_file_without_the_mark_of_text_is_read_alike(study, tmp_path):
    shutil.copy(study.folder / "study.nc", tmp_path / "study.nc")
    with h5py.File(tmp_path / "study.nc", "r+") as file:
        marked = [item for item in file.values() if "_Encoding" in item.attrs]
        assert len(marked) == 6
        for item in marked:
            assert item.attrs["_Encoding"] == b"utf-8"
            del item.attrs["_Encoding"]
    again = read_dataset(tmp_path / "study.nc")
    xr.testing.assert_identical(again, read_dataset(study.folder / "study.nc"))
    assert again.motion.dtype.kind == "U" and list(again.motion.values) == ["one", "größer"]


def test_the_matlab_file_holds_the_same(study, tmp_path):
    write_mat(study.dataset, tmp_path / "s.mat")
    back = loadmat(tmp_path / "s.mat", simplify_cells=True)
    assert np.array_equal(np.squeeze(back["value"]), np.squeeze(study.dataset.value.values))
    assert list(back["index"]) == list(NAMES) and list(back["motion"]) == ["one", "größer"]
    assert list(back["dims"]["value"]) == ["controller", "motion", "trial", "index"]
    assert back["attributes"]["seed"] == 1


def test_the_csv_is_tidy_and_exact(study):
    rows = list(csv.DictReader((study.folder / "study.csv").open(encoding="utf-8")))
    assert len(rows) == 2 * 21
    row = rows[21 + 5]
    assert (row["controller"], row["motion"], row["trial"]) == ("passthrough", "größer", "5")
    value = study.dataset.value.sel(motion="größer", trial=5, controller="passthrough")
    assert [float(row[name]) for name in NAMES] == value.values.tolist()


def test_times_are_kept_beside_the_results(study):
    session = json.loads((study.folder / "provenance.json").read_text())["sessions"][0]
    assert session["trials"] == 42 and session["wall_seconds"] > 0
    assert session["started"] <= session["ended"]


def run(*words):
    words = [str(w) for w in words]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", ["/somewhere/martths", *words])
        return CliRunner().invoke(app, words, catch_exceptions=True)


def record(path, factor=1.0):
    """A CSV record that is quiet for its last five seconds."""
    time = np.arange(0, 6.0, 0.01)
    values = np.where(time < 0.9, factor * np.sin(15 * time), 0.0)
    np.savetxt(path, np.c_[time, values], delimiter=",", header="time [s],acceleration [m/s2]",
               comments="")  # fmt: skip
    return path


def test_the_commands(tmp_path):
    config, out = tmp_path / "study.toml", tmp_path / "out"
    assert run("init-config", config).exit_code == 0
    words = ["study", "--config", config, "--trials", 5, "--controller", "passthrough",
             "--motion", record(tmp_path / "r.csv"), "--out", out, "--no-signals"]  # fmt: skip
    done = run(*words)
    assert done.exit_code == 0, done.output
    assert "Nominal plant" in done.output and "Seed 1;" in done.output
    assert "6 of 6 trials" in done.output and "compiled in" in done.output
    quiet = run(*words, "--quiet")
    assert quiet.exit_code == 0 and quiet.output == ""
    assert "passthrough on r" in run("summary", out).output
    made = run("export", out, "--mat", tmp_path / "s.mat", "--plants", tmp_path / "p.csv")
    assert made.exit_code == 0 and (tmp_path / "s.mat").stat().st_size > 1000
    header = json.loads((out / "run.json").read_text())
    assert header["command_line"].startswith("martths study --config")
    assert "--out" not in header["command_line"] and "--trials 5" in header["command_line"]
    again = ["study", *words[3:11], "--out", tmp_path / "huge", "--scale", 2000, "--quiet",
             "--no-signals", "--max-failed", 5]  # fmt: skip
    lost = run(*again)
    assert lost.exit_code == 1 and "6 runs diverged, more than --max-failed 5" in lost.output
    assert run(*again[:-1], 6).exit_code == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["study", "--shard", "0/3"], "such as 3/16"),
        (["study", "--keep", "1;2"], "such as 1,617"),
        (["study", "--shard", "1/2", "--distributed"], "exclude each other"),
        (["study", "--trials", "0", "--scale", "0"], "2 problems"),
        (["export", "nowhere", "--mat", "x.mat"], "does not exist"),
        (["merge", "nowhere"], "holds no study"),
    ],
)
def test_what_a_command_refuses(words, message):
    done = run(*words)
    assert isinstance(done.exception, InputError) and message in str(done.exception)


def test_the_chunk_follows_the_memory(monkeypatch):
    free = {"available": 20e9}
    monkeypatch.setattr(memory_module, "available_memory", lambda: free["available"])
    each = lane_bytes(52_162, 1)
    devices, chunk = choose_chunk(52_162, 1, 128, 2)
    assert devices == 2 and chunk == 256 and chunk * each <= 0.5e9
    assert choose_chunk(SAMPLES, 1, 128, 2)[1] == 256 * 16
    spectra = running_bytes(choose("frequency"), 1024.0)
    assert spectra > 4 * 16384 * 8 > 100 * running_bytes(choose("benchmark"), 1024.0)
    both = choose_chunk(SAMPLES, 1, 128, 2, memory_gb=0.2, running=spectra)
    assert both[0] * 128 * spectra + both[1] * lane_bytes(SAMPLES, 1) <= 0.2e9
    assert both < choose_chunk(SAMPLES, 1, 128, 2, memory_gb=0.2)
    with pytest.raises(InputError, match="memory_gb"):
        choose_chunk(SAMPLES, 1, 128, 2, memory_gb=0.05, running=spectra)
    free["available"] = 0.5e9
    assert choose_chunk(52_162, 1, 128, 16) == (1, 128)
    assert choose_chunk(52_162, 1, 128, 2, memory_gb=0.5)[0] == 2
    with pytest.raises(InputError, match=r"0\.13 GB, but `memory_gb` \(--memory\) is 0\.1 GB"):
        choose_chunk(52_162, 1, 128, 2, memory_gb=0.1)
    free["available"] = 0.1e9
    with pytest.raises(InputError, match=r"0\.1 GB are free"):
        choose_chunk(52_162, 1, 128, 2)


def test_lines_tell_rate_and_time_to_go():
    from rich.console import Console

    console = Console(record=True, width=200, quiet=False, file=open("/dev/null", "w"))
    lines = Lines(console, every=0)
    lines.begin({("a", "m"): Tally(100, 0), ("b", "m"): Tally(100, 0)})
    lines.advance(("a", "m"), 50, 2, seconds=3.0, compiling=1.0)
    lines.advance(("b", "m"), 50, 0, seconds=10.0, compiling=0.0)
    text = console.export_text()
    assert "a on m: 50 of 100 trials, 25 trials/s, 0:02 to go, 2 failed, compiled in 1.0 s" in text
    # The cells take turns, so what is left takes the time of both.
    assert re.search(r"b on m: .* 5 trials/s, 0:12 to go, 0 failed", text)
