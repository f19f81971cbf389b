"""Old results never stand for new code: a user's controller belongs to its results."""

import importlib
import subprocess
import sys

import pytest

from martths_jax import ADFC, InputError
from martths_jax.campaign import sources
from martths_jax.campaign.engine_modules import ENGINE_MODULES
from martths_jax.study import Reporter, run_study
from tests.study.places import short_motion, small

CONTROLLER = '''
from dataclasses import dataclass, replace
from functools import partial
import jax, jax.numpy as jnp
import {helper}
from martths_jax import Controller, Decision, Passthrough

FACTOR = 1.25

def law(x, scale=1.0):
    """Doc."""
    return FACTOR * scale * x

def prepared(gain):
    return gain

class Base(Controller):
    offset = 0.0

    def shaped(self, x):
        return x + self.offset

@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Mine(Base):
    gain: float = 1.0
    estimator: object = None
    name = "mine"
    first_lag_range = 1

    def prepare(self, benchmark):
        estimator = Passthrough().prepare(benchmark).estimator
        return replace(self, gain=prepared(self.gain), estimator=estimator)

    def init(self, trials):
        return ()

    def step(self, state, seen):  # the law
        shaped = self.shaped(seen.x_a)
        return state, Decision(u=law(self.gain * {helper}.helped(shaped)))
'''
HELPER = """
LEVEL = 1.0

def helped(x):
    return inner(x)

def inner(x):
    return LEVEL * x
"""


@pytest.fixture
def write(tmp_path, monkeypatch):
    """Writes the two files and imports them anew; gives the controller's module."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    names = ("mine_of_a_user", "helper_of_a_user")

    def new(controller=CONTROLLER, helper=HELPER):
        for name, text in zip(names, (controller, helper), strict=True):
            (tmp_path / f"{name}.py").write_text(text.replace("{helper}", names[1]))
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        return importlib.import_module(names[0])

    yield new
    for name in names:
        sys.modules.pop(name, None)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("return FACTOR * scale * x", "return FACTOR * scale * x + 0"),  # a function it calls
        ("FACTOR = 1.25", "FACTOR = 1.5"),  # a constant that one uses
        ("scale=1.0", "scale=2.0"),  # a default
        ("return x + self.offset", "return x - self.offset"),  # a base class
        ("offset = 0.0", "offset = 0.1"),  # an attribute of one
        ("gain: float = 1.0", "gain: float = 3.0"),  # a field's default
        ("law(self.gain *", "law(2 * self.gain *"),  # its step
        ("return gain\n", "return -gain\n"),  # what it is prepared with
        ("LEVEL = 1.0", "LEVEL = 2.0"),  # a constant of another file
        ("return LEVEL * x", "return LEVEL + x"),  # a function that is called there
    ],
)
def test_every_piece_of_code_counts(write, old, new):
    before = sources.code_of(write().Mine())
    assert not sources.without_source(before)
    assert sources.code_of(write().Mine()) == before  # and it is the same again
    assert old in CONTROLLER + HELPER
    changed = write(CONTROLLER.replace(old, new), HELPER.replace(old, new)).Mine()
    assert sources.code_of(changed) != before


def test_comments_do_not_count(write):
    before = sources.code_of(write().Mine())
    text = CONTROLLER.replace("# the law", "# a law").replace('"""Doc."""', '"""Two.\n    """')
    text = text.replace("    offset", "\n    # more\n    offset")
    assert sources.code_of(write(text).Mine()) == before


def test_new_code_is_not_answered_with_old_results(write, tmp_path):
    out = tmp_path / "out"
    first = run_study(small(out, controllers=(write().Mine(),), motions=(short_motion(),)))
    again = run_study(small(out, controllers=(write().Mine(),), motions=(short_motion(),)))
    assert again.dataset.equals(first.dataset)
    changed = write(CONTROLLER.replace("law(self.gain", "law(2 * self.gain")).Mine()
    with pytest.raises(InputError, match=r"controller\.mine\.code\.mine_of_a_user\.Mine\.step"):
        run_study(small(out, controllers=(changed,), motions=(short_motion(),), trials=40))


def test_code_without_a_source_is_not_resumed(write, tmp_path):
    space = {"__name__": "typed_in"}
    exec("def typed(x):\n    return 2 * x", space)
    module = write()
    module.law = space["typed"]
    said = []
    reporter = Reporter()
    reporter.notice = said.append
    asked = small(tmp_path / "out", controllers=(module.Mine(),), motions=(short_motion(),))
    run_study(asked, reporter=reporter)
    assert any("source of typed_in.typed cannot be found" in text for text in said)
    with pytest.raises(InputError, match="its source cannot be found, so it may have changed"):
        run_study(asked)
    module.law = lambda x: x
    assert sources.without_source(sources.code_of(module.Mine()))


def test_a_file_edited_since_its_import_is_no_source(write, tmp_path):
    module = write()
    file = tmp_path / "mine_of_a_user.py"
    file.write_text(file.read_text().replace("FACTOR * scale", "2 * FACTOR * scale"))
    assert sources.without_source(sources.code_of(module.Mine())) == ["mine_of_a_user.law"]


def test_values_of_a_controller_count():
    assert sources.code_of(ADFC()) == sources.code_of(ADFC())
    assert sources.code_of(ADFC(nb=512, no=0)) != sources.code_of(ADFC())


def test_the_package_s_own_source_is_read_quickly_and_right():
    folder = sources.Path(sources.martths_jax.__file__).parent
    files = [path for name in ENGINE_MODULES for path in folder.glob(name)]
    assert len(files) > 30
    for path in files:
        text = path.read_text("utf-8")
        quick, plain = (sources.plain_source(text, quick=q) for q in (True, False))
        # What only the thorough way takes away is comments behind code.
        assert len(quick.splitlines()) == len(plain.splitlines()), path
        for a, b in zip(quick.splitlines(), plain.splitlines(), strict=True):
            rest = a[len(b) :].lstrip()
            assert a.startswith(b) and (not rest or rest.startswith("#")), (path, a, b)


def test_every_module_that_decides_a_number_is_listed():
    """All modules of this package that the engine imports, but for those named here."""
    code = (
        "import sys, martths_jax.campaign.engine, martths_jax.campaign.lanes\n"
        "print(*(m for m in sys.modules if m.startswith('martths_jax.')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    folder = sources.Path(sources.martths_jax.__file__).parent
    listed = {p.relative_to(folder) for name in ENGINE_MODULES for p in folder.glob(name)}
    # Inputs that are identified by what they hold, results, words and files.
    other = ("motions", "campaign", "study", "sweep", "sensitivity", "_version", "errors", "files",
             "claims", "checks", "guests", "published", "resources", "screen", "text")  # fmt: skip
    missing = []
    for name in done.stdout.split():
        path = sources.Path(*name.split(".")[1:])
        path = path / "__init__.py" if (folder / path).is_dir() else path.with_suffix(".py")
        if path not in listed and path.with_suffix("").parts[0] not in other:
            missing.append(str(path))
    assert not missing
