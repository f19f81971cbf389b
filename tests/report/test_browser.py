"""The report in a real headless Chromium: loads, sorts, filters, zooms, picks, fits on a phone."""

from __future__ import annotations

import io
import os
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from martths_jax.report import write_report
from martths_jax.study import open_study
from tests.figures.small_study import LOST, MOTIONS, TRIALS
from tests.report.chromium import Page, find_chromium
from tests.tools import missing

pytestmark = pytest.mark.slow

RUNS = 2 * len(MOTIONS) * (TRIALS + 1)
PAGE = 50
READY = "document.documentElement?.dataset.ready === 'yes'"
#: Cells of a column (from 0) of the table of all trials.
COLUMN = "[...document.querySelectorAll('#all tbody tr')].map(r => r.children[{}].textContent)"


@pytest.fixture(scope="module")
def report(study_folder, tmp_path_factory) -> Path:
    return write_report(
        study_folder, tmp_path_factory.mktemp("report") / "report.html", only=["fig14a", "frame"]
    )


@pytest.fixture(scope="module")
def page(report, tmp_path_factory):
    executable = find_chromium()
    if executable is None:
        missing("no Chromium was found", "install one or set MARTHS_CHROMIUM to its path")
    page = Page(executable, tmp_path_factory.mktemp("profile"))
    page.resize(1400, 900)
    page.open(report, READY)
    yield page
    page.close()


def set_filter(page, column: str, text: str) -> None:
    page.evaluate(
        f"(() => {{ const i = document.querySelector('input[aria-label=\"filter {column}\"]');"
        f"i.value = {text!r}; i.dispatchEvent(new Event('input')); }})()"
    )


def test_loads_without_errors_and_without_network(page, report):
    page.evaluate("new Promise(r => setTimeout(r, 300))")
    assert page.complaints == []
    outside = [u for u in page.requests if not u.startswith(("file:", "data:", "about:", "blob:"))]
    assert outside == []
    assert page.evaluate("document.querySelectorAll('#plot .xy path.js-line').length") > 0
    # Nothing offers to upload the chart.
    buttons = page.evaluate(
        "[...document.querySelectorAll('.modebar-btn')].map(b => b.dataset.title)"
    )
    assert len(buttons) == 6 and not any("hare" in title for title in buttons)
    broken = "[...document.images].filter(i => i.complete && i.naturalWidth === 0).length"
    assert page.evaluate(broken) == 0
    assert report.stat().st_size < 10e6


def test_hostile_names_stay_text(page):
    assert page.evaluate("document.querySelectorAll('quick').length") == 0
    # Its own three scripts and the one that it unpacks: no name has opened or swallowed one.
    assert page.evaluate("document.scripts.length") == 5
    assert MOTIONS[1] in page.evaluate(
        "[...document.querySelectorAll('#pick-motion option')].map(o => o.textContent)"
    )


def test_sorting_both_ways(page, study_folder):
    page.evaluate("document.querySelector('#clear').click()")
    assert page.evaluate("document.querySelector('#count').textContent") == f"{RUNS} of {RUNS} runs"
    stored = open_study(study_folder).dataset.value.sel(index="J2_1").values.ravel()
    third = "#all thead tr:first-child th:nth-child(7) button"  # J2_1
    finite = np.sort(stored[np.isfinite(stored)])
    assert finite.size == RUNS - 1
    for expected in (finite[:PAGE], finite[::-1][:PAGE]):
        page.click(third)
        seen = np.array([float(x) for x in page.evaluate(COLUMN.format(6))])
        np.testing.assert_allclose(seen, expected, rtol=6e-4)
    assert page.evaluate("document.querySelector('th[aria-sort=descending]').cellIndex") == 6
    # The diverged trial has no number: last, whichever way.
    for _ in range(2):
        page.evaluate("document.querySelector('#next').click()")
    assert page.evaluate(COLUMN.format(6))[-1] == "–"
    assert page.evaluate(COLUMN.format(2))[-1] == str(LOST)
    page.click(third)
    assert page.evaluate(COLUMN.format(6))[-1] == "–"


def test_filters_by_number_and_text(page, study_folder):
    stored = open_study(study_folder).dataset.value.sel(controller="adfc", index="J2_1").values
    bound = float(f"{np.median(stored):.3g}")
    set_filter(page, "controller", "adfc")
    set_filter(page, "J2_1", f"<{bound}")
    found = page.evaluate("document.querySelector('#count').textContent")
    assert found == f"{int(np.sum(stored < bound))} of {RUNS} runs"
    set_filter(page, "J2_1", f"{bound} .. 1e9")
    found = page.evaluate("document.querySelector('#count').textContent")
    assert found == f"{int(np.sum(stored >= bound))} of {RUNS} runs"
    set_filter(page, "J2_1", "bad")
    assert page.evaluate("document.querySelectorAll('[aria-invalid=true]').length") == 1
    page.evaluate("document.querySelector('#clear').click()")


def test_zoom_is_shared_and_refines(page):
    page.evaluate("document.querySelector('#plot').scrollIntoView()")
    box = page.evaluate(
        "(() => { const r = document.querySelector('#plot .nsewdrag').getBoundingClientRect();"
        "return [r.x, r.y, r.width, r.height]; })()"
    )
    x, y, width, height = box
    page.drag((x + 0.25 * width, y + height / 2), (x + 0.5 * width, y + height / 2))
    page.wait("plot.layout.xaxis.range[0] > 0.1")
    low, high = page.evaluate("plot.layout.xaxis.range")
    whole = page.evaluate("JSON.parse(document.querySelector('#stored').textContent)[0]")
    end = (whole["samples"] - 1) * whole["dt"]
    assert low == pytest.approx(0.25 * end, abs=0.02 * end)
    assert high == pytest.approx(0.5 * end, abs=0.02 * end)
    # Every panel hangs on the one time axis, and only the window's samples are drawn.
    assert page.evaluate("[...new Set(plot.data.map(t => t.xaxis))]") == ["x"]
    assert page.evaluate("new Set(plot.data.map(t => t.yaxis)).size") >= 4
    assert page.evaluate("Math.max(...plot.data.map(t => t.x.at(-1)))") < high + 0.02 * end
    page.click("#zoom-out")
    page.wait("plot.layout.xaxis.range[0] === 0")
    assert page.evaluate("plot.data[0].x.at(-1)") == pytest.approx(end, rel=0.01)


def test_drawn_history_is_the_stored_one(page, study_folder):
    page.evaluate(
        "(() => { const s = document.querySelector('#pick-controller'); s.value = 'adfc';"
        "s.dispatchEvent(new Event('change')); })()"
    )
    stored = open_study(study_folder).signals(MOTIONS[0], "adfc").isel(kept=0)
    for i in (1, 2):
        drawn = np.array(page.evaluate(f"plot.data.find(t => t.name === 'measured {i}').y"))
        exact = stored.x_m.values[:, i - 1]
        assert drawn.size == exact.size
        np.testing.assert_allclose(drawn, exact, atol=1e-4 * np.abs(exact).max())
    assert page.evaluate("plot.data.filter(t => t.legendgroup.startsWith('coef')).length") == 16


def test_a_trial_can_be_picked(page):
    page.evaluate("document.querySelector('#clear').click()")
    set_filter(page, "controller", "lqg")
    set_filter(page, "motion", "quick")
    page.click("#all tbody tr.kept:last-child, #all tbody tr.kept")
    trial = page.evaluate("document.querySelector('#all tr.shown').children[2].textContent")
    note = page.evaluate("document.querySelector('#plot-note').textContent")
    assert note.startswith(f"lqg on {MOTIONS[1]}, trial {trial} ")
    page.click("#all tbody tr:not(.kept)")
    assert "martths replay" in page.evaluate("document.querySelector('#plot-note').textContent")
    page.evaluate("document.querySelector('#clear').click()")
    assert page.complaints == []


@pytest.mark.parametrize(("width", "height", "mobile"), [(390, 844, True), (1400, 900, False)])
def test_screenshots(page, report, width, height, mobile):
    page.resize(width, height, mobile)
    page.open(report, READY)
    # Nothing sticks out sideways; wide tables scroll inside their frames.
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    assert page.evaluate("document.querySelector('#plot .main-svg').clientWidth") <= width
    for part in ("ends", "histories", "trials", "figures"):
        page.evaluate(f"document.querySelector('#{part}').scrollIntoView()")
        page.evaluate("new Promise(r => requestAnimationFrame(() => setTimeout(r, 100)))")
        picture = page.screenshot()
        pixels = matplotlib.image.imread(io.BytesIO(picture))
        assert pixels.shape[:2] == (height, width)
        # Neither blank nor a wall of ink.
        assert 0.005 < np.mean(pixels[..., :3].min(axis=-1) < 0.8) < 0.6
        if folder := os.environ.get("MARTHS_SCREENSHOTS"):
            Path(folder).mkdir(parents=True, exist_ok=True)
            (Path(folder) / f"{part}_{width}.png").write_bytes(picture)
    assert page.complaints == []
