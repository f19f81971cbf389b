"""Studies end to end: the numbers, and that no interruption, order or device changes one bit."""

import errno
import json
import os
import signal
import subprocess
import sys
import time

import jax
import numpy as np
import pytest

from martths_jax import (
    LQG,
    InputError,
    SensorNoise,
    Status,
    build_benchmark,
    draw_plants,
    indices,
    simulate,
)
from martths_jax.campaign.header import sealed
from martths_jax.campaign.store import RunFolder
from martths_jax.simulation import LANES
from martths_jax.study import Reporter, open_study, run_study
from tests.study.places import ONE_BLOCK, result_bytes, short_motion, small


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """300 trials in one go, on all devices."""
    folder = tmp_path_factory.mktemp("whole")
    return run_study(small(folder, trials=300))


def test_trial_0_is_the_nominal_plant(whole):
    assert np.all(whole.dataset.draw.sel(trial=0).values == 0)
    assert np.all(whole.dataset.draw.sel(trial=slice(1, None)).values != 0)
    assert whole.dataset.sizes["trial"] == 301


def test_chunks_and_devices_change_no_bit(whole, tmp_path):
    if len(jax.local_devices()) < 2:
        pytest.skip("needs two devices")
    one = run_study(small(tmp_path, trials=300, memory_gb=ONE_BLOCK))
    about = json.loads((one.folder / "provenance.json").read_text())["sessions"][0]
    assert len(about["devices"]) == 1 and about["chunk"] == LANES
    assert result_bytes(tmp_path) == result_bytes(whole.folder)


def test_an_extended_study_is_the_whole_one(whole, tmp_path):
    first = run_study(small(tmp_path, trials=100))
    assert np.array_equal(
        first.dataset.value, whole.dataset.value.sel(trial=slice(0, 100)), equal_nan=True
    )
    stamps = {p: p.stat().st_mtime_ns for p in (tmp_path / "parts").rglob("*.npz")}
    run_study(small(tmp_path, trials=300))
    assert result_bytes(tmp_path) == result_bytes(whole.folder)
    assert all(p.stat().st_mtime_ns == stamp for p, stamp in stamps.items())


def test_the_numbers_are_those_of_simulate(whole, tmp_path):
    study = run_study(small(tmp_path, trials=300, controllers=("passthrough", "lqg")))
    benchmark = build_benchmark()
    plants = draw_plants(300, seed=1)[150:]
    result = simulate(
        benchmark, LQG.design(benchmark), plants, short_motion("two", 1.0), SensorNoise(seed=1)
    )
    there = study.dataset.sel(controller="lqg", motion="two", trial=plants.trial)
    for name, values in indices(result).items():
        assert np.array_equal(there.value.sel(index=name).values, values)
    assert np.array_equal(there.status.values, result.status)
    assert np.array_equal(there.volt_peak.values, result.watch.volt_peak)
    assert np.array_equal(there.draw.values, plants.draws)
    # Common plants and noise, and no controller or motion under another's name.
    other = whole.dataset.sel(controller="passthrough")
    assert study.dataset.sel(controller="passthrough").value.equals(other.value)


VICTIM = """
import sys
sys.path.insert(0, {root!r})
from martths_jax.campaign import provenance
from martths_jax.study import run_study
provenance.git_commit = lambda: "0000000"
from tests.study.places import small, ONE_BLOCK
run_study(small({folder!r}, trials=300, memory_gb=ONE_BLOCK))
"""


@pytest.mark.slow
def test_killed_and_rerun_gives_the_same_files(whole, tmp_path, compile_cache):
    root = os.path.dirname(os.path.dirname(os.path.dirname(__file__)))
    code = VICTIM.format(root=root, folder=str(tmp_path))
    victim = subprocess.Popen([sys.executable, "-c", code], env=compile_cache)
    # A name that begins with a dot is a file that was being written.
    parts = lambda: list((tmp_path / "parts").rglob("[!.]*.npz"))  # noqa: E731
    deadline = time.monotonic() + 240
    while len(parts()) < 3 and victim.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    victim.send_signal(signal.SIGKILL)
    assert victim.wait() == -signal.SIGKILL, "it was done before it could be killed"
    left = sum(_trials(p) for p in parts())
    assert 3 * 45 <= left < 2 * 301 and not (tmp_path / "study.nc").exists()
    counted = Counting()
    run_study(small(tmp_path, trials=300), reporter=counted)
    assert (counted.before, counted.trials) == (left, 2 * 301 - left)
    assert result_bytes(tmp_path) == result_bytes(whole.folder)


def _trials(path) -> int:
    first, last = path.stem.split("-")
    return int(last) - int(first) + 1


class Counting(Reporter):
    """Counts what a session runs, and interrupts it after some chunks."""

    def __init__(self, stop_after: int | None = None):
        self.trials, self.chunks, self.stop_after, self.before = 0, 0, stop_after, 0

    def begin(self, cells):
        super().begin(cells)
        self.before = sum(tally.done for tally in cells.values())

    def advanced(self, cell, tally):
        self.chunks += 1
        self.trials = sum(t.ran for t in self.cells.values())
        if self.chunks == self.stop_after:
            raise KeyboardInterrupt


def test_ctrl_c_keeps_finished_chunks(whole, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        run_study(small(tmp_path, trials=300), reporter=Counting(stop_after=1))
    assert len(list((tmp_path / "parts").rglob("*.npz"))) == 1
    again = Counting()
    run_study(small(tmp_path, trials=300), reporter=again)
    assert (again.before, again.trials) == (301, 301)
    assert result_bytes(tmp_path) == result_bytes(whole.folder)


def test_a_full_disk_loses_nothing(whole, tmp_path, monkeypatch):
    real, calls = os.fsync, []

    def full(descriptor):
        calls.append(descriptor)
        if len(calls) == 3:  # run.json, a part, and this one
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(descriptor)

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match="No space left on device"):
        run_study(small(tmp_path, trials=300))
    monkeypatch.undo()
    assert len(list((tmp_path / "parts").rglob("*.npz"))) == 1
    assert not list(tmp_path.rglob("*.part*"))
    run_study(small(tmp_path, trials=300))
    assert result_bytes(tmp_path) == result_bytes(whole.folder)


def test_a_damaged_part_is_computed_again(whole, tmp_path):
    run_study(small(tmp_path, trials=300))
    part = sorted((tmp_path / "parts" / "passthrough" / "one").glob("*.npz"))[0]
    data = bytearray(part.read_bytes())
    data[len(data) // 2] ^= 0xFF
    part.write_bytes(data)
    counted = Counting()
    run_study(small(tmp_path, trials=300), reporter=counted)
    assert counted.trials == _trials(part)
    assert part.with_name(f"{part.name}.damaged").read_bytes() == data
    assert result_bytes(tmp_path) == result_bytes(whole.folder)


def test_a_finished_study_is_not_run_again(whole):
    counted = Counting()
    run_study(small(whole.folder, trials=300), reporter=counted)
    assert counted.trials == 0


def test_a_changed_configuration_is_refused_by_key(tmp_path):
    run_study(small(tmp_path))
    before = result_bytes(tmp_path)
    changed = small(
        tmp_path, seed=2, motions=(short_motion("one", 0.1), short_motion("two", 1.0)),
        controller={"passthrough": {"q": 0.5}},
    )  # fmt: skip
    with pytest.raises(InputError) as caught:
        run_study(changed)
    text = str(caught.value)
    for key in (
        "seed: 1 in the folder, 2",
        "controller.passthrough.q: None in",
        "motion.one.samples_sha256: ",
    ):
        assert key in text
    assert "motion.two" not in text and "--fresh" in text
    assert result_bytes(tmp_path) == before
    with pytest.raises(InputError, match=r"20 trials, but 10 were asked for"):
        run_study(small(tmp_path, trials=10))
    (tmp_path / "mine.txt").write_text("not the study's")
    fresh = run_study(small(tmp_path, trials=10), fresh=True)
    assert fresh.dataset.sizes["trial"] == 11
    assert (tmp_path / "mine.txt").read_text() == "not the study's"


@pytest.mark.parametrize("content", ['{"format": 99}', "no JSON", "[]"])
def test_a_folder_of_another_version_is_refused(tmp_path, content):
    (tmp_path / "run.json").write_text(content)
    with pytest.raises(InputError, match=r"format|damaged"):
        run_study(small(tmp_path))
    assert (tmp_path / "run.json").read_text() == content


def test_other_software_is_a_changed_configuration(tmp_path):
    run_study(small(tmp_path))
    header = json.loads((tmp_path / "run.json").read_text())
    header["identity"]["versions"]["jax"] = "0.0.1"
    (tmp_path / "run.json").write_text(json.dumps(sealed(header)))
    with pytest.raises(InputError, match=r"versions.jax: '0.0.1' in the folder"):
        run_study(small(tmp_path))


def test_a_folder_that_cannot_be_made(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        run_study(small(tmp_path / "file" / "study"))


def test_results_without_their_run_are_not_overwritten(tmp_path):
    (tmp_path / "study.nc").write_bytes(b"precious")
    with pytest.raises(InputError, match=r"no run\.json"):
        run_study(small(tmp_path))
    assert (tmp_path / "study.nc").read_bytes() == b"precious"


def test_diverging_trials_are_data(tmp_path):
    study = run_study(
        small(tmp_path, motions=(short_motion("one"), short_motion("huge", factor=3e3)))
    )
    cell = study.dataset.sel(motion="huge")
    lost = cell.status.values >= Status.DIVERGED
    assert lost.all() and study.failed == 21 and len(study.failures) == 21
    assert np.isnan(cell.value.values).all()
    assert np.isfinite(cell.first_stroke.values).any()
    assert np.isfinite(study.dataset.sel(motion="one").value.values).all()
    assert "| passthrough | huge | 20 | 0 | 0 | 0 | 20 | 0 |" in study.summary().markdown()


def test_signals_of_chosen_trials(tmp_path):
    study = run_study(small(tmp_path, signals=True, keep=(7,), motions=(short_motion("one"),)))
    value = study.dataset.value.sel(controller="passthrough", motion="one", index="J2_1").values
    signals = study.signals("one", "passthrough")
    roles = dict(zip(signals.role.values, signals.trial.values, strict=True))
    order = np.argsort(value[1:]) + 1
    assert roles["nominal"] == 0 and roles["worst"] == order[-1] and roles["median"] == order[9]
    assert 7 in signals.trial.values
    # The second run gives the signals whose index the first one found, to the last bits of a sum.
    error = signals.x_m - signals.x_a
    again = 100 * np.sqrt((error**2).sum("time") / (signals.x_a**2).sum("time"))
    np.testing.assert_allclose(again[:, 0], value[signals.trial.values], rtol=1e-12)
    shared = study.signals("one")
    assert shared.ground.shape == (600,) and shared.reference.shape == (600, 6)
    before = (tmp_path / "signals.nc").stat().st_mtime_ns
    run_study(small(tmp_path, signals=True, keep=(7,), motions=(short_motion("one"),)))
    assert (tmp_path / "signals.nc").stat().st_mtime_ns == before
    with pytest.raises(InputError, match="'adfc' is not in the study"):
        study.signals("one", "adfc")


def test_open_study_gives_what_run_study_gave(whole):
    again = open_study(whole.folder)
    assert again.dataset.equals(whole.dataset)
    assert str(again) == str(whole)
    with pytest.raises(InputError, match="does not exist"):
        open_study(whole.folder / "nowhere")
    run = RunFolder.open(whole.folder)
    assert not run.missing()
