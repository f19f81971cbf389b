"""Figures: what is drawn is what the study holds, every file is there, nothing overlaps."""

from __future__ import annotations

import csv
import itertools
import subprocess
import sys

import matplotlib.image
import numpy as np
import pytest
from scipy import signal

from martths_jax.errors import InputError
from martths_jax.figures import draw_figures, drawings, figure_list, open_source
from martths_jax.figures.plants import FREQUENCY, spectral_delay
from martths_jax.figures.structure import deformed
from martths_jax.figures.style import DOUBLE, SINGLE
from martths_jax.files import safe_name
from martths_jax.structure.frame import build_reference, modes
from martths_jax.structure.sections import FrameGeometry
from martths_jax.transfer import NOMINAL_HZ, frequency_response
from tests.figures.small_study import MOTIONS, TRIALS

NAMES = {
    "fig08_strokes_elcentro-like", f"strokes_{safe_name(MOTIONS[1])}", "fig11_coefficients",
    "fig12_synchronisation_actuators", "fig13_synchronisation_interface", "fig14a_controllers",
    "fig14b_motions", "fig14b_motions_lqg", "fig15_histograms", "paired", "ecdf", "bode", "delay",
    "frame",
}  # fmt: skip


@pytest.fixture(scope="module")
def source(study_folder):
    return open_source(study_folder)


@pytest.fixture(scope="module")
def drawn(source):
    """All drawings, laid out."""
    found = {}
    for name, drawing in drawings(source):
        drawing.figure.set_dpi(60)
        drawing.figure.draw_without_rendering()
        found[name] = drawing
    return found


def column(drawing, name):
    return np.asarray(drawing.data[name])


def test_every_figure_is_drawn(source, drawn):
    assert set(figure_list(source)) == NAMES == set(drawn)


def test_axes_say_what_they_show_and_in_what_unit(drawn):
    for name, drawing in drawn.items():
        for axis in drawing.figure.axes:
            for label, ticks in ((axis.get_xlabel(), axis.get_xticklabels()),
                                 (axis.get_ylabel(), axis.get_yticklabels())):  # fmt: skip
                shared = not label and not any(t.get_visible() and t.get_text() for t in ticks)
                known = "[" in label or "trials" in label or name in ("paired", "ecdf", "frame")
                inner = not label and axis.get_subplotspec().colspan.start > 0
                named = any("J_" in t.get_text() for t in ticks)
                assert shared or known or inner or named, (name, label)


def test_no_labels_overlap(drawn):
    """Titles, axis labels and legends of a figure keep clear of one another and of its edge."""
    for name, drawing in drawn.items():
        width, height = drawing.figure.bbox.size
        boxes = []
        for axis in drawing.figure.axes:
            for text in (axis.title, axis.xaxis.label, axis.yaxis.label):
                if text.get_text():
                    boxes.append((text.get_text(), text.get_window_extent()))
        boxes += [("legend", x.get_window_extent()) for x in drawing.figure.legends]
        for text, box in boxes:
            assert box.x0 > -1 and box.y0 > -1, (name, text)
            assert box.x1 < width + 1 and box.y1 < height + 1, (name, text)
        for (one, a), (other, b) in itertools.combinations(boxes, 2):
            across = min(a.x1, b.x1) - max(a.x0, b.x0)
            along = min(a.y1, b.y1) - max(a.y0, b.y0)
            assert across < 1 or along < 1, (name, one, other)


def test_widths_are_those_of_journal_columns(drawn):
    widths = {round(d.figure.get_figwidth() * 25.4, 6) for d in drawn.values()}
    assert widths == {SINGLE, DOUBLE}


def test_strokes_and_synchronisation_are_the_stored_signals(study_folder, drawn):
    stored = open_source(study_folder).study.signals(MOTIONS[0], "lqg").isel(kept=0)
    strokes = drawn["fig08_strokes_elcentro-like"]
    subspace = drawn["fig12_synchronisation_actuators"]
    interface = drawn["fig13_synchronisation_interface"]
    for i in (0, 1):
        for figure in (strokes, subspace):
            unit = f"{i + 1}_lqg_mm"
            np.testing.assert_array_equal(column(figure, f"target_{unit}"), stored.x_a[:, i])
            np.testing.assert_array_equal(column(figure, f"measured_{unit}"), stored.x_m[:, i])
    np.testing.assert_allclose(column(interface, "estimated_2_lqg_mrad"), 1e3 * stored.est[:, 1])


def test_coefficients_belong_to_their_derivative(drawn):
    """Coefficient 10 j + actuator of the j-th scaled derivative is that times dt^order."""
    data = drawn["fig11_coefficients"].data
    step = 1e3 / 1024
    for stroke, order, actuator in itertools.product((0, 1), range(4), (0, 1)):
        expected = (10 * (4 * stroke + order) + actuator) * step**order
        found = data[f"a{actuator + 1}_x{stroke + 1}_d{order}_ms{order}"]
        np.testing.assert_allclose(found, expected)


def test_ranges_are_percentiles_without_the_nominal_and_the_lost_trial(source, drawn):
    data = drawn["fig14a_controllers"].data
    for k in range(len(data["index"])):
        cell = source.study.dataset.value.sel(
            controller=data["controller"][k], motion=MOTIONS[0], index=data["index"][k]
        ).values[1:]
        assert data["P50"][k] == pytest.approx(np.nanmedian(cell), rel=1e-12)
        assert data["P75"][k] == pytest.approx(np.nanpercentile(cell, 75), rel=1e-12)


def test_histogram_and_ecdf_count_the_trials(drawn):
    data = drawn["fig15_histograms"].data
    inside = np.asarray(data["trials_adfc"])[np.asarray(data["index"]) == "J2_1"].sum()
    assert TRIALS - 1 <= inside <= TRIALS
    data = drawn["ecdf"].data
    mine = (np.asarray(data["index"]) == "J9_4") & (np.asarray(data["controller"]) == "lqg")
    share = np.asarray(data["share"])[mine]
    assert share.size == TRIALS - 1 and share[-1] == 1.0  # one trial is lost


def test_bode_bands_hold_the_plants_and_the_nominal(source, drawn):
    data = drawn["bode"].data
    plants = source.study.dataset.plant_hz.values[1:]
    response = np.asarray(frequency_response(plants, FREQUENCY))[:, 0, 1]
    level = 20 * np.log10(np.abs(response))
    np.testing.assert_allclose(data["H12_magnitude_db_P95"], np.percentile(level, 95, axis=1))
    nominal = np.asarray(frequency_response(NOMINAL_HZ[None], FREQUENCY))[:, 0, 1, 0]
    np.testing.assert_allclose(10 ** (data["H12_magnitude_db_nominal"] / 20), np.abs(nominal))


def test_spectral_delay_finds_a_known_delay():
    sos = signal.butter(2, [1, 10], "bandpass", fs=1024, output="sos")
    wave = signal.sosfilt(sos, np.random.default_rng(0).standard_normal(40000))
    frequency, late = spectral_delay(wave[5:], wave[:-5], 1024.0)
    assert frequency.size > 20
    np.testing.assert_allclose(late[frequency > 1], 5e3 / 1024, atol=0.3)
    np.testing.assert_allclose(spectral_delay(wave[:-5], wave[5:], 1024.0)[1], -late, atol=1e-6)


def test_mode_shapes_stay_joined_at_the_nodes():
    g = FrameGeometry()
    lines = deformed(g, modes(build_reference(g)), 0, size=0.2)
    ends: dict[tuple, list] = {}
    for rest, moved in lines:
        for at, now in ((rest[:, 0], moved[:, 0]), (rest[:, 1], moved[:, -1])):
            ends.setdefault(tuple(np.round(at, 6)), []).append(now)
    assert len(ends) == 16
    for points in ends.values():
        np.testing.assert_allclose(points, np.broadcast_to(points[0], np.shape(points)), atol=1e-12)
    moves = [np.hypot(*(moved - rest[:, [0]])[:, 0]) for rest, moved in lines]
    assert max(moves) == pytest.approx(0.2, rel=1e-12)


def test_files_beside_one_another(study_folder, tmp_path):
    paths = draw_figures(study_folder, tmp_path, only=["fig14a", "frame"], dpi=60)
    assert sorted(p.name for p in paths) == sorted(
        f"{n}.{k}" for n in ("fig14a_controllers", "frame") for k in ("pdf", "png", "csv")
    )
    assert (tmp_path / "frame.pdf").read_bytes().startswith(b"%PDF")
    assert matplotlib.image.imread(tmp_path / "frame.png").std() > 0.01
    with (tmp_path / "fig14a_controllers.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 48 and float(rows[0]["P5"]) < float(rows[0]["P95"])


def test_refusals_say_what_to_do(study_folder, tmp_path):
    with pytest.raises(InputError, match=r"martths replay .* --trial 4"):
        draw_figures(study_folder, tmp_path, trial=4, only=["fig12"])
    with pytest.raises(InputError, match="fig12_synchronisation"):
        draw_figures(study_folder, tmp_path, only=["fig99"])
    with pytest.raises(InputError, match="Motion 'kobe' is not"):
        draw_figures(study_folder, tmp_path, motion="kobe")
    with pytest.raises(InputError, match="does not exist"):
        draw_figures(tmp_path, tmp_path)


def test_importing_the_package_leaves_matplotlib_and_plotly_alone():
    code = (
        "import sys, martths_jax, martths_jax.figures, martths_jax.report;"
        "sys.exit(any(m in sys.modules for m in ('matplotlib', 'plotly')))"
    )
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0
