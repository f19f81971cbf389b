"""Axes and grids: what users may write, what is refused, and that all problems come at once."""

import numpy as np
import pytest

from martths_jax import Entry, InputError, Parameter, Passthrough
from martths_jax.campaign.config import make_config
from martths_jax.campaign.lanes import Worlds
from martths_jax.control import registry
from martths_jax.control.controllers import ENTRIES
from martths_jax.control.registry import find
from martths_jax.sweep import axes, make_sweep, run_sweep
from martths_jax.sweep.axes import axis_values as values_of
from martths_jax.sweep.axes import scalars
from martths_jax.sweep.grid import cell_numbers, job_config


def axis_values(name, given):
    return values_of(name, given, scalars()[name])


def overlap(way, value, nb, fs):
    """No from one of the ways to say it."""
    if way == "no":
        return value
    derived = next(d for d in find("adfc").entry.derived if d.name == way)
    return derived.value(value, {"nb": nb}, fs)


def test_ranges_and_lists():
    logs = axis_values("pull", "1e-8:1e-4:log9")
    assert np.allclose(np.diff(np.log10(logs)), 0.5) and (logs[0], logs[-1]) == (1e-8, 1e-4)
    assert axis_values("scale", "0.1:1:lin4") == pytest.approx((0.1, 0.4, 0.7, 1.0))
    assert axis_values("q", "1e-6, 1e-5") == (1e-6, 1e-5)
    whole = axis_values("nb", "16:64:log3")
    assert whole == (16, 32, 64) and all(type(v) is int for v in whole)


@pytest.mark.parametrize(
    ("name", "text", "part"),
    [
        ("nb", "", "has no values"),
        ("nb", "8,64", "at least 9"),
        ("nb", "64.5", "whole number"),
        ("nb", "64,128,64", "64 more than once"),
        ("nb", "8,64,64", "at least 9 (samples), but got 8.  Axis `nb` has 64 more than once"),
        ("hop", "0,1", "at least 1"),
        ("no_fraction", "0.5,1.2", "be a number from 0 to 1, but got 1.2"),
        ("pull", "-1e-8", "be a number of at least 0 (mm^2)"),
        ("pull", "0:1:log5", "must be positive"),
        ("q", "a,b", "must be numbers"),
        ("scale", "0:1:lin3", "not zero"),
        ("alpha", "95", "between 0 and 90"),
        ("fs", "nan", "positive"),
    ],
)
def test_refused_values(name, text, part):
    with pytest.raises(InputError, match=r"axis|Axis") as caught:
        axis_values(name, text)
    assert part in str(caught.value) and f"`{name}`" in str(caught.value)


def test_everything_wrong_is_named_at_once_and_before_anything_runs(tmp_path):
    with pytest.raises(InputError) as caught:
        run_sweep(
            [("nb", "64,128"), ("no", "32,64,100,127"), ("pul", "1"),
             ("nb", "256"), ("q", "")],
            {"seed": -1}, shown=("J2_1", "J2_9"), out=str(tmp_path / "out"),
        )  # fmt: skip
    text = str(caught.value)
    for part in (
        "Axis 'pul' is unknown; the nearest are pull",
        "`nb` is given twice",
        "`q` has no values",
        "Argument `seed`",
        "Index 'J2_9' is unknown",
    ):
        assert part in text, part
    assert not (tmp_path / "out").exists()


def test_impossible_combinations_are_all_named():
    with pytest.raises(InputError) as caught:
        make_sweep({"nb": (64, 128), "no": (32, 64, 127, 200)})
    text = str(caught.value)
    for nb, no in ((64, 64), (64, 127), (64, 200), (128, 200)):
        assert f"Cell nb = {nb}, no = {no} of adfc cannot run" in text
    assert text.count("Cell nb = ") == 4, "and no possible one"


@pytest.mark.parametrize(
    ("axes", "changes", "part"),
    [
        ({}, {}, "at least one axis"),
        ({"nb": 16, "no_fraction": (0.95, 1)}, {}, "all give no = 15"),
        ({"nb": 64, "hop": (65,)}, {}, "No = -1 (hop 65) must lie in 0 ... 63"),
        ({"nb": 64, "fb": (1, 64)}, {}, "at fs = 1024 Hz"),
        ({"no": 3, "hop": 4}, {}, "all set the overlap"),
        ({"nb": 64}, {"controllers": ("lqg",)}, "moves nothing"),
        ({"scale": (1, 2)}, {"pga": "0.4g"}, "exclude each other"),
        ({"nb": 64}, {"controller": {"adfc": {"no": 500}}}, "No = 500 "),
    ],
)
def test_refused_sweeps(axes, changes, part):
    with pytest.raises(InputError) as caught:
        make_sweep(axes, **changes)
    assert part in str(caught.value)


def test_four_ways_to_say_the_overlap_agree():
    assert overlap("no", 48, 64, 1024) == overlap("hop", 16, 64, 1024) == 48
    assert overlap("fb", 64.0, 64, 1024) == overlap("no_fraction", 0.75, 64, 1024) == 48
    assert overlap("no_fraction", 1, 64, 1024) == 63, "1 is every sample"
    sweep = make_sweep({"nb": (64, 128), "no_fraction": (0, 1)})
    numbers = cell_numbers(sweep.grid, sweep.study)
    assert numbers["cell_no"][0][..., 0].tolist() == [[0, 63], [0, 127]]
    assert numbers["cell_hop"][0][..., 0].tolist() == [[64, 1], [128, 1]]
    assert numbers["cell_fb"][0][..., 0].tolist() == [[16, 1024], [8, 1024]]


def test_every_sample_stays_every_sample_where_only_nb_moves():
    grid = make_sweep({"nb": (64, 4096)}).grid
    assert [job.get("no") for job in grid.jobs["adfc"]] == [63, 4095]


def test_cells_share_batches_and_jobs():
    grid = make_sweep(
        {"nb": (64, 128), "hop": (1, 8), "pull": (0, 1e-6), "q": (1e-5, 3e-5)},
        controllers=("adfc", "lqg", "passthrough"),
    ).grid
    sizes = sorted(len(batch) for batch in grid.batches())
    assert sizes == [1, 1, 2, 8, 8], "passthrough's q shapes it; lqg with its q, ADFC with each nb"
    assert len(grid.places) == 16 == len(grid.jobs["passthrough"])


def test_an_axis_changes_its_own_scalar_only():
    """Where lambda moves, the guarded controller is still pulled towards the inverse plant."""
    sweep = make_sweep({"pull": (1e-6,)})
    config = job_config(sweep.grid.jobs["adfc"][0], sweep.study)
    assert config.controller["adfc"] == {"towards": "inverse", "pull": 1e-6}
    given = make_config({"controllers": ("adfc",), "controller": {"adfc": {"pull": 0.0}}})
    sweep = make_sweep({"pull": (1e-6,)}, given)
    config = job_config(sweep.grid.jobs["adfc"][0], sweep.study)
    assert config.controller["adfc"] == {"towards": "start", "pull": 1e-6}


def test_every_scalar_sets_something_known():
    numbers = {p.name for entry in ENTRIES for p in entry.parameters if p.is_number}
    worlds = {"scale", "fs", "spread", "noise_power", "alpha", "arm"}
    assert {"nb", "no", "pull", "q"} <= numbers
    assert {s.setting for s in scalars().values()} == numbers | worlds


def test_cells_keep_what_the_study_makes_the_force_from():
    worlds = Worlds(make_config(force_from="measurement"), ())
    assert worlds.benchmark(1024, None, None).force_from == "measurement"
    assert worlds.benchmark(512, 40.0, None).force_from == "measurement"


def test_a_parameter_called_like_an_axis_of_the_study_is_told_apart(monkeypatch):
    own = Entry("mine", Passthrough, parameters=(Parameter("arm", default=1.0, unit="samples"),))
    monkeypatch.setattr(registry, "ENTRIES", (*registry.ENTRIES, own))
    sweep = make_sweep({"mine.arm": (2.0, 3.0), "arm": (0.2,)}, controllers=("mine",))
    first = sweep.grid.jobs["mine"][0]
    assert first.get("arm") == 0.2 and first.get("mine.arm") == 2.0
    assert job_config(first, sweep.study).controller["mine"] == {"arm": 2.0}
    assert cell_numbers(sweep.grid, sweep.study)["cell_arm"][0].ravel().tolist() == [2.0, 3.0]
    alone = make_sweep({"mine.arm": (2.0, 3.0)}, controllers=("mine",)).grid.jobs["mine"][0]
    assert alone.get("arm") is None, "the coupler's arm does not move"


@pytest.mark.parametrize(("former", "name"), axes.RENAMED.items())
def test_a_former_name_of_an_axis_is_refused_with_its_new_one(former, name):
    with pytest.raises(InputError, match=f"Axis '{former}' is called `{name}` now"):
        make_sweep({former: (0.2,)})
    assert name in axes.scalars()
