"""Controllers by their settings: the forms, what is refused, and two of one kind end to end."""

import json

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

from martths_jax import ADFC, LQG, InputError, Passthrough
from martths_jax.campaign.config import read_toml
from martths_jax.campaign.given import split_list
from martths_jax.campaign.plan import build_plan
from martths_jax.cli import app
from martths_jax.cli.options import words
from martths_jax.figures import draw_figures
from martths_jax.figures.style import look
from martths_jax.report import render
from martths_jax.study import make_config, run_study
from martths_jax.study.summary import pairs
from martths_jax.sweep import make_sweep
from tests.study.places import short_motion, small


@pytest.mark.parametrize(
    ("text", "name", "table"),
    [
        ("adfc", "adfc", None),
        ("adfc{nb=2048}", "adfc", {"nb": 2048}),
        ("slow=adfc", "slow", {"kind": "adfc"}),
        ("slow = adfc{ nb = 2048, pull=1e-6 }", "slow", {"nb": 2048, "pull": 1e-6, "kind": "adfc"}),
        ("a b=adfc{solver=lu,towards='start'}", "a b",
         {"solver": "lu", "towards": "start", "kind": "adfc"}),
        ("l=lqg{e=[1.0, 2.0],q=1e-5}", "l", {"e": [1.0, 2.0], "q": 1e-5, "kind": "lqg"}),
        ("adfc{}", "adfc", {}),
        ("adfc=adfc{nb=64}", "adfc", {"nb": 64}),
    ],
)  # fmt: skip
def test_forms(text, name, table):
    config = make_config(controllers=(text,))
    assert config.controllers == (name,)
    assert config.controller == ({} if table is None else {name: table})


def test_a_text_goes_on_top_of_a_table():
    tables = {"slow": {"kind": "adfc", "nb": 512, "q": 1e-5}, "a=b": {"kind": "lqg"}}
    config = make_config(controllers=("slow=adfc{nb=64}", "a=b"), controller=tables)
    assert config.controller["slow"] == {"kind": "adfc", "nb": 64, "q": 1e-5}
    assert config.controllers == ("slow", "a=b") and tables["slow"]["nb"] == 512
    other = make_config(controllers=("slow=lqg{q=2e-5}",), controller=tables)
    assert other.controller["slow"] == {"kind": "lqg", "q": 2e-5}


def test_a_mapping_from_python():
    fast = ADFC(nb=64, no=63)
    given = {
        "fast": fast,
        "slow": {"kind": "adfc", "nb": 96, "no": 95},
        "passthrough": {},
        "x": "lqg",
    }
    config = make_config(controllers=given, motions=(short_motion(),))
    plan = build_plan(config)
    assert list(plan.controllers) == ["fast", "slow", "passthrough", "x"]
    assert plan.controllers["fast"].nb == 64 and plan.controllers["slow"].nb == 96
    assert isinstance(plan.controllers["x"], LQG)
    assert isinstance(plan.controllers["passthrough"], Passthrough)
    assert fast.name == "adfc" == ADFC.name
    two = make_config(controllers={"a": fast, "b": fast, "adfc": "adfc"})
    assert [c if isinstance(c, str) else c.name for c in two.controllers] == ["a", "b", "adfc"]


def test_a_file_and_a_sweep_take_the_forms(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text('[study]\ncontrollers = ["adfc", "slow=adfc{nb=96}"]\n')
    assert make_config(read_toml(path)).controllers == ("adfc", "slow")
    sweep = make_sweep({"nb": (64, 128)}, controllers=["adfc", "slow=adfc{q=1e-5}"])
    assert list(sweep.grid.jobs) == ["adfc", "slow"]


def test_lists_keep_settings_together():
    assert words(["lqg, slow=adfc{nb=96,pull=0}", "l=lqg{e=[1,2]}"]) == [
        "lqg", "slow=adfc{nb=96,pull=0}", "l=lqg{e=[1,2]}",
    ]  # fmt: skip
    assert split_list('a{s="},{"},b') == ['a{s="},{"}', "b"]


@pytest.mark.parametrize(
    ("controllers", "message"),
    [
        (["adfc", "adfc{nb=64}"], r"'adfc' twice; give one a name, as in 'slow=adfc{"),
        (["adfc{nb}"], "form KEY=VALUE, but got 'nb'"),
        (["adfc{nb=1,nb=2}"], "has the setting 'nb' twice"),
        (["adfc{nb=1"], "in quotes, since shells take braces"),
        (["adfc{e=[1}"], "lacks a closing ]|in quotes"),
        (["=adfc"], "cannot be read; write KIND, KIND{KEY=VALUE"),
        ({"a": 3}, "must map 'a' to a kind, to settings or to a Controller, but got 3"),
        (["slow=pid"], "'slow': .*'pid' is unknown"),
        (["slow=adfcnb=64"], "cannot be read|unknown"),
        (["adfc{nbs=64}"], "'nbs' is unknown; did you mean 'nb'"),
        (["adfc{nb=many}"], "`nb` must be a whole number"),
    ],
)
def test_what_is_refused(controllers, message):
    with pytest.raises(InputError, match=message):
        build_plan(make_config(controllers=controllers, motions=(short_motion(),)))


def test_looks_do_not_repeat():
    seen = [(look(i)["color"], str(look(i)["ls"]), look(i)["marker"]) for i in range(20)]
    assert len(set(seen)) == 20
    bars = [(look(i)["color"], look(i)["fill"]) for i in range(10)]
    assert len(set(bars)) == 10


def test_pairs_follow_kinds():
    def compared(**kinds):
        tables = {name: {"kind": kind} for name, kind in kinds.items()}
        about = {"controllers": json.dumps(tables)}
        return pairs(xr.Dataset(coords={"controller": list(kinds)}, attrs=about))

    assert compared(lqg="lqg", adfc="adfc", passthrough="passthrough") == [("adfc", "lqg")]
    assert compared(slow="adfc", adfc="adfc", lqg="lqg") == [("adfc", "lqg"), ("slow", "adfc")]
    assert compared(a="adfc", b="lqg", c="adfc") == [("a", "b"), ("c", "a")]
    assert compared(a="adfc") == compared(a="adfc", b="passthrough") == []
    assert pairs(xr.Dataset(coords={"controller": ["lqg", "adfc"]})) == [("adfc", "lqg")]


def test_the_command_line_hands_them_over(monkeypatch, tmp_path):
    asked = []
    monkeypatch.setattr("martths_jax.cli.study.run_study", lambda c, **_: asked.append(c))
    command = ["study", "--controller", "adfc{nb=64,no=63},lqg", "--controller",
               "slow=adfc{nb=96,no=95}", "--out", str(tmp_path)]  # fmt: skip
    assert CliRunner().invoke(app, command).exit_code == 0
    assert asked[0].controllers == ("adfc", "lqg", "slow")
    assert asked[0].controller["slow"] == {"kind": "adfc", "nb": 96, "no": 95}


@pytest.fixture(scope="module")
def two(tmp_path_factory):
    """A study of two settings of ADFC."""
    folder = tmp_path_factory.mktemp("two")
    given = ("adfc{nb=64,no=63}", "slow=adfc{nb=96,no=95}")
    motions = (short_motion("one"),)
    return run_study(small(folder, trials=4, controllers=given, motions=motions))


def test_two_settings_in_one_study(two):
    value = two.dataset.value.sel(motion="one")
    assert list(two.dataset.controller.values) == ["adfc", "slow"]
    assert np.all(np.isfinite(value.values))
    assert not np.array_equal(value.sel(controller="adfc"), value.sel(controller="slow"))
    text = (two.folder / "summary.md").read_text(encoding="utf-8")
    assert "slow on one: 4 of 4 trials" in text and "slow versus adfc on one" in text
    header = json.loads((two.folder / "run.json").read_text())
    assert header["identity"]["controller"]["slow"]["nb"] == 96
    read = make_config(two.folder / "config.toml")
    assert read.controllers == ("adfc", "slow") and read.controller["slow"]["no"] == 95


def test_everything_shows_both(two, tmp_path):
    table = render(two.dataset, "md")
    assert "slow, here" in table and "ADFC, here" in table and "slow P50" in table
    only = ("paired", "fig14")
    names = {
        p.name for p in draw_figures(two.folder, tmp_path, only=only, formats=("png",), dpi=50)
    }
    assert {"paired_slow_adfc.png", "fig14a_controllers.png", "fig14b_motions.png",
            "fig14b_motions_slow.png"} <= names  # fmt: skip
