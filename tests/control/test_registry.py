"""Where controllers come from, and what is said where they do not."""

import sys
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np
import pytest

from martths_jax import Controller, Decision, DirectMeasurement, Entry, InputError, Parameter
from martths_jax.control import registry
from martths_jax.control.controllers import ENTRIES
from martths_jax.control.entry import entry_of
from martths_jax.control.registry import find
from martths_jax.study import make_config

GUEST = Path(__file__).with_name("guest.py")


def written(tmp_path, text, name="mine.py"):
    path = tmp_path / name
    path.write_text(text)
    return path


def test_all_ways_find_the_same(tmp_path, monkeypatch):
    by_module = find("tests.control.guest:Lead").entry
    assert by_module.name == "lead" and find("tests.control.guest:ENTRY").entry is by_module
    for text in (f"{GUEST}", f"{GUEST}:Lead", f"{GUEST}:ENTRY"):
        guest = find(text)
        assert guest.entry.name == "lead"
        assert guest.copy.file == GUEST and len(guest.copy.sha256) == 64

    class Point:
        name, dist = "theirs", type("Dist", (), {"name": "package"})

        @staticmethod
        def load():
            return by_module.controller

    monkeypatch.setattr(registry, "_points", lambda: [Point])
    assert find("theirs").entry is by_module and "theirs" in registry.names()
    assert [e.name for e in ENTRIES] == registry.names()[: len(ENTRIES)]


def test_every_entry_makes_what_it_says(benchmark):
    for entry in ENTRIES:
        made = entry.build(benchmark)
        assert isinstance(made, entry.controller) and made.name == entry.name
        ready = made.prepare(benchmark)
        assert ready.estimator is not None and entry.paper
        starts = {name: p.default for name, p in entry.tunable.items()}
        if starts:
            traced = entry.build_traced(benchmark, **starts)
            tuned = entry.build_tuned(benchmark, **starts).prepare(benchmark)
            pairs = zip(jax.tree.leaves(traced), jax.tree.leaves(tuned), strict=True)
            for one, other in pairs:
                np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-12)


def test_a_class_without_an_entry_speaks_by_its_fields():
    @jax.tree_util.register_dataclass
    @dataclass(frozen=True)
    class Plain(Controller):
        """Nearly nothing."""

        gain: float = 2.0
        mode: str = "a"
        estimator: object = DirectMeasurement()
        name = "plain"

        def init(self, trials):
            return ()

        def step(self, state, seen):
            return state, Decision(self.gain * seen.x_a)

    entry = entry_of(Plain)
    assert entry.name == "plain" and entry.defaults == {"gain": 2.0, "mode": "a"}
    assert list(entry.tunable) == ["gain"] and entry.paper == "Nearly nothing."


BROKEN = {
    "unknown name": (lambda p: "adcf", r"'adcf' is unknown; the nearest are adfc"),
    "unknown package": (lambda p: "nobody.here:One", r"ModuleNotFoundError: No module named 'nobo"),
    "unknown class": (lambda p: f"{GUEST}:Laed", r"names 'Laed', .* did you mean 'Lead'"),
    "no file": (lambda p: f"{p}/none.py:One", r"none\.py cannot be read \(No such file"),
    "does not import": (
        lambda p: written(p, "import os\nx = 1\n\nimport nobody_here\n"),
        r"ModuleNotFoundError: No module named 'nobody_here' \(line 4\)",
    ),
    "syntax": (lambda p: written(p, "x = 1\ndef :\n"), r"SyntaxError: invalid syntax \(line 2\)"),
    "nothing in it": (
        lambda p: written(p, "x = 1\n"),
        r"must hold one Entry or one Controller, bu",
    ),
    "no controller": (
        lambda p: f"{written(p, 'x = 1')}:x",
        r"be a Controller class or an Entry, but",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_cannot_be_found_is_one_sentence(name, tmp_path):
    make, sentence = BROKEN[name]
    with pytest.raises(InputError, match=sentence) as caught:
        find(str(make(tmp_path)))
    assert "\n" not in str(caught.value)


def test_two_entries_of_one_class(tmp_path):
    text = GUEST.read_text() + "\nOTHER = Entry(name='other', controller=Lead)\n"
    path = written(tmp_path, text)
    with pytest.raises(InputError, match="Class Lead has two entries, 'lead' and 'other'"):
        find(f"{path}:Lead")
    assert find(f"{path}:OTHER").entry.name == "other"


def test_entries_refuse_what_contradicts_itself(benchmark):
    lead = find(str(GUEST)).entry
    with pytest.raises(InputError, match="names the parameter 'gain' twice"):
        Entry("a", lead.controller, parameters=(Parameter("gain"), Parameter("gain")))
    with pytest.raises(InputError, match="must be one of static, lane, tunable, but got 'fixed'"):
        Entry("a", lead.controller, parameters=(Parameter("gain", kind="fixed"),))
    for settings, sentence in (
        ({"lead": 0.2}, r"`lead` must be a number from 0 to 0.08 \(s\), but got 0.2"),
        ({"gain": 0.0}, r"`gain` must be a number above 0, but got 0.0"),
        ({"gain": "much"}, r"`gain` must be a number above 0, but got 'much'"),
        ({"laed": 0.2}, r"`settings` must be among gain, lead, corner, but got laed"),
    ):
        with pytest.raises(InputError, match=sentence):
            lead.build(benchmark, **settings)


def test_names_and_settings_in_a_configuration():
    config = make_config(controllers=[f"{GUEST}:Lead", f"a={GUEST}{{lead=0.01}}"])
    assert config.controllers == ("lead", "a")
    assert config.controller["a"] == {"kind": str(GUEST), "lead": 0.01}
    assert config.controller["lead"] == {"kind": f"{GUEST}:Lead"}


def test_a_file_is_loaded_once_for_each_content(tmp_path):
    text = "import builtins\nbuiltins.loads = getattr(builtins, 'loads', 0) + 1\n"
    import builtins

    path = written(tmp_path, text + GUEST.read_text())
    try:
        first, again = find(str(path)), find(f"{path}:Lead")
        assert first.entry is again.entry and builtins.loads == 1
        path.write_text(path.read_text() + "# more\n")
        assert find(str(path)).copy.sha256 != first.copy.sha256 and builtins.loads == 2
        assert str(tmp_path) not in sys.path
    finally:
        del builtins.loads
