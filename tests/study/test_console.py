"""What commands print: no number or head cut at any width, no encoding that ends a command."""

import io
import re
import sys

import numpy as np
import pytest
from rich.console import Console

from martths_jax.campaign.config import make_config
from martths_jax.campaign.plan import build_plan
from martths_jax.campaign.progress import Bars, Tally
from martths_jax.campaign.session import header
from martths_jax.campaign.store import RunFolder
from martths_jax.cli import main, motions, nominal, tune
from martths_jax.cli.console import accept_any_text, console
from martths_jax.indices import choose
from martths_jax.motions import MotionInfo
from martths_jax.published import MARTHS
from martths_jax.screen import ScreenTable
from martths_jax.study.runner import write_results
from martths_jax.study.summary import Table, summarise
from tests.study.places import short_motion, small
from tests.study.small_outcome import outcome

WIDTHS = (60, 61, 72, 80, 97, 120, 200)


def printed(table, width: int) -> list[str]:
    """The lines of a table on a terminal."""
    out = io.StringIO()
    Console(file=out, width=width, color_system=None).print(table)
    lines = out.getvalue().splitlines()
    assert max(map(len, lines)) <= width
    return lines


def check(table: ScreenTable, width: int) -> None:
    """Every head's words and every cell of numbers stand in one piece, and each row has its own."""
    lines = printed(table, width)
    text = "\n".join(lines)
    assert "…" not in text
    if table.title:
        assert table.title.split()[0] in text
    words = re.findall(r"\S+", text)
    for head in table.columns:
        assert set(head.split()) <= set(words), (width, head)
    for i, head in enumerate(table.columns):
        if head in table.text or i < table.keys:
            continue
        for row in table.rows:
            with_key = [x for x in lines if row[0].split(" ")[0][:12] in x]
            assert any(row[i] in line for line in with_key or lines), (width, head, row)


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    """The tables of every command."""
    folder = tmp_path_factory.mktemp("tables")
    names = ("a-motion-with-a-long-name-of-forty-letters", "two")
    config = make_config(small(
        folder, trials=12, motions=tuple(short_motion(n) for n in names),
        controllers=("lqg", "adfc"),
    ))  # fmt: skip
    run = RunFolder.start(folder, header(build_plan(config), ""))
    for i, cell in enumerate(run.cells):
        value = -1e3 * outcome(13, i).value
        run.write(*cell, np.arange(13), outcome(13, value=value))
    found = {t.title: t.__rich__() for t in summarise(write_results(run).dataset).tables}
    measures = {"PGA": 3.1, "PGV": 0.376, "Arias": 1.849, "CAV": 12.9, "D5-95": 23.8, "Sa": 8.05}
    info = [
        MotionInfo("morganhill-like", "built-in", 0.005, 39.97, measures),
        MotionInfo("RSN1234_A_LONG_NAME_OF_A_FILE-090", "/some/where/far", 0.01, 1234.5, measures),
        MotionInfo("bad", "/x", problem="File /x/bad.csv is empty, but a motion was expected."),
    ]
    found["motions"] = motions._table(info)
    rows = [{"index": "J2_1", "start": 1234.567, "tuned": 0.01, "published": 3.9},
            {"index": "diverged [%]", "start": 0.0, "tuned": 100.0, "published": ""}]  # fmt: skip
    found["tune"] = tune._table(rows, "adfc", "kobe-like", 128, MARTHS)
    heads = ("pull", "noise_power", "spread", "lost [%]", *(f"J{i}_1" for i in range(9)))
    cells = [(f"1e-{i}", "1.5e-07", "1", "0.0", *["-1234. / 5678."] * 9) for i in range(10, 14)]
    found["sweep"] = Table("adfc on one", heads, cells, ("Median.",), keys=3).__rich__()
    return found


@pytest.mark.parametrize("width", WIDTHS)
def test_no_table_cuts_a_number_or_a_head(tables, width):
    assert len(tables) >= 10
    for table in tables.values():
        check(table, width)


def test_wide_terminals_get_one_table_with_heads_in_a_line(tables):
    lines = printed(tables["motions"], 200)
    assert "Arias [m/s]" in lines[1] and "D5-95 [s]" in lines[1] and len(lines) == 6


def test_text_is_folded_and_nothing_of_it_is_lost():
    long = "a sentence of many words, and /a/path/" + "x" * 90
    table = ScreenTable("", ("name", "n", "from"), [("a", "1.5", long)], text=("from",))
    lines = printed(table, 60)
    assert "1.5" in lines[2]
    assert "".join("".join(lines[2:]).split()) == "a1.5" + "".join(long.split())


@pytest.mark.parametrize("encoding", ["latin-1", "cp437", "cp1252", "ascii", "utf-8"])
def test_no_encoding_ends_a_command(encoding, monkeypatch):
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding=encoding) for _ in range(2))
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", err)
    for words in (["modes"], ["motions"], ["--help"], ["run", "--help"], ["summary", "größer – …"]):
        monkeypatch.setattr(sys, "argv", ["martths", *words])
        try:
            main()
        except SystemExit as stop:
            assert stop.code in (0, 2)
    out.flush()
    err.flush()
    shown = out.buffer.getvalue().decode(encoding) + err.buffer.getvalue().decode(encoding)
    assert "81.05" in shown and "kobe-like" in shown and "Usage" in shown
    assert "Traceback" not in shown and "does not exist" in shown


def test_signs_become_their_likes(monkeypatch):
    out = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.setattr(sys, "stdout", out)
    accept_any_text()
    print("größer – 3 × 2 …\udc80 日", flush=True)
    assert out.buffer.getvalue().split() == b"grosser - 3 x 2 ...? ?".split()


@pytest.mark.parametrize("width", [60, 80, 140])
def test_bars_cut_nothing(width):
    out = io.StringIO()
    bars = Bars(Console(file=out, width=width, force_terminal=True, color_system=None))
    cell = ("a-controller", "a-motion-with-a-long-name")
    bars.begin({cell: Tally(1000, 0)})
    bars.advance(cell, 384, 12, seconds=3.0, compiling=1.25)
    bars.progress.refresh()
    bars.end()
    text = out.getvalue()
    assert "…" not in text
    shown = re.sub(r"\s+", " ", text)
    for number in ("384/1000", "219", "12", "1.2"):
        assert number in shown


def test_the_run_command_prints_all_indices(monkeypatch, capsys):
    values = {f"J{i}_1": np.array([-1234.5678 + i]) for i in range(24)}
    monkeypatch.setattr(nominal, "evaluate", lambda _: values)
    sums = type("S", (), {"indices": choose()})
    result = type("R", (), {"controller": "adfc", "motion": "kobe-like", "sums": sums})()
    monkeypatch.setattr(console, "width", 60)
    nominal._print_indices(result)
    text = capsys.readouterr().out
    for name, value in values.items():
        assert re.search(rf"{name} +{value[0]:.3f}", text)
