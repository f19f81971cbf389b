"""Configurations: every problem at once, files that read back, and what is stored with a run."""

import tomllib

import pytest

from martths_jax import ADFC, InputError
from martths_jax.campaign.config import make_config, read_toml
from martths_jax.campaign.plan import build_plan
from martths_jax.campaign.template import template, write_config, write_template
from martths_jax.motions import BUILTIN_NAMES
from martths_jax.study import StudyConfig
from tests.study.places import short_motion, small


def test_the_template_is_the_default_configuration(tmp_path):
    path = tmp_path / "study.toml"
    write_template(path)
    read = make_config(path)
    assert read.controller.keys() == {"lqg", "adfc"}
    assert make_config(read, controller={}) == StudyConfig()
    plan = build_plan(make_config(read, motions=(short_motion(),)))
    bare = build_plan(make_config(motions=(short_motion(),)))
    assert plan.controller_settings == bare.controller_settings
    assert plan.controllers["adfc"].nb == ADFC().nb
    # Every setting is there, with what it means.
    for line in ("trials = 1000", "# records =", "noise_power = 1.5e-07", "[controller.adfc]"):
        assert line in template().splitlines()
    with pytest.raises(InputError, match="exists already"):
        write_template(path)


def test_every_problem_of_a_file_is_listed(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text(
        '[study]\ntrials = 0\nseeds = 3\ndraws = "random"\n[motion]\nnames = []\n'
        '[motions]\nscale = "large"\n[run]\ndevices = true\n'
    )
    with pytest.raises(InputError) as caught:
        make_config(path)
    text = str(caught.value)
    parts = (
        "(6 problems)",
        "'seeds' is unknown; did you mean 'seed'",
        "`trials` must",
        "'motion'",
        "`draws` must be one of",
        "`scale` must",
        "`devices` must",
    )
    for part in parts:
        assert part in text


def test_every_problem_of_a_plan_is_listed(tmp_path):
    config = make_config(
        controllers=("adfc", "pid", "lqg", "adfc2"),
        controller={
            "adfc": {"nb": 3, "no": 1},
            "lqg": {"weight": 1},
            "adfc2": {"kind": "adfc", "q": "small"},
            "unused": {},
        },
        motions=("no-such-motion", short_motion()),
        records=str(tmp_path / "nowhere"),
        fs=512.0,
        keep=(2000,),
    )
    with pytest.raises(InputError) as caught:
        build_plan(config)
    text = str(caught.value)
    parts = (
        "nowhere",
        "sampled at 1024 Hz",
        "'adfc': Argument `nb` must",
        "'pid' is unknown",
        "Setting of lqg 'weight'",
        "'adfc2'",
        "[controller.unused]",
        "up to 1000",
    )
    for part in parts:
        assert part in text


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"trails": 10}, "did you mean 'trials'"),
        ({"controllers": ("lqg", "lqg")}, "'lqg' twice"),
        ({"controllers": (3,)}, "hold names"),
        ({"motions": ()}, "at least one motion"),
        ({"plants": "p.csv", "draws": "lhs"}, "exclude each other"),
        ({"seed": 1.5}, "`seed` must"),
        ({"keep": (-1,)}, "`keep` must"),
        ({"spread": float("nan")}, "`spread` must"),
    ],
)
def test_settings_that_cannot_be_used(settings, message):
    with pytest.raises(InputError, match=message):
        make_config(settings)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match="init-config"):
        read_toml(tmp_path / "none.toml")
    (tmp_path / "bad.toml").write_text("trials = = 3")
    with pytest.raises(InputError, match="not valid TOML"):
        read_toml(tmp_path / "bad.toml")
    (tmp_path / "odd.toml").write_text("study = 3\ncontroller = 4\n")
    with pytest.raises(InputError, match=r"2 problems"):
        read_toml(tmp_path / "odd.toml")


def test_motions_default_to_built_in_ones_or_the_records(tmp_path):
    plan = build_plan(StudyConfig(controllers=("passthrough",)))
    assert [m.name for m in plan.motions] == list(BUILTIN_NAMES)
    assert all(m.scale == 0.4 for m in plan.motions)


def test_the_benchmarks_records_are_found(records):
    plan = build_plan(make_config(controllers=("passthrough",), records=str(records)))
    assert [m.name for m in plan.motions] == ["elcentro", "kobe", "morganhill"]


def test_a_controller_under_two_names(tmp_path):
    config = make_config(
        small(tmp_path), controllers=("adfc", "literal"),
        controller={"literal": {"kind": "adfc", "pull": 0.0}},
    )  # fmt: skip
    plan = build_plan(config)
    assert list(plan.controllers) == ["adfc", "literal"]
    assert plan.controllers["literal"].pull == 0.0 != plan.controllers["adfc"].pull
    assert ADFC.name == "adfc"


def test_the_effective_configuration_reads_back(tmp_path):
    config = make_config(seed=7, sa="0.3g@2.29Hz", controller={"adfc": {"q": 1e-5}})
    plan = build_plan(make_config(config, motions=(short_motion(),)))
    settings = {"seed": 7, "sa": "0.3g@2.29Hz", "controller": plan.controller_settings}
    write_config(settings, tmp_path / "config.toml")
    assert tomllib.loads((tmp_path / "config.toml").read_text())["study"] == {"seed": 7}
    again = make_config(tmp_path / "config.toml")
    assert (again.seed, again.sa) == (7, "0.3g@2.29Hz")
    rebuilt = build_plan(make_config(again, motions=(short_motion(),), sa=None))
    assert rebuilt.controller_settings == plan.controller_settings
