"""Tables, figures and pages of other problems: one actuator, three, and what is printed of them."""

from __future__ import annotations

import base64
import json
import re
from functools import cache

import numpy as np
import pytest
from scipy import linalg

from martths_jax.figures import drawings, figure_list, open_source
from martths_jax.figures.plants import FREQUENCY
from martths_jax.figures.storeys import modes_of
from martths_jax.figures.style import DOUBLE, SINGLE, index_label
from martths_jax.indices import NAMES, groups_of
from martths_jax.problem import find_problem
from martths_jax.problem.uniaxial.structure import CASES, K
from martths_jax.report import render, study_tables, write_report
from martths_jax.study import open_study
from martths_jax.study.summary import summarise
from tests.figures import any_study
from tests.figures.any_study import MOTION, TRIALS, invented, three_actuators

COMMON = {"fig12_synchronisation_actuators", "fig13_synchronisation_interface", "ecdf", "delay",
          "fig14a_controllers", "fig15_histograms", "bode", f"strokes_{MOTION}"}  # fmt: skip


@pytest.fixture(scope="module")
def one(tmp_path_factory):
    """A study of case 3 of the uniaxial benchmark: its own controller, and another."""
    folder = tmp_path_factory.mktemp("one") / "study"
    return invented(folder, "uniaxial", 3, ("passthrough", "pi-lead"))


@pytest.fixture(scope="module")
def three(tmp_path_factory):
    """A study of three actuators, six outputs and two uncertain parameters."""
    with three_actuators():
        folder = tmp_path_factory.mktemp("three") / "study"
        yield invented(folder, "three", None, ("passthrough", "adfc"))


@pytest.fixture(params=["one", "three"])
def study(request):
    """One after the other."""
    return request.getfixturevalue(request.param)


@cache
def drawn(folder):
    """All drawings of a study, laid out, but for the one whose 36 axes take long."""
    found = {}
    for name, drawing in drawings(open_source(folder)):
        drawing.figure.set_dpi(40)
        if len(drawing.figure.axes) < 36:
            drawing.figure.draw_without_rendering()
        found[name] = drawing
    return found


def test_every_figure_that_is_offered_is_drawn(one, three):
    tails = {"fig11_coefficients_pi-lead", "fig14b_motions_passthrough", "fig14b_motions_pi-lead"}
    assert set(figure_list(open_source(one))) == COMMON | tails | {"frame"}
    tails = {"fig11_coefficients", "fig14b_motions_passthrough", "fig14b_motions"}
    assert set(figure_list(open_source(three))) == COMMON | tails
    for folder, actuators in ((one, ["1"]), (three, list(any_study.NAMES))):
        found = drawn(folder)
        strokes = found[f"strokes_{MOTION}"].figure
        heads = [a.get_ylabel().split(":")[0] for a in strokes.axes if a.get_ylabel()]
        assert heads == [f"actuator {name}" for name in actuators for _ in (0, 1)]
        widths = {round(d.figure.get_figwidth() * 25.4, 6) for d in found.values()}
        assert widths <= {SINGLE, DOUBLE}
        for drawing in found.values():
            assert len({len(column) for column in drawing.data.values()}) == 1


def test_histories_are_the_stored_signals_under_their_names(study):
    source = open_source(study)
    stored = source.study.signals(MOTION, "passthrough").isel(kept=0)
    found = drawn(study)
    units = {"m": "mm", "rad": "mrad"}
    for i, name in enumerate(source.layout.actuators):
        for figure in (f"strokes_{MOTION}", "fig12_synchronisation_actuators"):
            data = found[figure].data
            np.testing.assert_array_equal(data[f"target_{name}_passthrough_mm"], stored.x_a[:, i])
            np.testing.assert_array_equal(data[f"measured_{name}_passthrough_mm"], stored.x_m[:, i])
    data = found["fig13_synchronisation_interface"].data
    for i, unit in enumerate(source.layout.output_units[: len(source.layout.interface)]):
        column = f"numerical_{i + 1}_passthrough_{units[unit]}"
        np.testing.assert_allclose(data[column], 1e3 * stored.num[:, i])
    titles = [a.get_title() for a in found["fig13_synchronisation_interface"].figure.axes]
    if len(source.layout.interface) > 1:
        assert [t.rpartition(", ")[2] for t in titles[:3]] == ["DOF a", "DOF b", "DOF c"]
    else:
        assert {t.rpartition(", ")[2] for t in titles} == {"translation"}


def test_a_controller_that_lost_every_trial_leaves_the_figures_of_the_others(tmp_path):
    folder = invented(tmp_path / "study", "uniaxial", 1, ("passthrough", "pi-lead"), lost=True)
    found = drawn(folder)
    assert set(found) == set(figure_list(open_source(folder)))
    assert np.isnan(found["delay"].data["passthrough_1_ms"]).all()
    assert np.isfinite(found["delay"].data["pi-lead_1_ms"]).any()
    assert np.isnan(found["fig14b_motions_passthrough"].data["P50"]).all()


def test_coefficients_belong_to_their_derivative(three):
    data = drawn(three)["fig11_coefficients"].data
    step = 1e3 / 1024
    for stroke, moved in enumerate(any_study.NAMES):
        for actuator, called in enumerate(any_study.NAMES):
            expected = (10 * (4 * stroke + 2) + actuator) * step**2
            np.testing.assert_allclose(data[f"a{called}_x{moved}_d2_ms2"], expected)


def test_bode_bands_and_delays_are_those_of_the_drawn_plants(three):
    """Lags written out: 1 / ((1 - s / p) (1 + s / 60)), gain / ((1 + s / 30) (1 + s / 80)) [Hz]."""
    draws = open_study(three).dataset.draw.values
    pole, gain = -9.0 * (1 + 0.05 * draws[:, 0]), 0.05 * (1 + 0.1 * draws[:, 1])
    s = 1j * FREQUENCY[:, None]
    own = 1 / ((1 - s / pole) * (1 + s / 60))
    pulled = gain / ((1 + s / 30) * (1 + s / 80))
    found = drawn(three)
    data = found["bode"].data
    for name, H in (("H11", own), ("H23", pulled), ("H31", pulled)):
        level = 20 * np.log10(np.abs(H))
        expected = np.percentile(level[:, 1:], 95, axis=1)
        np.testing.assert_allclose(data[f"{name}_magnitude_db_P95"], expected, atol=1e-9)
        np.testing.assert_allclose(data[f"{name}_magnitude_db_nominal"], level[:, 0], atol=1e-9)
    late = 1e3 * (
        0.5 / 1024 - np.unwrap(np.angle(own + pulled), axis=0) / (2 * np.pi * FREQUENCY[:, None])
    )
    np.testing.assert_allclose(found["delay"].data["plant_west_ms_nominal"], late[:, 0], rtol=1e-9)
    assert len(found["bode"].figure.axes) == 4 * 9
    assert np.isnan(data["H21_magnitude_db_P5"]).all(), "no such path"


@pytest.mark.parametrize("case", CASES)
def test_storeys_swing_with_the_frequencies_of_the_case(case):
    mass = CASES[case][0]
    expected = np.sqrt(linalg.eigvalsh(K / mass)) / (2 * np.pi)
    frequency, share, shape = modes_of(case)
    np.testing.assert_allclose(frequency, expected, rtol=1e-12)
    assert share.sum() == pytest.approx(1, rel=1e-12)
    np.testing.assert_allclose(share, mass * shape.sum(axis=0) ** 2 / 3, rtol=1e-9)


def test_tables_show_what_is_printed_of_the_problem(one):
    dataset = open_study(one).dataset
    nominal = study_tables(dataset)[0]
    assert nominal.title == "Table 3: nominal plant"
    assert nominal.columns == (
        "index", "passthrough, here", "pi-lead, paper", "pi-lead, here", "deviation",
    )  # fmt: skip
    assert [row[2] for row in nominal.rows] == [
        "4.6", "9.1", "10.2", "49.9", "36.7", "49.8", "49.8", "35.5", "35.6",
    ]  # fmt: skip
    ours = float(dataset.value.sel(controller="pi-lead", trial=0, index="J5").mean())
    assert nominal.rows[4][4] == f"{round(100 * (ours / 36.7 - 1)):+d} %"
    assert "over El Centro scaled by 0.40" in nominal.notes[0]
    rows = [line.split(",") for line in render(dataset, "csv").splitlines()]
    assert ["table3", "mean", "pi-lead", "J1", "ms", "published", "4.6"] in rows
    summary = summarise(dataset)
    assert summary.heading.endswith("uniaxial real-time hybrid simulation benchmark, case 3")
    last = summary.tables[-1]
    assert last.title == "Nominal plant beside Table 3 of the paper"
    assert last.columns[2:] == ("pi-lead, Table 3", "pi-lead, here")
    assert "Table 3 is over the El Centro record at a scale of 0.40." in last.notes[0]


def test_nothing_printed_gives_no_columns_and_no_word_of_it(three, one):
    alone = open_study(one).dataset.sel(controller=["passthrough"])
    for dataset in (open_study(three).dataset, alone):
        nominal, last = study_tables(dataset)[0], summarise(dataset).tables[-1]
        assert nominal.title == last.title == "Nominal plant"
        shown = (*nominal.columns, *last.columns)
        assert all(head == "index" or head.endswith(", here") for head in shown)
        assert not re.search("Table|paper", nominal.markdown() + last.markdown())
        assert "published" not in render(dataset, "csv")


def test_the_page_has_the_histories_of_every_actuator(study, tmp_path):
    page = write_report(study, tmp_path / "r.html", only=["fig14a"]).read_text("utf-8")
    stored = json.loads(re.search(r'id="stored">(.*?)</script>', page, re.DOTALL)[1])
    source = open_source(study)
    layout, signals = source.layout, source.study.signals(MOTION, "passthrough").isel(kept=0)
    run = next(r for r in stored if r["controller"] == "passthrough" and r["role"] == "nominal")
    names = [s["name"] for s in run["signals"]]
    assert names == [
        f"{what} {name}" for what in ("target", "error") for name in layout.actuators
    ] + [f"force {name}" for name in layout.forces]
    panels = {"N": "force [kN]", "N m": "moment [N m]"}
    size = {"N": 1e3, "N m": 1.0}
    for i, unit in enumerate(layout.load_units):
        one = run["signals"][2 * len(layout.actuators) + i]
        assert one["panel"] == panels[unit]
        steps = np.frombuffer(base64.b64decode(one["data"]), "<i2")
        values = signals.force.values[:: one["stride"], i] / size[unit]
        np.testing.assert_allclose(one["middle"] + one["scale"] * steps, values, atol=one["scale"])
    data = json.loads(re.search(r'id="data">(.*?)</script>', page, re.DOTALL)[1])
    assert [x["name"] for x in data["indices"]] == [i.name for i in groups_of(layout)["benchmark"]]
    assert len(data["trials"]) == TRIALS + 1


def test_labels_of_indices():
    assert index_label("J1") == "$J_{1}$" and index_label("J10_east") == "$J_{10,east}$"
    assert index_label("J4text") == r"$J_{4}^{\mathrm{text}}$" and index_label("mine") == "mine"
    assert index_label("TI_1") == r"$\mathrm{TI}_{1}$" and NAMES[0] == "J1_1"


def test_the_published_numbers_belong_to_their_problem():
    marths, uniaxial = find_problem().published, find_problem("uniaxial", 4).published
    assert marths.printed("J2_1", "adfc") == 3.9 and marths.printed("J1", "pi-lead") is None
    assert uniaxial.printed("J4", "pi-lead") == 72.6 and uniaxial.printed("J4", "adfc") is None
    assert (
        marths.conditions == "over the El Centro, Kobe and Morgan Hill records at a scale of 0.40"
    )
