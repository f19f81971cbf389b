"""What MATLAB gets: a study's results with its signals in a file of its own format."""

import numpy as np
import pytest
import typer
from scipy.io import loadmat
from typer.testing import CliRunner

from martths_jax import InputError
from martths_jax.campaign.formats import FORMATS, Format
from martths_jax.cli import app
from martths_jax.cli.export import command
from martths_jax.study import open_study
from tests.figures.small_study import MOTIONS


def export(folder, *words):
    return CliRunner().invoke(app, ["export", str(folder), *map(str, words)])


def test_the_matlab_file_holds_the_signals(study_folder, tmp_path):
    done = export(study_folder, "--mat", tmp_path / "a.mat")
    assert done.exit_code == 0, done.output
    back = loadmat(tmp_path / "a.mat", simplify_cells=True)
    study = open_study(study_folder)
    assert [(s["motion"], s["controller"]) for s in back["signals"]] == [
        (motion, controller) for motion in MOTIONS for controller in ("lqg", "adfc")
    ]
    for stored in back["signals"]:
        own = study.signals(stored["motion"], stored["controller"])
        shared = study.signals(stored["motion"])
        assert list(stored["role"]) == list(own.role.values)
        for name in ("trial", "x_a", "x_m", "x_hat", "u", "num", "est", "force"):
            assert np.array_equal(stored[name], own[name].values), name
        for name in ("time", "ground", "reference"):
            assert np.array_equal(stored[name], shared[name].values), name
        has = stored["controller"] == "adfc"
        assert np.size(stored["C_A"]) == (own.C_A.size if has else 0)
    assert list(back["signal_dims"]["x_m"]) == ["kept", "time", "actuator"]
    assert "x_a" in back["signal_units"]
    assert np.array_equal(back["value"], study.dataset.value, equal_nan=True)


def test_signals_may_be_left_out(study_folder, tmp_path):
    assert export(study_folder, "--mat", tmp_path / "b.mat", "--no-signals").exit_code == 0
    assert "signals" not in loadmat(tmp_path / "b.mat")


def test_a_matlab_file_beyond_its_format_is_refused(study_folder, tmp_path, monkeypatch):
    monkeypatch.setattr("martths_jax.campaign.formats.mat.MOST_BYTES", 100_000)
    done = export(study_folder, "--mat", tmp_path / "a.mat")
    assert isinstance(done.exception, InputError) and not list(tmp_path.iterdir())
    with pytest.raises(InputError, match="Variable `signals` is too large"):
        raise done.exception


def test_a_format_is_one_definition_and_an_option_of_its_own(study_folder, tmp_path):
    """A guest's format reads the same results as ours, and the command says so in its help."""

    def write(done, path, signals):
        kept = len(list(done.stored_signals())) if signals else 0
        path.write_text(f"{done.dataset.sizes['trial']} trials, {kept} signals")

    own = typer.Typer()
    own.command()(command([*FORMATS, Format("words", "A sentence about the study", write)]))
    file = tmp_path / "words.txt"
    for more, kept in (([], 2 * len(MOTIONS)), (["--no-signals"], 0)):
        done = CliRunner().invoke(own, [str(study_folder), "--words", str(file), *more])
        assert done.exit_code == 0, done.output
        trials = open_study(study_folder).dataset.sizes["trial"]
        assert file.read_text() == f"{trials} trials, {kept} signals"
    assert "A sentence about the study" in CliRunner().invoke(own, ["--help"]).output
    refused = CliRunner().invoke(own, [str(study_folder)])
    assert "--csv FILE, --plants FILE or --words FILE" in str(refused.exception)
