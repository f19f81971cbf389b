"""Tables beside the published ones, and trials run again."""

from __future__ import annotations

import csv
import io

import matplotlib.image
import numpy as np
import pytest

from martths_jax import published
from martths_jax.errors import InputError
from martths_jax.indices import NAMES
from martths_jax.report import render, replay, study_tables, write_report
from martths_jax.study import open_study, run_study
from tests.engine.motions import burst
from tests.figures.small_study import LOST, MOTIONS


@pytest.fixture(scope="module")
def dataset(study_folder):
    return open_study(study_folder).dataset


def test_table_four_puts_the_paper_beside_us(dataset):
    table = study_tables(dataset)[0]
    assert len(table.rows) == 24
    row = dict(zip(table.columns, table.rows[NAMES.index("J2_2")], strict=True))
    ours = float(dataset.value.sel(controller="adfc", trial=0, index="J2_2").mean())
    paper = published.TABLE4["J2_2"][published.ADFC]
    assert float(row["ADFC, paper"]) == paper
    assert float(row["ADFC, here"]) == pytest.approx(ours, rel=1e-3)
    assert row["experiment (LQG)"] == "13.2"
    deviations = [i for i, c in enumerate(table.columns) if c == "deviation"]
    cell = table.rows[NAMES.index("J2_2")][deviations[1]]
    assert cell == f"{round(100 * (ours / paper - 1)):+d} %"


def test_csv_holds_every_number_in_full(dataset):
    rows = list(csv.DictReader(io.StringIO(render(dataset, "csv"))))
    (found,) = [
        r for r in rows
        if (r["motion"], r["controller"], r["index"], r["statistic"])
        == (MOTIONS[0], "lqg", "J8_26", "P95")
    ]  # fmt: skip
    cell = dataset.value.sel(controller="lqg", motion=MOTIONS[0], index="J8_26").values[1:]
    assert float(found["value"]) == np.nanpercentile(cell, 95)
    assert np.isnan(cell[LOST - 1])


def test_latex_is_escaped_and_balanced(dataset):
    text = render(dataset, "tex")
    assert text.count(r"\begin{tabular}") == text.count(r"\end{tabular}") == 1 + len(MOTIONS)
    assert r"short \& <!--<script><quick>" in text and r"$J_{10,27}$ [\%]" in text
    body = [line for line in text.splitlines() if line.startswith("$J_")]
    assert len(body) == 24 * (1 + len(MOTIONS))
    assert all("%" not in line.replace(r"\%", "") for line in body)


def test_unknown_format_is_refused(dataset):
    with pytest.raises(InputError, match="md, tex, csv, but got 'html'"):
        render(dataset, "html")


@pytest.mark.slow
def test_replay_gives_the_study_s_bits_and_keeps_the_signals(tmp_path):
    motion, folder = burst(0.15), tmp_path / "run"
    motion_file = tmp_path / "shake.csv"
    time = np.arange(motion.acceleration.size) / 1024
    np.savetxt(motion_file, np.c_[time, motion.acceleration], delimiter=",")
    settings = {"trials": 6, "controllers": ("passthrough",), "units": "m/s2", "devices": 1}
    run_study(motions=(str(motion_file),), out=str(folder), **settings)
    done = replay(folder, 4)
    assert done.differing == []
    stored = done.study.signals("shake", "passthrough")
    at = stored.trial.values.tolist().index(4)
    assert "kept" in str(stored.role.values[at])
    error, target = (stored.x_m - stored.x_a)[at], stored.x_a[at]
    value = 100 * np.sqrt(np.sum(error**2, axis=0) / np.sum(target**2, axis=0))
    exact = done.study.dataset.value.sel(trial=4, index=["J2_1", "J2_2"]).values.ravel()
    np.testing.assert_allclose(value, exact, rtol=1e-9)
    # A second replay keeps the first one's trial; the report offers both.
    again = replay(folder, 5).study.signals("shake", "passthrough").trial.values
    assert {4, 5} <= set(again.tolist())
    text = write_report(folder, only=["frame"]).read_text("utf-8")
    assert '"trial":4,"role":' in text and '"trial":5,"role":' in text
    with pytest.raises(InputError, match=r"from 0 to 6, .* got 7"):
        replay(folder, 7)
    motion_file.unlink()
    with pytest.raises(InputError, match="cannot be run again here"):
        replay(folder, 3)


def test_a_tuning_beside_the_study(study_folder, tmp_path):
    tuned = tmp_path / "tuned"
    tuned.mkdir()
    (tuned / "design.json").write_text('{"controller": "lqg", "ended": "done", "e1": 3.5}')
    (tuned / "comparison.csv").write_text("index,start,tuned\nJ2_1,5.25,4.125\n")
    matplotlib.image.imsave(tuned / "convergence.png", np.zeros((4, 4)))
    (tuned / "large.png").write_bytes(bytes(5_000_000))
    path = write_report(study_folder, tmp_path / "r.html", only=["frame"], beside=[tuned])
    page = path.read_text("utf-8")
    assert '<a href="#beside">' in page and "Tuning of lqg" in page
    assert "<td>J2_1</td><td>5.250</td><td>4.125</td>" in page
    assert 'alt="convergence"' in page
    assert 'alt="large"' not in page and "large.png" in page


def test_a_folder_of_another_kind_beside_the_study(study_folder, tmp_path):
    with pytest.raises(InputError, match="holds no finished sweep"):
        write_report(study_folder, tmp_path / "r.html", only=["frame"], beside=[tmp_path])
