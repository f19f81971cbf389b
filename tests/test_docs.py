"""README and docs: their Python runs as it stands, and their commands know every option they show.

What is shortened, so that minutes become seconds: built-in motions are cut to a second and a half
of shaking, studies have `TRIALS` trials whatever number the page gives, and a grid has the last
value of each of its axes.  Nothing else of a page's code is changed.
"""

from __future__ import annotations

import ast
import csv
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import jax
import matplotlib
import numpy as np
import pytest
import typer

from martths_jax.cli import app
from martths_jax.control.controllers import ENTRIES
from martths_jax.motions import load
from tests.figures import small_study

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
#: Pages whose commands are looked at too.
REPORTS = [*sorted(ROOT.glob("experiments/*/README.md")), ROOT / "benchmarks" / "README.md"]
TRIALS = 2
#: Whatever the command line's library calls a mistake in its words.
WrongUse = typer.BadParameter.__mro__[1]
CODE = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
WITH_CODE = [page for page in PAGES if CODE.search(page.read_text("utf-8"))]


def named(page: Path) -> str:
    return str(page.relative_to(ROOT))


class Shortened(ast.NodeTransformer):
    """Code whose studies have few trials, and whose grids have one cell."""

    def visit_Dict(self, node):
        for value in node.values:
            if isinstance(value, ast.List):
                value.elts = value.elts[-1:]
        return self.generic_visit(node)

    def visit_keyword(self, node):
        if node.arg == "trials" and isinstance(node.value, ast.Constant):
            node.value.value = TRIALS
        return self.generic_visit(node)


@pytest.fixture
def short(monkeypatch):
    """Built-in motions of a second and a half about their first strong shaking, no quiet end."""
    whole = load.load_record

    def cut(*args, **kwargs):
        record = whole(*args, **kwargs)
        first = int(np.argmax(np.abs(record.acceleration) > 0.3 * record.pga))
        size = round(1.5 / record.dt)
        return replace(record, acceleration=record.acceleration[first : first + size])

    monkeypatch.setattr(load, "load_record", cut)
    monkeypatch.setattr(load, "with_quiet_tail", lambda record, tail: record)


@pytest.fixture
def as_users_run_it():
    """Without the strict rules that this package's own tests run under."""
    with jax.numpy_rank_promotion("allow"), jax.numpy_dtype_promotion("standard"):
        yield


@pytest.mark.slow
@pytest.mark.usefixtures("as_users_run_it")
@pytest.mark.parametrize("page", WITH_CODE, ids=named)
def test_python_runs(page, short, tmp_path, tmp_path_factory, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    # Figures are drawn of a study that was run before.
    (tmp_path / "study").symlink_to(small_study.build(tmp_path_factory.getbasetemp() / "study"))
    names: dict = {}
    for block in CODE.finditer(page.read_text("utf-8")):
        tree = Shortened().visit(ast.parse(block.group(1)))
        exec(compile(tree, named(page), "exec"), names)
    if page.name == "README.md":
        check_readme(names, capsys.readouterr().out)


def check_readme(names: dict, printed: str) -> None:
    """What README says about the names it makes."""
    assert "adfc on elcentro-like: 1000 trials" in printed
    assert len(names["J"]) == 24 and names["J"]["J10_27"].shape == (1000,)
    samples = names["motion"].acceleration.size
    assert names["one"].signals["x_m"].shape == (1, samples, 2)
    run = names["simulate"](
        names["benchmark"], names["Lead"](0.02), names["plants"][:2], names["motion"]
    )
    assert not run.lost.any()
    step = 1e-4
    cost = jax.jit(names["cost"])
    slope = (float(cost(1 + step)) - float(cost(1 - step))) / (2 * step)
    assert float(names["slope"](1.0)) == pytest.approx(slope, rel=1e-7)


def commands(page: Path, prose: bool = False) -> list[str]:
    """What calls ``martths`` in a page's blocks, or in its sentences, without comments."""
    text = page.read_text("utf-8")
    if prose:
        return re.findall(r"`(martths [^`]*)`", text)
    blocks = re.findall(r"^```[a-z]*\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    blocks += re.findall(r"^(?: {4}.*\n)+", text, re.MULTILINE)
    found = []
    for line in "\n".join(blocks).replace("\\\n", " ").splitlines():
        words = line.partition(" #")[0].split()
        if "martths" in words:
            found.append(" ".join(words[words.index("martths") :]))
    return found


@cache
def command_line():
    """``martths`` with commands that do nothing once their words have been understood."""

    def idle(command):
        if command.callback:
            command.callback = lambda **_: None
        for one in getattr(command, "commands", {}).values():
            idle(one)
        return command

    return idle(typer.main.get_command(app))


def parsed(line: str) -> None:
    """Parse a command without running it.

    Raises:
        WrongUse: for a command or an option that does not exist, or a value of a wrong kind.
    """
    words = re.sub(r"\$\w+", "1", line).split()[1:]  # variables of a scheduler are numbers
    command_line().main(words, standalone_mode=False)


@pytest.mark.parametrize("page", [*PAGES, *REPORTS], ids=named)
def test_commands_can_be_parsed(page):
    for line in commands(page):
        parsed(line)
    for line in commands(page, prose=True):
        try:
            parsed(line)
        except WrongUse as error:  # in a sentence it may stand for itself, without all it needs
            assert "Missing" in str(error), line


def test_most_commands_are_shown_somewhere():
    shown = {line.split()[1] for page in PAGES for line in commands(page) if " " in line}
    assert {"study", "run", "sweep", "sensitivity", "tune", "report", "merge", "motions"} <= shown


@pytest.mark.parametrize(
    "line", ["martths stdy", "martths study --trails 5", "martths study --trials five"]
)
def test_a_wrong_command_is_found(line):
    with pytest.raises(WrongUse):
        parsed(line)


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_options_in_the_text_exist(page):
    """Options named in sentences belong to some command."""

    def options(command) -> set[str]:
        own = {o for p in command.params for o in (*p.opts, *p.secondary_opts)}
        return own.union(*map(options, getattr(command, "commands", {}).values()))

    known = options(command_line()) | {"--help"}
    prose = re.sub(r"^```.*?^```$", "", page.read_text("utf-8"), flags=re.MULTILINE | re.DOTALL)
    for code in re.findall(r"`([^`]+)`", prose):
        for option in re.findall(r"(?<![\w=-])--[a-z][a-z-]*", code):
            assert option in known, code


def test_figures_are_not_drawn_on_a_screen():
    """Code of the pages may draw; it must not open windows."""
    assert matplotlib.get_backend().lower() in ("agg", "pdf", "svg")


def test_the_table_of_descents_is_the_committed_run():
    path = ROOT / "experiments" / "tune_lqg" / "results" / "descents.csv"
    with path.open(encoding="utf-8", newline="") as file:
        rows = {(r["objective"], r["method"]): r for r in csv.DictReader(file)}
    page = (ROOT / "docs" / "tuning.md").read_text("utf-8").replace("**", "")
    for text in dict.fromkeys(objective for objective, _ in rows):
        shown = text.replace("*", " ").replace("j", "J").replace("+", " + ")
        cells = [f"{float(rows[text, 'lbfgs']['after 1']):.2f}"]
        for method in ("lbfgs", "scipy", "adam"):
            best = [float(rows[text, method][f"after {n}"]) for n in (11, 31, 61)]
            cells.append(", ".join(f"{value:.2f}" for value in best))
        assert f"| {shown} | {' | '.join(cells)} |" in page, (shown, cells)


def test_the_table_of_controllers_is_the_committed_run():
    path = ROOT / "experiments" / "controllers" / "results" / "true_tracking.csv"
    page = (ROOT / "docs" / "controllers.md").read_text("utf-8")
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    of_marths = [entry.name for entry in ENTRIES if entry.problem == "marths"]
    assert [row["controller"] for row in rows] == of_marths
    for row in rows:
        cells = " | ".join(
            f"{float(row[f'{n}_median']):.1f} ({float(row[f'{n}_largest']):.1f})"
            for n in ("J2true_1", "J2true_2")
        )
        assert f"| `{row['controller']}` | {cells} |" in page, (row["controller"], cells)
        assert row["lost"] == "0"
