"""The commands of a single run, as a user types them."""

import csv
import json
import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from scipy.io import loadmat
from typer.testing import CliRunner

from martths_jax import cli, published
from martths_jax.cli import app, main
from martths_jax.files import atomic
from martths_jax.nominal import Comparison, compare_with_table4
from tests.engine.motions import burst

runner = CliRunner()


@pytest.fixture
def motion_file(tmp_path):
    """The 0.7 s burst as a CSV file with its unit in the header."""
    motion = burst()
    path = tmp_path / "burst.csv"
    rows = np.column_stack([motion.time, motion.acceleration])
    np.savetxt(path, rows, delimiter=",", header="time [s],acceleration [m/s^2]", comments="")
    return path


def invoke(*words):
    """Run ``martths`` in this process and return (exit code, standard error and output)."""
    result = runner.invoke(app, [str(w) for w in words], terminal_width=200)
    return result


def test_modes_prints_table_1():
    text = invoke("modes").output
    for frequency, _ in published.TABLE1.values():
        assert text.count(f"{frequency:.4f}") == 2, "ours and the published one"


def test_run_saves_signals_indices_and_settings(motion_file, tmp_path):
    out = tmp_path / "out"
    result = invoke(
        "run", "--motion", motion_file, "--controller", "lqg", "--trial", 3, "--seed", 5,
        "--scale", 1.0, "--out", out, "--matlab",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert sorted(p.name for p in out.iterdir()) == [
        "burst_lqg.mat",
        "burst_lqg_indices.csv",
        "burst_lqg_run.json",
        "burst_lqg_signals.npz",
    ]
    signals = np.load(out / "burst_lqg_signals.npz")
    for name, width in (("x_a", 2), ("x_m", 2), ("u", 2), ("num", 6), ("ref", 6), ("est", 2)):
        assert signals[name].shape == (signals["time"].size, width)
    rows = list(csv.DictReader((out / "burst_lqg_indices.csv").open()))
    assert len(rows) == 24
    error = signals["x_m"] - signals["x_a"]
    j2 = 100 * np.sqrt(np.sum(error**2, 0) / np.sum(signals["x_a"] ** 2, 0))
    by_name = {row["index"]: float(row["value"]) for row in rows}
    assert by_name["J2_1"] == pytest.approx(j2[0])
    about = json.loads((out / "burst_lqg_run.json").read_text())
    assert (about["trial"], about["seed"], about["scale"]) == (3, 5, 1.0)
    assert about["settings"]["kind"] == "lqg" and len(about["settings"]["e"]) == 2
    back = loadmat(out / "burst_lqg.mat", simplify_cells=True)
    for name in signals.files:
        assert np.array_equal(back[name], signals[name]), name
    assert back["indices"] == by_name and back["about"]["settings"]["q"] == about["settings"]["q"]


def test_a_trial_that_diverges_ends_the_run_with_a_sentence_and_exit_code_1(motion_file, tmp_path):
    out = tmp_path / "out"
    result = invoke(
        "run", "--motion", motion_file, "--controller", "lqg", "--scale", 1000, "--out", out
    )
    assert result.exit_code == 1, result.output
    told = " ".join(result.output.split())
    assert "Diverged: lqg on burst: Trial 0 diverged: command u of actuator" in told
    about = json.loads((out / "burst_lqg_run.json").read_text())
    assert about["status"].startswith("Trial 0 diverged") and len(about["volt_peak"]) == 2
    rows = csv.DictReader((out / "burst_lqg_indices.csv").open())
    assert {row["value"] for row in rows} == {"nan"}


def test_a_rate_at_which_the_controller_runs_away_is_refused(monkeypatch, capsys, tmp_path):
    words = ["run", "--motion", "kobe-like", "--controller", "lqg", "--fs", "512"]
    monkeypatch.setattr(sys, "argv", ["martths", *words, "--out", str(tmp_path / "x")])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 2
    assert "lowest sampling rate that holds is" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["run", "--motion", "no-such-motion", "--out", "x"], "no-such-motion"),
        (["run", "--motion", "elcentro-like", "--out", "x", "--fs", "-1"], "fs"),
        (["table4", "--records", "/no/such/folder"], "/no/such/folder"),
    ],
)
def test_user_errors_are_one_message_and_exit_code_2(words, message, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["martths", *words])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 2
    text = capsys.readouterr().err
    assert message in text
    assert "Traceback" not in text


def test_an_interrupted_write_leaves_what_was_there(tmp_path):
    path = tmp_path / "result.txt"
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt), atomic(path) as part:
        part.write_text("ne")
        raise KeyboardInterrupt
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.slow
def test_comparison_with_table_4(benchmark):
    found = compare_with_table4(benchmark, [burst()])
    rows = found.rows()
    assert len(rows) == 48
    assert {r["controller"] for r in rows} == {"lqg", "adfc"}
    for r in rows:
        assert r["deviation_percent"] == pytest.approx(
            100 * (r["martths_jax"] / r["published"] - 1)
        )
    assert found.to_csv().count("\n") == 49
    assert found.to_markdown().count("\n") == 26


def test_comparison_averages_over_motions():
    each = {"adfc": {"a": dict.fromkeys(published.TABLE4, 1.0)}}
    table = Comparison(("a",), {"adfc": each["adfc"]["a"]}, each).to_markdown()
    assert "| J2_1 | 1.00 | 3.9 | -74.4 % |" in table


def test_ctrl_c_twice_ends_at_once(monkeypatch):
    def interrupted():
        raise KeyboardInterrupt

    ended = []
    monkeypatch.setattr(cli, "app", interrupted)
    monkeypatch.setattr(os, "_exit", ended.append)
    handler = signal.getsignal(signal.SIGINT)
    try:
        with pytest.raises(SystemExit) as first:
            cli.main()
        os.kill(os.getpid(), signal.SIGINT)
        assert (first.value.code, ended) == (130, [130])
    finally:
        signal.signal(signal.SIGINT, handler)


def test_the_commands_start_without_what_only_some_need():
    """Each of these takes about half a second or more to import."""
    code = (
        "import sys, martths_jax, martths_jax.cli;"
        "sys.exit(', '.join({'scipy.signal', 'scipy.stats', 'matplotlib', 'plotly'}"
        " & set(sys.modules)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
