"""Studies of many trials: the page shows a sample and says so, figures and tables are of all."""

from __future__ import annotations

import json
from html.parser import HTMLParser

import numpy as np
import pytest

from martths_jax.figures import drawings, open_source, plants, spread
from martths_jax.plant import plant_from_hz
from martths_jax.report import page, payload, study_tables, write_report
from martths_jax.study import open_study
from martths_jax.study.summary import number
from tests.figures.small_study import LOST, MOTIONS, TRIALS, enlarge

pytestmark = pytest.mark.slow

MANY = 4000
#: Room for the trials of a study with two controllers and two motions.
SHOWN = payload.RUNS // 4


@pytest.fixture(scope="module")
def folder(study_folder, tmp_path_factory):
    return enlarge(study_folder, tmp_path_factory.mktemp("large") / "run", MANY)


@pytest.fixture(scope="module")
def written(folder):
    return write_report(folder, folder / "report.html", only=["ecdf"]).read_text("utf-8")


class Scripts(HTMLParser):
    """Texts of a page's scripts that have an id."""

    def __init__(self, text: str):
        super().__init__()
        self.found, self.open = {}, None
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.open = dict(attrs).get("id") if tag == "script" else None

    def handle_data(self, data):
        if self.open:
            self.found[self.open] = self.found.get(self.open, "") + data


def test_the_page_shows_a_sample_and_says_so(folder, written):
    assert len(written.encode()) < 10e6
    assert f"{SHOWN} of {MANY + 1} trials are in this table" in written
    assert "Of each curve 2000 of 4000 trials drawn" in written
    data = json.loads(Scripts(written).found["data"])
    stored = open_study(folder).dataset
    trials = np.array(data["trials"])
    assert trials.size == np.unique(trials).size == SHOWN and np.all(np.diff(trials) > 0)
    for cell in data["cells"]:
        where = {"controller": cell["controller"], "motion": cell["motion"]}
        exact = stored.value.sel(**where, index="J5_4").values[trials]
        found = np.array([np.nan if x is None else x for x in cell["values"][8]])
        np.testing.assert_allclose(found, exact, rtol=1e-5)
        np.testing.assert_array_equal(cell["status"], stored.status.sel(**where).values[trials])


def test_what_is_in_the_sample(folder, study_folder):
    study = open_study(folder)
    kept = payload.kept_signals(study)
    chosen = payload.chosen_trials(study, kept, runs=400)
    np.testing.assert_array_equal(chosen, payload.chosen_trials(study, kept, runs=400))
    assert chosen.size == 100
    assert {0, *(int(t) for cell in kept for t in cell.stored.trial.values)} <= set(chosen.tolist())
    # A thirty-first of the trials is lost; up to a quarter of the sample is.
    assert 25 <= np.sum(chosen % (TRIALS + 1) == LOST) < 40
    study.dataset.attrs["seed"] = 2
    assert set(payload.chosen_trials(study, kept, runs=400).tolist()) != set(chosen.tolist())
    small = open_study(study_folder)
    np.testing.assert_array_equal(payload.chosen_trials(small, []), np.arange(TRIALS + 1))


def test_tables_and_curves_are_those_of_all_trials(folder):
    source = open_source(folder)
    cell = source.values("adfc", MOTIONS[0], "J5_4")
    assert cell.size == MANY
    rows = study_tables(source.study.dataset)[1].rows
    assert rows[8][-1] == number(float(np.percentile(cell, 95)))
    ((_, drawing),) = drawings(source, ["ecdf"])
    mine = (np.array(drawing.data["index"]) == "J5_4") & (
        np.array(drawing.data["controller"]) == "adfc"
    )
    value, share = (np.array(drawing.data[k])[mine] for k in ("value", "share"))
    assert value.size == spread.STEPS
    for at in (0, 999, -1):
        assert share[at] == np.mean(cell <= value[at])
    assert "2000 of 4000 trials" in drawing.figure._supxlabel.get_text()


def test_bands_do_not_depend_on_the_blocks(study_folder, monkeypatch):
    """The phase goes on from block to block as if there were one."""
    drawn = plant_from_hz(np.asarray(open_study(study_folder).dataset.plant_hz.values))

    def bands():
        found = plants._magnitude_and_phase(drawn, 2, plants._percentiles)
        return [*found, plants._plant_delay(drawn, 2, 1024.0, plants._percentiles)]

    whole = bands()
    monkeypatch.setattr(plants, "BLOCK", 4 * 2 * len(drawn))
    parts = bands()
    assert whole[1].min() < -185  # degrees, from the last three frequencies on
    for a, b in zip(whole, parts, strict=True):
        np.testing.assert_allclose(b, a, rtol=1e-12, atol=1e-12)


def test_histories_take_the_room_that_is_left(study_folder, monkeypatch):
    study = open_study(study_folder)
    whole = page.compose(study, "")
    assert json.loads(Scripts(whole).found["stored"])[0]["signals"][0]["stride"] == 1
    bound = len(whole.encode()) - 300_000
    monkeypatch.setattr(page, "SIZE", bound)
    monkeypatch.setattr(page, "LEAST", 1000)
    text = page.compose(study, "")
    assert len(text.encode()) < bound + 10_000  # the page itself is not counted
    assert json.loads(Scripts(text).found["stored"])[0]["signals"][0]["stride"] > 1


def test_a_page_s_data_hold_no_markup(written):
    """A comment in a name would make the rest of the page a script."""
    found = Scripts(written).found
    assert json.loads(found["data"])["cells"][1]["motion"] == MOTIONS[1]
    for name in ("data", "stored"):
        assert "<" not in found[name] and json.loads(found[name])
