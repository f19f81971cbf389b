"""``martths tune`` as a user types it: one clear sentence for each mistake."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from martths_jax.cli import app, main
from martths_jax.tune import search as searching
from tests.tune import guest as guests
from tests.tune.bowl import Bowl


def said(capsys, monkeypatch, *words):
    """Exit code and the error text of ``martths tune`` with these words, on one line."""
    monkeypatch.setattr("sys.argv", ["martths", "tune", *map(str, words)])
    with pytest.raises(SystemExit) as end:
        main()
    return end.value.code, " ".join(capsys.readouterr().err.split())


@pytest.fixture
def short_motion(tmp_path):
    """A quarter of a second of ground acceleration as a file."""
    path = tmp_path / "short.csv"
    time = np.arange(256) / 1024
    rows = np.column_stack([time, np.sin(20 * time)])
    np.savetxt(path, rows, delimiter=",", header="time [s],acceleration [m/s^2]", comments="")
    return path


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--objective", "j2+j11"), "`objective` must be a sum of weighted indices"),
        (("--objective", "j2+0*j5"), "positive weight on J5, but got 0"),
        (("--objective", "j2+-1*j5"), "positive weight on J5, but got -1"),
        (("--start", "e1=0"), "`start` must give a positive e1, but got 0"),
        (("--start", "e1=-3"), "`start` must give a positive e1, but got -3"),
        (("--start", "e1"), "must be NAME=VALUE, but got 'e1'"),
        (("--start", "pull=1e-5"), "`start` must name one of e1, e2, r2, y1, y2, q"),
        (("--controller", "adfc", "--start", "pull=0"), "give a positive pull"),
        (("--trials", 0), "`trials` must be a whole number from 1"),
        (("--steps", 0), "`steps` must be at least 1, but got 0"),
        (("--check-trials", 0), "--check-trials must be at least 1, but got 0"),
        (("--controller", "pid"), "'pid' is unknown"),
        (("--check-motion", "elcentro-like"), "a motion that is not tuned on"),
        (("--controller", "lqg,adfc"), "--controller takes one value here, but got lqg, adfc"),
        (("--method", "newton"), "`method` must be one of lbfgs, adam"),
    ],
)
def test_a_mistake_is_one_sentence(words, sentence, capsys, monkeypatch, tmp_path):
    code, text = said(capsys, monkeypatch, "--out", tmp_path / "out", *words)
    assert code == 2
    assert sentence in text
    assert "Traceback" not in text
    assert not (tmp_path / "out").exists()


def test_several_mistakes_are_told_at_once(capsys, monkeypatch, tmp_path):
    words = ("--out", tmp_path, "--steps", 0, "--objective", "j99", "--start", "q=-1")
    _, text = said(capsys, monkeypatch, *words)
    for part in ("`steps`", "'j99'", "positive q"):
        assert part in text


def test_an_unstable_start_is_one_sentence(capsys, monkeypatch, tmp_path, short_motion):
    monkeypatch.setattr(searching, "Gradient", Bowl)
    monkeypatch.setattr(Bowl, "wall", -6.0)
    other = tmp_path / "other.csv"
    other.write_bytes(short_motion.read_bytes())
    code, text = said(
        capsys, monkeypatch, "--controller", "adfc", "--objective", "j2", "--motions", short_motion,
        "--check", other, "--out", tmp_path / "out",
    )  # fmt: skip
    assert code == 2
    assert "`start` must be stable on every plant, but 100 % of the trials diverged" in text
    assert "Traceback" not in text


def tuned(*words):
    """``martths tune`` with these words, in this process."""
    done = CliRunner().invoke(app, ["tune", *map(str, words)])
    assert done.exit_code == 0, done.output


@pytest.mark.slow
def test_a_controller_of_a_file_is_tuned_and_goes_on_by_its_configuration(tmp_path, short_motion):
    other, out = tmp_path / "other.csv", tmp_path / "out"
    other.write_bytes(short_motion.read_bytes())
    guest = tmp_path / "guest.py"
    guest.write_bytes(Path(guests.__file__).read_bytes())
    words = ["--objective", "j2", "--check-motion", other, "--check-trials", 2, "--out", out]
    new = ["--controller", f"{guest}:Lead{{lead=0.002}}", "--motion", short_motion, "--trials", 2]
    tuned("--steps", 3, *words, *new)
    first = json.loads((out / "state.json").read_text())["history"]
    assert first[0]["lead"] == 0.002 and len(first) == 3
    assert min(row["objective"] for row in first) < first[0]["objective"]
    tuned("--steps", 4, *words, "--config", out / "config.toml", "--quiet")
    assert json.loads((out / "state.json").read_text())["history"][:3] == first
    with (out / "comparison.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 26 and {row["published"] for row in rows} == {""}
    assert float(rows[2]["tuned"]) < float(rows[2]["start"]), "J2_1"
    design = json.loads((out / "design.json").read_text())
    assert design["controller"] == "lead" and design["lead"] > 0.002


@pytest.mark.parametrize("source", ["estimate", "measurement"])
def test_it_tunes_the_rig_whose_force_is_asked_for(short_motion, tmp_path, monkeypatch, source):
    class Reached(Exception):
        pass

    def run_tuning(benchmark, *args, **more):
        raise Reached(benchmark.force_from)

    monkeypatch.setattr("martths_jax.cli.tune.run_tuning", run_tuning)
    words = ["tune", "--motion", str(short_motion), "--force-from", source, "--trials", "2",
             "--out", str(tmp_path / "out")]  # fmt: skip
    done = CliRunner().invoke(app, words)
    assert isinstance(done.exception, Reached) and done.exception.args == (source,)
