"""An index that no paper prints, and one from outside the package, in all that is written."""

import json
import shutil

import numpy as np
import pytest
import scipy.io

from martths_jax import ADFC, InputError, build_benchmark
from martths_jax.benchmark import LAYOUT
from martths_jax.campaign.formats.mat import write_mat
from martths_jax.campaign.parts import part_bytes, read_part
from martths_jax.figures import drawings, figure_list
from martths_jax.figures.source import open_source
from martths_jax.figures.style import index_label
from martths_jax.guests import FILES
from martths_jax.nominal import compare_with_table4
from martths_jax.report import replay
from martths_jax.report.payload import history_payload, kept_signals, trial_payload
from martths_jax.report.tables import render
from martths_jax.study import merge_runs, open_study, run_study
from martths_jax.sweep import run_sweep
from tests.indices import guest
from tests.indices.guest import BOTH, MEAN
from tests.study.places import short_motion, small
from tests.study.test_storage import Says

GIVEN = ("benchmark", "true", "TI", "frequency")
#: Name -> unit, of some that are in no paper.
UNITS = {"J2true_1": "%", "TI_2": "mm²", "FEIdelay_1": "ms", "mean_1": "mm"}


def settings(folder, **changes):
    """The guest's file lies beside the folder, as a user's would."""
    own = shutil.copyfile(guest.__file__, folder.parent / "own.py")
    controllers = ("lqg", "adfc{nb=64,no=63}")
    given = (*GIVEN, f"{own}:BOTH")
    return small(folder, trials=3, controllers=controllers, indices=given) | changes


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    return run_study(settings(tmp_path_factory.mktemp("study") / "run", signals=True))


def test_the_result_files(study):
    data = study.dataset
    names = [str(n) for n in data["index"].values]
    assert len(names) == 24 + 4 + 2 + 4 + 2 and names[-2:] == ["mean_1", "mean_2"]
    spelt = {n: str(data.unit.sel(index=n).values) for n in UNITS}
    assert spelt == {"J2true_1": "percent", "TI_2": "mm2", "FEIdelay_1": "ms", "mean_1": "mm"}
    assert np.isfinite(data.value).all()
    head = (study.folder / "study.csv").read_text("utf-8").splitlines()[0].split(",")
    assert head[4:-2] == names
    about = json.loads(data.attrs["identity"])["index"]
    assert about["mean_1"]["label"] == "mean error of stroke 1"
    assert "MeanError" in str(about["mean_1"]["code"])
    assert "held" in data and data.held.sel(controller="lqg").values.max() == 0


def test_the_tables(study):
    summary = (study.folder / "summary.md").read_text("utf-8")
    for name, unit in UNITS.items():
        assert f"| {name} [{unit}] |" in summary
    nominal = render(study.dataset, "md").split("\n## ")[0].splitlines()
    row = next(line for line in nominal if line.startswith("| TI_2 [mm²] |"))
    # Experiment, then paper, here and deviation of each of the two.
    assert [cell.strip() for cell in row.split("|")].count("–") == 5
    tidy = render(study.dataset, "csv").splitlines()
    assert any(line.startswith("table4,mean,adfc,mean_1,mm,here,") for line in tidy)
    assert not any("mean_1,mm,published" in line for line in tidy)
    assert r"$\mathrm{TI}_{2}$ [mm²]" in render(study.dataset, "tex")


def test_matlab_and_page(study, tmp_path):
    write_mat(study.dataset, tmp_path / "study.mat", study.stored_signals())
    stored = scipy.io.loadmat(tmp_path / "study.mat")
    assert "mean_2" in [str(np.squeeze(n)) for n in stored["index"].ravel()]
    page = trial_payload(study, np.arange(4))
    assert {"name": "TI_1", "unit": "mm²"} in page["indices"]
    lines = {line["name"] for h in history_payload(kept_signals(study), 1024.0, 10**7, LAYOUT)
             for line in h["signals"]}  # fmt: skip
    assert {"u1: x1", "u2: x2'''", "error 1"} <= lines and not {"held", "C_A"} & lines


def test_the_figures(study):
    source = open_source(study.folder)
    wanted = [n for n in figure_list(source) if n.startswith(("fig11", "fig14", "ecdf", "paired"))]
    drawn = dict(drawings(source, wanted))
    assert any(n.startswith("fig11") for n in drawn)
    for name in ("fig14a_controllers", "ecdf"):
        assert set(drawn[name].data["index"]) == {str(n) for n in study.dataset["index"].values}
    labels = [axis.get_xlabel() for axis in drawn["ecdf"].figure.axes]
    assert f"{index_label('mean_1')} [mm]" in labels


@pytest.mark.parametrize(
    ("name", "typeset"),
    [
        ("J5_28", "$J_{5,28}$"),
        ("J10_2", "$J_{10,2}$"),
        ("J2true_1", r"$J_{2,1}^{\mathrm{true}}$"),
        ("TI_2", r"$\mathrm{TI}_{2}$"),
        ("FEIdelay_1", r"$\mathrm{FEI}_{1}^{\mathrm{delay}}$"),
        ("mean_1", r"$\mathrm{mean}_{1}$"),
        ("effort", "effort"),
    ],
)
def test_names_as_they_are_typeset(name, typeset):
    from matplotlib.mathtext import MathTextParser

    assert index_label(name) == typeset
    MathTextParser("path").parse(index_label(name))


def test_the_nominal_plant():
    found = compare_with_table4(
        build_benchmark(), [short_motion()], [ADFC(nb=64, no=63)], indices=["J2_1", MEAN]
    )
    assert [row["published"] for row in found.rows()] == [3.9, ""]
    assert found.cells()["mean_1"][1:] == ["–", "–"]


def test_another_set_is_another_study(study, tmp_path):
    folder = shutil.copytree(study.folder, tmp_path / "run")
    says = Says()
    run_study(settings(folder, signals=False), reporter=says)
    assert not [text for text in says.said if "set aside" in text]
    with pytest.raises(InputError, match="indices: "):
        run_study(settings(folder, signals=False, indices=("benchmark",)))


@pytest.mark.slow
def test_it_is_replayed_without_its_file(tmp_path):
    """The run has a copy, which it names; a file of another content is another study."""
    motion = short_motion()
    shake, folder, own = tmp_path / "one.csv", tmp_path / "run", tmp_path / "own.py"
    time = np.arange(motion.acceleration.size) / motion.fs
    head = "time [s],acceleration [m/s^2]"
    rows = np.c_[time, motion.acceleration]
    np.savetxt(shake, rows, delimiter=",", header=head, comments="")
    given = settings(folder, controllers=("passthrough",), motions=(str(shake),))
    run_study(given)
    kept = [path.name for path in (folder / FILES).iterdir()]
    assert len(kept) == 1 and kept[0].startswith("own-")
    content = own.read_text("utf-8")
    own.unlink()
    moved = folder.rename(tmp_path / "moved")
    assert replay(moved, 1).differing == []
    changed = content.replace("jnp.abs", "2 * jnp.abs")
    assert changed != content
    own.write_text(changed, "utf-8")
    with pytest.raises(InputError, match="mean_1"):
        run_study(given | {"out": str(moved)})


def test_a_part_of_other_names_is_not_taken(tmp_path):
    """Its numbers are as many, so that nothing else would tell."""
    run = small(tmp_path / "run", trials=3, indices=("J2", "TI"))
    before = run_study(run).dataset.value.values
    part = next((tmp_path / "run" / "parts").rglob("*.npz"))
    about, columns = read_part(part)
    assert about["indices"] == ["J2_1", "J2_2", "TI_1", "TI_2"]
    about["indices"] = ["J2_1", "J2_2", "TI_2", "TI_1"]
    part.write_bytes(part_bytes({k: v for k, v in about.items() if k != "columns"}, columns))
    says = Says()
    again = run_study(run, reporter=says).dataset.value.values
    assert any("it is of indices ['J2_1', 'J2_2', 'TI_2', 'TI_1']" in text for text in says.said)
    np.testing.assert_array_equal(again, before)


@pytest.mark.slow
def test_shares_are_merged(tmp_path):
    whole = run_study(settings(tmp_path / "whole", controllers=("passthrough",)))
    shares = settings(tmp_path / "shares", controllers=("passthrough",))
    for i in (1, 2):
        run_study(shares, share=(i, 2))
    merged = merge_runs(tmp_path / "shares", signals=False)
    np.testing.assert_array_equal(merged.dataset.value, whole.dataset.value)
    assert open_study(tmp_path / "shares").dataset.sizes["index"] == 36


@pytest.mark.slow
def test_a_sweep(tmp_path):
    swept = run_sweep(
        {"scale": [1.0, 2.0]},
        small(tmp_path / "sweep", trials=3, indices=("true", *BOTH), controllers=("passthrough",)),
    )
    assert swept.dataset.sizes["index"] == 6 and "J2true_1" in swept.summary().markdown()
    value = swept.dataset.value.sel(index="mean_1").values
    np.testing.assert_allclose(value[1] / value[0], 2.0, rtol=0.2)  # the noise stays
    head = (tmp_path / "sweep" / "sweep.csv").read_text("utf-8").splitlines()[0]
    assert head.endswith("status,held,J2true_1,J2true_2,J3true_1,J3true_2,mean_1,mean_2")
    assert list((tmp_path / "sweep" / "figures").glob("*.pdf"))
