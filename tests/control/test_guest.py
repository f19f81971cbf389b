"""A controller in a file outside the package is a citizen: all commands take it, by its path."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import jax
import numpy as np
import pytest
from typer.testing import CliRunner

from martths_jax.cli import app
from martths_jax.study import open_study
from martths_jax.sweep import open_sweep

pytestmark = pytest.mark.slow
GUEST = Path(__file__).with_name("guest.py")
ROOT = Path(__file__).resolve().parents[2]
#: A process that is stopped for good after its second part.
KILLED = """
import os, sys
sys.path.insert(0, {root!r})
from martths_jax.campaign.stored import Stored
write, parts = Stored.write, []
def once(self, *args):
    write(self, *args)
    parts.append(args)
    if len(parts) == 2:
        os._exit(9)
Stored.write = once
from martths_jax.cli import main
sys.argv = ["martths", *{words!r}]
main()
"""


@pytest.fixture(scope="module", autouse=True)
def as_users_run_it():
    """A number a trial (T,) on (2, T) strokes: what controllers may write."""
    jax.config.update("jax_numpy_rank_promotion", "allow")
    yield
    jax.config.update("jax_numpy_rank_promotion", "raise")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with the controller's file and two short motions, apart from the package."""
    folder = tmp_path_factory.mktemp("guest")
    shutil.copy(GUEST, folder / "mine.py")
    time = np.arange(1500) / 1024
    for name, phase in (("one", 0.0), ("two", 1.0)):
        tone = np.sin(15 * time + phase) * np.exp(-time)
        rows = np.column_stack([time, tone])
        head = "time [s],acceleration [m/s^2]"
        np.savetxt(folder / f"{name}.csv", rows, delimiter=",", header=head, comments="")
    return folder


def martths(*words):
    done = CliRunner().invoke(app, [str(w) for w in words])
    assert done.exit_code == 0, done.output + repr(done.exception)
    return done.output


def settings(place, out, *more):
    motions = [w for name in ("one", "two") for w in ("--motion", place / f"{name}.csv")]
    return [*motions, "--scale", 1, "--out", place / out, "--quiet", *more]


@pytest.fixture(scope="module")
def study(place):
    """The study, killed after its second part and gone on with."""
    words = ["study", *settings(place, "study", "--trials", 6)]
    words += ["--controller", f"{place}/mine.py:Lead", "--controller", "passthrough",
              "--controller", f"slow={place}/mine.py{{lead=0.01}}"]  # fmt: skip
    code = KILLED.format(root=str(ROOT), words=[str(w) for w in words])
    killed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert killed.returncode == 9, killed.stderr
    assert len(list((place / "study" / "parts").rglob("*.npz"))) == 2
    martths(*words)
    return open_study(place / "study")


def test_a_study_that_was_killed_goes_on(study, place):
    value = study.dataset.value.sel(index="J2_1", trial=0).mean("motion")
    assert list(value.controller.values) == ["lead", "passthrough", "slow"]
    lead, none, slow = value.values
    assert lead < slow < none, "half the lead is half the way"
    about = json.loads(study.dataset.attrs["controllers"])
    assert about["lead"] == {"kind": "lead", "label": "Lead", "look": None,
                             "paper": "proportional lead, a test's own"}  # fmt: skip
    assert about["slow"]["label"] == "slow"
    identity = json.loads((place / "study" / "run.json").read_text())["identity"]["controller"]
    assert len(identity["lead"]["sha256"]) == 64 and identity["slow"]["lead"] == 0.01
    text = study.summary().markdown()
    assert "slow versus lead" in text, "two settings of one kind are compared"
    assert study.signals("one", "lead").v.attrs["units"] == "mm/s"


def test_tables_figures_and_report(study, place):
    assert "| Lead, here |" in martths("table", place / "study").replace("**", "")
    martths("figures", place / "study", "--only", "fig14", "--dpi", 50)
    assert (place / "study" / "figures" / "fig14b_motions_lead.png").is_file()
    martths("report", place / "study", "--only", "fig14")
    assert "Lead" in (place / "study" / "report.html").read_text("utf-8")


def test_it_is_replayed_later_and_elsewhere(study, place, tmp_path):
    moved = tmp_path / "moved"
    shutil.copytree(place / "study", moved)
    hidden = place / "mine.py"
    hidden.rename(place / "gone.py")
    try:
        text = martths("replay", moved, "--trial", 3, "--no-report")
    finally:
        (place / "gone.py").rename(hidden)
    assert "every index has the study's bits" in text
    assert 3 in open_study(moved).signals("one", "lead").trial.values


def test_another_file_is_another_study(study, place):
    edited = place / "edited" / "mine.py"
    edited.parent.mkdir()
    edited.write_text((place / "mine.py").read_text().replace("300.0", "200.0"))
    words = settings(place, "study", "--trials", 6, "--controller", f"{edited}:Lead")
    done = CliRunner().invoke(app, ["study", *map(str, words)])
    assert done.exit_code != 0
    assert "another configuration" in str(done.exception) and "sha256" in str(done.exception)


def test_shares_become_one(study, place):
    words = settings(place, "shares", "--trials", 6, "--controller", f"{place}/mine.py:Lead")
    for share in ("1/2", "2/2"):
        martths("study", *words, "--shard", share)
    martths("merge", place / "shares", "--quiet")
    one = open_study(place / "shares").dataset.value
    np.testing.assert_array_equal(one.values[0], study.dataset.value.sel(controller="lead").values)


def test_a_sweep_over_its_own_parameter(study, place):
    words = settings(place, "sweep", "--trials", 6, "--controller", f"{place}/mine.py")
    martths("sweep", "--axis", "lead=0.01,0.02", "--axis", "corner=300", "--no-figures", *words)
    swept = open_sweep(place / "sweep").dataset
    assert swept.lead.attrs["units"] == "s" and swept.lead.attrs["long_name"] == "lead tau"
    found = swept.value.sel(controller="lead", corner=300)
    for lead, name in ((0.02, "lead"), (0.01, "slow")):
        np.testing.assert_allclose(
            found.sel(lead=lead).values, study.dataset.value.sel(controller=name).values, rtol=1e-9
        )


def test_sensitivity_and_table_four(place):
    martths("sensitivity", "--trials", 4, "--no-figures",
            *settings(place, "sensitivity", "--controller", f"{place}/mine.py:Lead"))  # fmt: skip
    assert (place / "sensitivity" / "sensitivity.nc").is_file()
    text = martths("table4", "--motion", place / "one.csv", "--scale", 1, "--controller",
                   f"{place}/mine.py:Lead", "--out", place / "table4")  # fmt: skip
    rows = (place / "table4" / "table4.csv").read_text().splitlines()
    assert rows[1].startswith("lead,J1_1,") and rows[1].endswith(",,"), "no paper prints it"
    assert "–" in text


def test_it_can_be_tuned(place):
    martths("tune", "--controller", f"{place}/mine.py:Lead", "--objective", "j2", "--trials", 2,
            "--motion", place / "one.csv", "--check", place / "two.csv", "--scale", 1,
            "--fresh-plants", 2, "--steps", 6, "--out", place / "tuned")  # fmt: skip
    state = json.loads((place / "tuned" / "state.json").read_text())
    objective = [row["objective"] for row in state["history"] if row["accepted"]]
    assert min(objective) < 0.9 * objective[0]
    assert set(json.loads((place / "tuned" / "design.json").read_text())) >= {"gain", "lead"}
