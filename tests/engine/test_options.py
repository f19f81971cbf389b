"""The same option has the same name, type, form and meaning in every command that has it."""

import re

import pytest
import typer
from rich.text import Text
from typer.testing import CliRunner

from martths_jax import InputError
from martths_jax.cli import app
from martths_jax.cli.options import words


def options():
    """(command, option) of everything that begins with dashes."""

    def walk(command, path):
        for parameter in command.params:
            if parameter.param_type_name == "option":
                yield path, parameter
        for name, one in getattr(command, "commands", {}).items():
            yield from walk(one, f"{path} {name}")

    return list(walk(typer.main.get_command(app), "martths"))


def meaning(parameter) -> str:
    """Its help text as shown, without what a command takes by default."""
    shown = Text.from_markup(parameter.help or "").plain
    return re.sub(r" \[default: .*\]\.$", ".", shown)


def test_one_name_is_one_thing():
    found, seen = {}, 0
    for command, parameter in options():
        thing = (
            tuple(parameter.opts), tuple(parameter.secondary_opts), str(parameter.bare_type()),
            parameter.multiple, parameter.metavar, meaning(parameter),
        )  # fmt: skip
        for name in (*parameter.opts, *parameter.secondary_opts):
            other, where = found.setdefault(name, (thing, command))
            assert thing == other, f"{name} of {command} and of {where}"
            seen += where != command
    assert seen > 100 and {"--motion", "--controllers", "--trials", "--out"} <= set(found)


def test_no_help_text_loses_what_stands_in_square_brackets():
    """They are markup, unless they are escaped."""
    texts = [p.help for _, p in options() if p.help]
    assert any("[s]" in t for t in texts)
    for text in texts:
        plain = text.replace("\\[", "[")
        assert Text.from_markup(text).plain == plain


@pytest.mark.parametrize(
    ("command", "parameter"),
    [
        pytest.param(c, p, id=f"{c} {p.opts[0]}")
        for c, p in options()
        if p.multiple and p.metavar != "NAME=VALUES"
    ],
)
def test_lists_take_commas_and_repetition(command, parameter):
    given = ("1,617", "2") if "--keep" in parameter.opts else ("a, b", "c")
    context = typer.Context(typer.main.get_command(app))
    found = [str(x) for x in parameter.process_value(context, given)]
    assert found == (["1", "617", "2"] if "--keep" in parameter.opts else ["a", "b", "c"])


def test_every_campaign_takes_the_same_settings():
    mine = {}
    for command, parameter in options():
        mine.setdefault(command.removeprefix("martths "), set()).update(parameter.opts)
    common = {"--config", "--trials", "--seed", "--controller", "--motion", "--motions",
              "--records", "--scale", "--fs", "--out", "--fresh", "--devices",
              "--quiet"}  # fmt: skip
    for command in ("study", "sweep", "sensitivity", "tune"):
        assert common <= mine[command], command


def test_the_path_of_a_file_is_one_word(tmp_path):
    path = tmp_path / "a,b 'c.mat"
    path.write_bytes(b"")
    assert words([str(path), "kobe-like,elcentro-like"]) == [
        str(path), "kobe-like", "elcentro-like"
    ]  # fmt: skip
    assert words(["O'Brien"]) == ["O'Brien"] and words([]) is None


def test_where_there_is_one_several_are_refused(tmp_path):
    done = CliRunner().invoke(app, ["figures", str(tmp_path), "--motion", "a,b"])
    assert isinstance(done.exception, InputError)
    assert "--motion takes one value here, but got a, b" in str(done.exception)
