"""``martths motions`` and the motion options of other commands."""

import subprocess
import sys

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from martths_jax.campaign.config import make_config, read_toml
from martths_jax.cli import app as main_app
from martths_jax.cli import motion_options as options
from martths_jax.cli.motions import app
from martths_jax.errors import InputError

runner = CliRunner()


@pytest.fixture(autouse=True)
def wide_terminal_and_own_cache(tmp_path_factory, monkeypatch):
    monkeypatch.setenv("MARTHS_CACHE", str(tmp_path_factory.getbasetemp() / "cache"))
    monkeypatch.delenv("MARTHS_RECORDS", raising=False)
    monkeypatch.setattr("martths_jax.cli.motions.console.width", 200)


@pytest.mark.slow
def test_list(tmp_path):
    (tmp_path / "mine.csv").write_text("0,0\n0.01,1\n0.02,0\n")
    result = runner.invoke(app, ["--records", str(tmp_path), "--units", "g"])
    assert result.exit_code == 0, result.output
    for word in ("elcentro-like", "kobe-like", "morganhill-like", "mine", "D5-95 [s]"):
        assert word in result.output


def test_show(tmp_path):
    out = tmp_path / "fig.png"
    result = runner.invoke(app, ["show", "elcentro-like", "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert out.read_bytes().startswith(b"\x89PNG")
    result = runner.invoke(app, ["show", "elcentro-like", "--out", str(tmp_path / "fig.xyz")])
    assert isinstance(result.exception, InputError)
    assert "fig.xyz" in str(result.exception)


@pytest.mark.slow
def test_make(tmp_path):
    arguments = ["make", "--like", "elcentro", "--count", "1", "--seed", "3"]
    result = runner.invoke(app, [*arguments, "--out", str(tmp_path / "made")])
    assert result.exit_code == 0, result.output
    assert sorted(p.name for p in (tmp_path / "made").iterdir()) == [
        "elcentro-like-s3-001.csv",
        "ensemble.json",
    ]


def test_options_of_other_commands():
    command = typer.Typer()
    got = []

    @command.command()
    def run(
        motion: options.Motions,
        records: options.Records = None,
        scale: options.Scale = None,
        pga: options.Pga = None,
        sa: options.Sa = None,
        units: options.Units = None,
        resample: options.Resample = "linear",
    ):
        got.extend(options.load_all(motion, records, scale, pga, sa, units, resample))

    result = runner.invoke(command, ["--motion", "elcentro-like", "--pga", "0.2g"])
    assert result.exit_code == 0, result.output
    assert np.abs(got[0].acceleration).max() == pytest.approx(0.2 * 9.80665, rel=0.03)
    result = runner.invoke(command, ["--motion", "elcentro-like", "--scale", "1", "--sa", "1g@2Hz"])
    assert isinstance(result.exception, InputError)


def test_dt_and_variable_reach_every_command(tmp_path):
    rows = "\n".join(f"{k % 7},{k % 5 - 2},{k % 3}" for k in range(40))
    (tmp_path / "three.csv").write_text("NS [g],EW [g],UD [g]\n" + rows)
    given = ["--records", str(tmp_path)]
    result = runner.invoke(app, given)
    assert "--variable" in " ".join(result.output.split())
    result = runner.invoke(app, [*given, "--variable", "EW", "--dt", "0.02"])
    assert result.exit_code == 0 and "2.000" in result.output, result.output
    for name in ("study", "sweep", "sensitivity", "run", "table4", "tune", "motions"):
        told = runner.invoke(main_app, [name, "--help"], env={"COLUMNS": "200"})
        assert told.exit_code == 0
        for option in ("--units", "--dt", "--variable"):
            assert option in told.output, (name, option)


@pytest.mark.parametrize("text", [r"C:\Users\me\a.csv", r"C:\temp\new.csv"])
def test_windows_paths_in_toml(tmp_path, text):
    path = tmp_path / "study.toml"
    path.write_text(f'[motions]\nmotions = ["{text}"]\n')
    with pytest.raises(InputError, match="single quotes"):
        read_toml(path)
    path.write_text(f"[motions]\nmotions = ['{text}']\nvariable = 2\ndt = 0.01\n")
    assert read_toml(path)["motions"] == [text]
    assert make_config(path).variable == 2


def test_importing_motions_leaves_matplotlib_alone():
    code = "import sys, martths_jax.motions as m; assert 'matplotlib' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
