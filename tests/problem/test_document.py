"""A problem file's lines, units, getters, and that every fault is found at once."""

import math
import random
import tomllib

import pytest

from martths_jax.errors import InputError
from martths_jax.problem.file.document import Document, read_document
from martths_jax.problem.file.lines import key_lines
from martths_jax.structure.units import FORCES, LENGTHS, MASSES, Units

TRICKY = r'''# [comment] = 1
units = "SI" # at "the" top
"quoted key" = 'it''s = [not]'
text = """
[fake]
x = 1 \""" still text
""" # after
literal = """ends with quotes"""""
raw = \'\'\'
[[fake]]
'y' = 2 \'\'\'
list = [ # a [ comment
  1, {a = "]", b = [2, 3]},
  [4,
   5],
]
a.b."c.d" = 1979-05-27 07:32:00

[table . inner]  # header
key = -1e-3
[[rows]]
name = "first"
[rows.deep]
x = 1
[[rows]]
name = "second"
[[rows.sub]]
x = 2
[[rows.sub]]
x = 3
[rows.deep]
x = 4
'''.replace("\\'", "'").replace("'it''s = [not]'", "'its = [not]'")
PLACES = {
    ("units",): 2, ("quoted key",): 3, ("text",): 4, ("literal",): 8, ("raw",): 9, ("list",): 12,
    ("list", 0): 13, ("list", 1): 13, ("list", 1, "b"): 13, ("list", 2): 14, ("list", 2, 1): 15,
    ("a",): 17, ("a", "b", "c.d"): 17, ("table",): 19, ("table", "inner"): 19,
    ("table", "inner", "key"): 20, ("rows",): 21, ("rows", 0, "name"): 22,
    ("rows", 0, "deep", "x"): 24, ("rows", 1): 25, ("rows", 1, "name"): 26,
    ("rows", 1, "sub"): 27, ("rows", 1, "sub", 0, "x"): 28, ("rows", 1, "sub", 1, "x"): 30,
    ("rows", 1, "deep", "x"): 32,
}  # fmt: skip


@pytest.mark.parametrize("path", PLACES, ids=str)
def test_a_key_stands_on_its_line(path):
    assert key_lines(TRICKY)[path] == PLACES[path]


def paths(value, path=()):
    """Paths of all that a document holds."""
    if path:
        yield path
    if isinstance(value, dict | list):
        for key, inside in value.items() if isinstance(value, dict) else enumerate(value):
            yield from paths(inside, (*path, key))


def test_places_are_those_of_the_values():
    """Every path of the data has a line and no line is without data."""
    assert set(key_lines(TRICKY)) == set(paths(tomllib.loads(TRICKY)))


def faults(text, read=lambda root: None):
    document = Document(text)
    read(document.root)
    with pytest.raises(InputError) as found:
        document.finish()
    return str(found.value)


def test_all_faults_come_at_once_by_line():
    text = 'units = "SI"\nlenth = 1\nb = -1\n[rod]\nE = "x"\nkind = "stele"\n[[further]]\nz = 1\n'

    def read(root):
        root.table("rod").text("kind", ["steel", "oak"])
        root.table("rod").number("E", "Pa", above=0)
        root.table("rod").number("A", "m^2", least=0)
        root.number("length", default=1.0)
        root.number("b", "kg", least=0)

    assert faults(text, read).splitlines() == [
        "problem.toml cannot be used (6 problems):",
        "  1. problem.toml, line 2: Key `lenth` is unknown: the nearest is length.",
        "  2. problem.toml, line 3: `b` must be a number of at least zero (kg), but got -1.",
        "  3. problem.toml, line 4: `A` in [rod] is missing; it must be a number of at least zero "
        "(m^2).",
        "  4. problem.toml, line 5: `E` in [rod] must be a number above zero (Pa), but got 'x'.",
        "  5. problem.toml, line 6: `kind` in [rod] names 'stele', which is unknown: the nearest "
        "is steel.",
        "  6. problem.toml, line 7: Table `further` is unknown: known are b, force, length, mass, "
        "rod, units.",
    ]


def test_what_is_good_is_no_fault():
    document = Document('units = "SI"\n[rod]\nE = 1\nnodes = [1, "b"]\non = true\n')
    rod = document.root.table("rod")
    assert (rod.number("E", "Pa"), rod.texts("nodes"), rod.flag("on")) == (1.0, ("1", "b"), True)
    assert document.root.table("absent") is None and document.root.named("absent") == []
    document.finish()


def test_names_of_tables_and_lists_read_alike():
    as_table = 'units = "SI"\n[nodes]\n1 = {x = 2.0}\nb = {x = 3.0}\n'
    as_list = 'units = "SI"\n[[nodes]]\nname = 1\nx = 2.0\n[[nodes]]\nname = "b"\nx = 3.0\n'
    for text in (as_table, as_list):
        document = Document(text)
        found = [(name, table.number("x")) for name, table in document.root.named("nodes")]
        document.finish()
        assert found == [("1", 2.0), ("b", 3.0)]


GETTERS = {
    "bool is no number": ("a = true", lambda r: r.number("a"), "must be a finite number, but got"),
    "infinite": ("a = inf", lambda r: r.number("a"), "must be a finite number, but got inf"),
    "beyond": (f"a = {10**400}", lambda r: r.number("a"), "must be a finite number, but got 1000"),
    "bound": ("a = 2", lambda r: r.number("a", above=2), "must be a number above 2, but got 2"),
    "numbers": ("a = [1]", lambda r: r.numbers("a", "m", 2), "be a list of 2 numbers (m), but"),
    "whole": ("a = 1.5", lambda r: r.whole("a"), "must be a whole number of at least 0, but got"),
    "flag": ("a = 1", lambda r: r.flag("a"), "`a` must be true or false, but got 1."),
    "text": ("a = []", lambda r: r.text("a"), "`a` must be a name, but got []."),
    "texts": ('a = "b"', lambda r: r.texts("a"), "`a` must be a list of names, but got 'b'."),
    "twice": ("a = [1, 1]", lambda r: r.texts("a"), "`a` names '1' twice."),
    "one or more": ("a = [-1]", lambda r: r.one_or_more("a"), "a number of at least 0, or a list"),
    "table": ("a = 1", lambda r: r.table("a"), "`a` must be a table, [a], but got 1."),
    "entries": ("a = [1]", lambda r: r.entries("a"), "`a` must be a list of tables, [[a]], but"),
    "named": ("a = {b = 1}", lambda r: r.named("a"), "`a` must hold tables: [a] with NAME ="),
    "no name": ("a = [{}]", lambda r: r.named("a"), "`name` in entry 1 of [a] is missing;"),
    "name twice": ("a = [{name = 1},\n{name = 1}]", lambda r: r.named("a"),
                   "line 3: '1' stands twice in [a], first on line 2."),
}  # fmt: skip


@pytest.mark.parametrize("case", GETTERS)
def test_a_wrong_value_is_one_sentence_with_its_line(case):
    text, get, sentence = GETTERS[case]
    found = faults(f'units = "SI"\n{text}\n', get)
    line = 3 if case == "name twice" else 2
    assert found.startswith(f"problem.toml, line {line}: ") and sentence in found, found


UNITS = {
    "missing": ("a = 1", "line 1: The units are missing: write units ="),
    "one of three": ('length = "mm"\nmass = "t"', "line 1: The unit of force is missing: write"),
    "unknown": ('units = "SI units"', "line 1: `units` names 'SI units', which is unknown: known"),
    "unknown length": ('force = "N"\nmass = "kg"\nlength = "metre"',
                       "line 3: `length` names 'metre', which is unknown: known are m, cm, mm,"),
    "both": ('units = "SI"\nmass = "kg"', "line 2: `mass` says a unit beside units = "),
}  # fmt: skip


@pytest.mark.parametrize("case", UNITS)
def test_units_that_are_missing_or_unknown_are_refused(case):
    text, sentence = UNITS[case]
    found = faults(text, lambda root: root.number("a", default=0.0))
    assert sentence in found and "problems" not in found, found


def test_quantities_come_out_in_si():
    """A steel column in kip and inches, by the definitions of the inch and the pound."""
    head = 'length = "in"\nforce = "kip"\nmass = "kip s^2/in"\n'
    document = Document(head + "E = 29000\nI = 21.4\nm = 0.5\nJ = 2\nw = [1, 2]\n")
    root = document.root
    kip, inch = 1000 * 0.45359237 * 9.80665, 0.0254
    assert root.number("E", "Pa") == pytest.approx(29000 * kip / inch**2, rel=1e-14)
    assert root.number("I", "m^4") == pytest.approx(21.4 * inch**4, rel=1e-14)
    assert root.number("m", "kg") == pytest.approx(0.5 * kip / inch, rel=1e-14)
    assert root.number("J", "kg m^2") == pytest.approx(2 * kip * inch, rel=1e-14)
    assert root.numbers("w", "N/m") == pytest.approx([kip / inch, 2 * kip / inch], rel=1e-14)
    document.finish()


def test_matrices_of_other_units_do_the_same_work():
    """x' K x and x' M x are an energy and a mass in any units, with rotations in radians."""
    units = Units("mm", "kN", "t")
    turns = [False, True]
    K = units.matrix_factor("K", turns)
    np_x = [3.0, 0.002]  # mm, rad
    si_x = [0.003, 0.002]
    for i in range(2):
        for j in range(2):
            work = np_x[i] * np_x[j] * 1e3 * 1e-3  # kN mm
            assert si_x[i] * si_x[j] * K[i, j] == pytest.approx(work, rel=1e-14)
    assert units.matrix_factor("M", turns)[1, 1] == pytest.approx(1e3 * 1e-6, rel=1e-14)
    assert {"m", "N", "kg"} <= {*LENGTHS, *FORCES, *MASSES} and math.isclose(MASSES["t"], 1e3)


def test_a_file_that_is_none_or_no_toml(tmp_path):
    with pytest.raises(InputError, match=r"cannot be read \(No such file"):
        read_document(tmp_path / "none.toml")
    (tmp_path / "a.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="is no text in UTF-8"):
        read_document(tmp_path / "a.toml")
    with pytest.raises(InputError, match=r"is not valid TOML: .*line 2"):
        Document('units = "SI"\nunits = "SI"\n')
    (tmp_path / "b.toml").write_bytes(b'units = "SI"\r\n[a]\r\nb = 1\r\n')
    document = read_document(tmp_path / "b.toml")
    assert document.line(("a", "b")) == 3 and document.beside("c.npz") == tmp_path / "c.npz"


SCALARS = ['"a]b"', "'c # d'", '"""x\n[y]\nz=1"""', "'''q\n\"k\" = 2'''", "1", "true", "inf",
           "1979-05-27 07:32:00", '"\\"x\\\\"', '""', '""""""', '"""a\\"""b"""']  # fmt: skip


def some_value(draw, depth=0):
    """A scalar, a list over several lines, or an inline table."""
    kind = draw.random()
    if depth > 2 or kind < 0.5:
        return draw.choice(SCALARS)
    inside = [some_value(draw, depth + 1) for _ in range(draw.randint(0, 3))]
    if kind < 0.75:
        return "[\n" + ", # ]\n".join(inside) + "\n]"
    pairs = [f"k{i}{draw.choice(['', '.z'])} = {v}" for i, v in enumerate(inside)]
    return "{" + ", ".join(v for v in pairs if "\n" not in v) + "}"


@pytest.mark.parametrize("seed", range(20))
def test_lines_of_random_texts(seed):
    """Each key is called by the line that it is written on."""
    draw = random.Random(seed)
    text, wanted = "", {}
    for table in range(8):
        head = draw.choice([f"[t{table}] # [x]", "[[rows]]", f"[ a.t{table} ]"])
        count = text.count("[[rows]]")
        path = {"[[": ("rows", count), "[t": (f"t{table}",)}.get(head[:2], ("a", f"t{table}"))
        text += f"{head}\n"
        for key in range(draw.randint(0, 4)):
            wanted[(*path, f"k{key}")] = text.count("\n") + 1
            text += f"{draw.choice(['', '  '])}k{key} = {some_value(draw)} # = [\n"
    data = tomllib.loads(text)
    lines = key_lines(text)
    assert {path: lines[path] for path in wanted} == wanted and set(lines) == set(paths(data))
