"""Names of motions and controllers in paths, CSV, Markdown and words: none does harm anywhere."""

import csv
import io
import random
from pathlib import Path, PurePosixPath, PureWindowsPath

import numpy as np
import pytest

from martths_jax import InputError
from martths_jax.campaign.config import make_config
from martths_jax.campaign.plan import build_plan
from martths_jax.campaign.session import header
from martths_jax.campaign.store import RunFolder
from martths_jax.files import LONGEST_NAME, name_problems, safe_name
from martths_jax.study.runner import write_results
from martths_jax.study.signals import group
from martths_jax.study.summary import Table
from martths_jax.text import counted, csv_cell, csv_field, markdown_text
from tests.study.places import short_motion, small
from tests.study.small_outcome import outcome

#: What each of these was called in paths before there was `safe_name`.
ORDINARY = {
    "adfc": "adfc", "kobe-like": "kobe-like", "El Centro 0.4": "El Centro 0.4",
    "RSN6_IMPVALL.I_I-ELC180": "RSN6_IMPVALL.I_I-ELC180", "größer": "gr%C3%B6%C3%9Fer",
    "a/b\\c": "a%2Fb%5Cc", "100%": "100%25", "console": "console", "com10": "com10",
}  # fmt: skip
#: Names that lead somewhere else, or that some system reads in its own way.
ODD = ["..", ".", "", "...", ".x", "x.", "x ", " ", "CON", "con.csv", "nul", "Aux .b", "LPT1.txt",
       "COM0", "../../x", "/etc", "C:\\x", "\\\\host\\x", "~", "%2E%2E", "a\x00b", "a\nb", "\udc80",
       "<!--<script>", "=1+1", "x" * 300, "é" * 300, "x" * 300 + "y"]  # fmt: skip


@pytest.mark.parametrize(("name", "safe"), ORDINARY.items())
def test_ordinary_names_stay(name, safe):
    assert safe_name(name) == safe


def test_no_name_leaves_its_folder_and_no_two_share_one():
    random.seed(1)
    letters = "aA.%/\\ ~:-=é\x00\n2Econ"
    drawn = ["".join(random.choices(letters, k=random.randint(0, 8))) for _ in range(20_000)]
    names = list(dict.fromkeys([*ODD, *ORDINARY, *drawn]))
    for space in (True, False):
        safe = [safe_name(name, space) for name in names]
        assert len(set(safe)) == len(names)
        for text in safe:
            for path in (PurePosixPath("out", text), PureWindowsPath("out", text)):
                assert path.parts == ("out", text), text
            assert text[0] != "." and text[-1] not in ". " and len(text) <= LONGEST_NAME, text
            assert text.isascii() and not set(text) & set('<>:"/\\|?*\0\n'), text
            assert PureWindowsPath(text).stem.rstrip().upper() not in ("CON", "NUL", "COM0", "LPT1")
    assert group("..", ".") == "/%2E%2E/%2E"


def test_parts_of_odd_names_stay_in_the_folder(tmp_path):
    run = RunFolder(tmp_path, {})
    inside = {run.folder(c, m) for c in ODD for m in ODD}
    assert len(inside) == len(ODD) ** 2
    for folder in inside:
        assert folder.resolve().parent.parent == (tmp_path / "parts").resolve()


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["a\nb"], r"'a\\nb' has control characters"),
        (["a\tb"], "has control characters"),
        (["a\x00b"], "has control characters"),
        (["a\u2028b"], "has control characters"),
        (["a\udc80"], "has control characters"),
        (["  "], "must have a name"),
        ([""], "must have a name"),
        ([None], "must have a name"),
        (["Kobe", "x", "kobe"], "'Kobe' and 'kobe' differ in capitals only"),
    ],
)
def test_names_that_no_study_takes(names, message, tmp_path):
    motions = tuple(short_motion(name) for name in names)
    with pytest.raises(InputError, match=message):
        build_plan(make_config(small(tmp_path, motions=motions)))


def test_a_controller_with_such_a_name_is_refused_too(tmp_path):
    settings = {"a\nb": {"kind": "passthrough"}}
    with pytest.raises(InputError, match=r"The controller .* has control characters"):
        build_plan(make_config(small(tmp_path), controllers=("a\nb",), controller=settings))


def test_names_of_all_kinds_pass():
    assert not name_problems("motion", [*ORDINARY, "..", "日本 地震", "a\xa0b", "=x", "<b>"])


HOSTILE = ('=1+cmd|" /C calc"!A0', "-2", "a|b, <img src=x>", "[x](javascript:alert)", "..")


def test_tables_of_hostile_names_read_back(tmp_path):
    motions = tuple(short_motion(name) for name in HOSTILE)
    run = RunFolder.start(
        tmp_path, header(build_plan(make_config(small(tmp_path, motions=motions, trials=3))), "")
    )
    for i, cell in enumerate(run.cells):
        run.write(*cell, np.arange(4), outcome(4, i))
    write_results(run).write_csv(tmp_path / "again.csv")
    for path in (tmp_path / "study.csv", tmp_path / "again.csv"):
        rows = list(csv.reader(path.open(encoding="utf-8", newline="")))
        assert {len(row) for row in rows} == {30} and len(rows) == 1 + 5 * 4
        found = list(dict.fromkeys(row[1] for row in rows[1:]))
        assert found == [f"'{HOSTILE[0]}", "'-2", *HOSTILE[2:]]
    text = (tmp_path / "summary.md").read_text(encoding="utf-8")
    assert "<" not in text and "](" not in text and "a&#124;b, &lt;img src=x>" in text
    for block in text.split("\n\n"):
        if block.startswith("|"):
            lines = block.strip().split("\n")
            assert len({line.count("|") for line in lines}) == 1, lines
    assert not list(Path(tmp_path.parent).glob("*.npz")) and len(list(run.path.rglob("*.npz"))) == 5


def test_what_is_no_name_stays_in_markdown():
    table = Table("|J2| < 5 & more", ("index", "P50"), [("J2_1 [%]", "5.1 [4, 6]")], ("|a| - |b|",))
    assert table.markdown() == (
        "## |J2| &lt; 5 & more\n\n| index | P50 |\n| --- | ---: |\n| J2_1 [%] | 5.1 [4, 6] |\n\n"
        "|a| - |b|\n"
    )
    assert markdown_text("&lt; a\r\nb", cell=True) == "&amp;lt; a b"


@pytest.mark.parametrize(
    "text", ["=1", "+1", "-1", "@x", " =1", "'=1", "\N{FULLWIDTH EQUALS SIGN}"]
)
def test_no_cell_is_a_formula(text):
    assert csv_cell(text) == f"'{text}"
    assert csv_cell(-1.5) == -1.5 and csv_cell("a=1") == "a=1" and csv_cell("'a") == "'a"


@pytest.mark.parametrize("text", ["a\rb", "a\nb", 'say "a"', "a,b", "plain"])
def test_a_field_reads_back(text):
    line = f"{csv_field(text)},2\n"
    assert list(csv.reader(io.StringIO(line, newline=""))) == [[text, "2"]]


def test_one_is_singular():
    assert [counted(n, "trial") for n in (0, 1, 2)] == ["0 trials", "1 trial", "2 trials"]
    assert counted(2, "batch", "batches") == "2 batches" and counted(1, "batch", "x") == "1 batch"
