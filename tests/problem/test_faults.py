"""Every fault of a structure's file is one sentence with its file and line."""

import numpy as np
import pytest

from martths_jax.errors import InputError
from tests.problem.texts import read

GOOD = """units = "SI"
laboratory = ["ab", "mass b"]
interface = ["b.x", "b.r"]
outputs = ["d.x"]
ground = "x"
[nodes]
a = {x = 0, y = 0}
b = {x = 0, y = 3}
c = {x = 4, y = 0}
d = {x = 4, y = 3}
[sections]
column = {E = 210e9, A = 4e-3, I = 3e-5}
[sections.beam]
E = 210e9
A = 4e-3
I = 3e-5
[[members]]
name = "ab"
ends = ["a", "b"]
section = "column"
[[members]]
name = "cd"
ends = ["c", "d"]
section = "column"
[[members]]
ends = ["b", "d"]
section = "beam"
[supports]
a = "fixed"
c = ["x", "y"]
[masses]
b = {m = 100.0}
d = {m = 200.0}
[damping]
kind = "rayleigh"
modes = [1, 2]
ratio = 0.02
"""
#: What stands in the good file, what in its place, and the sentence, whose line is that of "@".
FAULTS = {
    "loose node": ("c = {x = 4, y = 0}\n", "c = {x = 4, y = 0}\n@e = {x = 9, y = 9}\n",
                   "Node e is loose: no member and no constraint reaches it."),
    "mechanism": ('[supports]\na = "fixed"\nc = ["x", "y"]\n', '@[supports]\nc = ["x", "y"]\n',
                  "The frame is a mechanism: nothing resists the motion of a.y, a.rotation, b.x,"),
    "unknown interface": ('interface = ["b.x", "b.r"]', '@interface = ["b.x", "bb.r"]',
                          "`interface` names 'bb.r', which is unknown: the nearest is b.r."),
    "held interface": ('interface = ["b.x", "b.r"]', '@interface = ["b.x", "c.x"]',
                       "`interface` names c.x, which a support holds."),
    "unknown output": ('outputs = ["d.x"]', '@outputs = ["d.z"]',
                       "`outputs` names 'd.z', which is unknown: the nearest are d.y, "),
    "no stiffness there": ('interface = ["b.x", "b.r"]', 'interface = ["b.x", "d.r"]',
                           "The laboratory part has no stiffness at the interface degree of "
                           "freedom d.rotation: take it out of `interface`, or put the members "),
    "laboratory loose": ('laboratory = ["ab", "mass b"]', '@laboratory = ["b-d"]',
                         "The laboratory part, its interface held, is a mechanism: nothing "
                         "resists the motion of b.y, d.y."),
    "unknown part": ('laboratory = ["ab", "mass b"]', '@laboratory = ["ab", "mass f"]',
                     "`laboratory` names 'mass f', which is unknown: the nearest are mass "),
    "laboratory alone": ('interface = ["b.x", "b.r"]\n', "",
                         "`laboratory` is given without `interface`: give both or none."),
    "held and moved": ("ground", 'laboratory_held = ["b.x"]\nground',
                       "`laboratory_held` names b.x, which stands in `interface` too."),
    "ground": ('ground = "x"', '@ground = "z"', "`ground` must be the direction of the ground "
               "motion: \"x\", \"y\" or two numbers, but got 'z'."),
    "no ground": ('ground = "x"\n', "", "`ground` is missing; it must be the direction of the "),
    "area": ("column = {E = 210e9, A = 4e-3", "@column = {E = 210e9, A = -4e-3",
             "`A` in [sections.column] must be a number of at least zero (m^2), but got -0.004."),
    "inertia": ("A = 4e-3\nI = 3e-5\n", "A = 4e-3\n@I = 0\n",
                "`I` in [sections.beam] must be a number above zero (m^4), but got 0."),
    "modulus": ("E = 210e9\nA", "@E = nan\nA", "`E` in [sections.beam] must be a number above"),
    "density": ("I = 3e-5\n[[", "I = 3e-5\n@density = -1\n[[", "`density` in [sections.beam] must"),
    "no inertia": ("A = 4e-3\nI = 3e-5\n", "A = 4e-3\n",
                   "`I` in [sections.beam] is missing; it must be a number above zero (m^4)."),
    "half of shear": ("I = 3e-5\n[[", "I = 3e-5\n@G = 8e10\n[[", "Section beam has `G` without "
                      "`A_s`: a member shears with both, and without both it does not."),
    "mass below zero": ("b = {m = 100.0}", "@b = {m = -100.0}",
                        "`m` in [masses.b] must be a number of at least zero (kg), but got -100"),
    "mass nowhere": ("d = {m = 200.0}", "@dd = {m = 200.0}",
                     "A mass stands at node 'dd', which is unknown: the nearest is d."),
    "no length": ("c = {x = 4, y = 0}", "c = {x = 4, y = 3}",
                  "Member cd has no length: both its nodes stand at the same place."),
    "rigid through": ('ends = ["b", "d"]\n', 'ends = ["b", "d"]\nrigid_start = 5.0\n',
                      "Member b-d has rigid ends of 5 m and 0 m, but its nodes are 4 m apart."),
    "one end": ('ends = ["b", "d"]\n', '@ends = ["b"]\n',
                "`ends` in entry 3 of [members] must be a list of two nodes, but got ['b']."),
    "unknown node": ('ends = ["c", "d"]', '@ends = ["c", "dd"]',
                     "`ends` in entry 2 of [members] names 'dd', which is unknown: the nearest is"),
    "unknown section": ('section = "beam"', '@section = "baem"',
                        "`section` in entry 3 of [members] names 'baem', which is unknown: the "),
    "two members": ('name = "cd"', 'name = "ab"',
                    "The name 'ab' stands for two members, first on line 17: change one."),
    "same ends": ("[supports]", '@[[members]]\nends = ["b", "d"]\nsection = "beam"\n[supports]',
                  "The name 'b-d' stands for two members, first on line 25: change one."),
    "release": ('section = "beam"', 'section = "beam"\n@release = ["top"]',
                "`release` in entry 3 of [members] names 'top', which is unknown: known are start"),
    "mass of members": ('section = "beam"', 'section = "beam"\n@mass = "all"',
                        "`mass` in entry 3 of [members] names 'all', which is unknown: known are "),
    "unknown key": ('section = "beam"', 'section = "beam"\n@realease = ["end"]',
                    "Key `realease` in entry 3 of [members] is unknown: the nearest is release."),
    "unknown table": ("[damping]", "@[dampings]\n[damping]", "Table `dampings` is unknown: the"),
    "group as member": ('name = "cd"', 'name = "cd"\ngroup = "ab"',
                        "The name 'ab' stands for a group and another part."),
    "out of the plane": ("d = {x = 4, y = 3}", "@d = {x = 4, y = 3, z = 1}",
                         "`z` in [nodes.d] must be left out or zero: the frame stands in the "
                         "plane x, y, but got 1."),
    "dot": ("d = {x = 4, y = 3}", '@"d.x" = {x = 4, y = 3}\nd = {x = 4, y = 3}',
            "The name of a node must have no dot in it, but one is 'd.x'."),
    "no place": ("a = {x = 0, y = 0}", "@a = {x = 0}", "`y` in [nodes.a] is missing; it must be a"),
    "support": ('a = "fixed"', '@a = "clamped"', "`a` in [supports] names 'clamped', which is "
                "unknown: known are fixed, pinned."),
    "support's word": ('c = ["x", "y"]', '@c = ["x", "z"]', "`c` in [supports] names 'z', which"),
    "support nowhere": ('c = ["x", "y"]', '@cc = ["x", "y"]\nc = "pinned"',
                        "`cc` in [supports] names 'cc', which is unknown: the nearest is c."),
    "damping": ('kind = "rayleigh"', '@kind = "raleigh"', "`kind` in [damping] names 'raleigh', "
                "which is unknown: the nearest is rayleigh."),
    "modes": ("modes = [1, 2]", "@modes = [1, 1]", "`modes` in [damping] must be a list of "
              "different whole numbers, counted from 1, but got [1, 1]."),
    "too many modes": ("modes = [1, 2]", "modes = [1, 9]",
                       "The damping names mode 9, but there are 4 modes: name others."),
    "ratio": ("ratio = 0.02", "@ratio = [0.1, 0.1, 0.1]", "`ratio` in [damping] must be one number "
              "or two, but got [0.1, 0.1, 0.1]."),
    "two ways": ("modes = [1, 2]", "modes = [1, 2]\nomega = [1, 2]", "Rayleigh damping needs one "
                 "of: `a_0` and `a_1`, or `modes` and `ratio`, or `omega` and `ratio`."),
    "growing": ("ratio = 0.02", "ratio = [0.001, 0.4]", "Rayleigh damping cannot have the ratios "),
    "negative series": ('kind = "rayleigh"\nmodes = [1, 2]\nratio = 0.02\n',
                        'kind = "caughey"\nmodes = [1, 2, 3]\nratio = [0.02, 0.2, 0.01]\n',
                        "The damping is negative in the motion of "),
    "no damping": ('[damping]\nkind = "rayleigh"\nmodes = [1, 2]\nratio = 0.02\n', "",
                   "The damping is missing: write [damping] with kind = "),
    "diaphragm": ("[damping]", '[[diaphragms]]\n@nodes = ["b"]\n[damping]',
                  "`nodes` in entry 1 of [diaphragms] must be a list of at least two nodes, but"),
    "constraint": ("[damping]", '[[constraints]]\ndof = "d.y"\n@equals = {"d.z" = 1}\n[damping]',
                   "`d.z` in [constraints.0.equals] names 'd.z', which is unknown: the nearest"),
    "coefficient": ("[damping]", '[[constraints]]\ndof = "d.y"\n@equals = {"b.y" = "1"}\n[damping]',
                    "`b.y` in [constraints.0.equals] must be a finite number, but got '1'."),
    "no terms": ("[damping]", '@[[constraints]]\ndof = "d.y"\n[damping]',
                 "`equals` in entry 1 of [constraints] is missing; it must be a table such as"),
    "own leader": ("[damping]", '[[rigid_links]]\nleader = "b"\n@followers = ["b"]\n[damping]',
                   "`followers` in entry 1 of [rigid_links] must be other nodes than the leader"),
    "units": ('units = "SI"\n', "", "The units are missing: write units = "),
}  # fmt: skip
#: Faults that stand at a key which does not change.
AT = {
    "no stiffness there": "laboratory =", "laboratory alone": "laboratory =",
    "held and moved": "laboratory_held", "no ground": "units", "no inertia": "[sections.beam]",
    "two members": '[[members]]\nname = "ab"\nends = ["c"',
    "no length": '[[members]]\nname = "cd"', "rigid through": '[[members]]\nends',
    "group as member": "[[members]]", "too many modes": "[damping]", "two ways": "[damping]",
    "growing": "[damping]", "negative series": "[damping]", "no damping": "units",
    "units": "laboratory",
}  # fmt: skip


def sentence_of(text, folder=None):
    with pytest.raises(InputError) as found:
        read(text, folder)
    return str(found.value)


def test_the_good_file_is_good():
    data = read(GOOD)
    assert data.interface == ("b.x", "b.rotation") and len(data.reference.dofs) == 5


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_one_sentence_with_its_line(fault):
    old, new, sentence = FAULTS[fault]
    assert GOOD.count(old) >= 1
    text = GOOD.replace(old, new, 1)
    mark = AT.get(fault, "@")
    line = text[: text.index(mark)].count("\n") + 1
    found = sentence_of(text.replace("@", ""))
    assert found.startswith(f"problem.toml, line {line}: {sentence}"), found
    assert "\n" not in found and found.endswith(".")


def test_faults_of_all_tables_come_together():
    text = GOOD.replace("y = 3}", "y = true}").replace("ratio = 0.02", "ratio = -1")
    text = text.replace('ends = ["a", "b"]', 'ends = ["a", "q"]')
    found = sentence_of(text).splitlines()
    assert found[0] == "problem.toml cannot be used (4 problems):"
    lines = [int(line.split("line ")[1].split(":")[0]) for line in found[1:]]
    assert lines == sorted(lines)
    for piece in ("`y` in [nodes.b] must", "names 'q'", "`ratio` in [damping] must be a number of"):
        assert sum(piece in line for line in found) == 1


def test_an_interface_under_constraints():
    tied = GOOD.replace("[damping]", '[[diaphragms]]\nnodes = ["b", "d"]\n[damping]')
    text = tied.replace('"b.r"]', '"d.x"]')
    assert "line 3: `interface` names b.x and d.x, which move as one: name one." in sentence_of(
        text
    )
    body = '[[rigid_links]]\nleader = "b"\nfollowers = ["d"]\n[damping]'
    text = GOOD.replace("[damping]", body).replace('"b.x", "b.r"]', '"d.y"]')
    wanted = "`interface` names d.y, which a constraint makes of b.y and b.rotation: name those."
    assert wanted in sentence_of(text)
    text = GOOD.replace(
        "[damping]", '[[constraints]]\ndof = "d.y"\nequals = {"c.y" = 1}\n[damping]'
    )
    assert "The constraint d.y = c.y contradicts the others or a support" in sentence_of(text)


def test_what_the_numerical_part_keeps_must_stand():
    """A beam on a column that is in the laboratory with all that resists its rotation."""
    text = GOOD.replace('["ab", "mass b"]', '["ab", "b-d", "mass b", "mass d"]')
    text = text.replace('interface = ["b.x", "b.r"]', 'interface = ["b.x", "b.r", "d.x", "d.y"]')
    wanted = (
        "The numerical substructure is a mechanism: nothing resists the motion of b.rotation, d.x"
    )
    assert f"line 2: {wanted}." in sentence_of(text)
    text = text.replace(', "mass d"]', ', "b-d"]').replace(
        '"b-d", "mass b", "b-d"', '"b-d", "mass b"'
    )
    with_inertia = text.replace("[masses]\nb = {m = 100.0}\nd = {m = 200.0}\n", (
        '[[masses]]\nnode = "b"\nm = 100.0\n[[masses]]\nnode = "d"\nm = 200.0\n'
        '[[masses]]\nnode = "b"\nm = 9.0\nI = 5.0\nname = "computed"\n'
    ))  # fmt: skip
    data = read(with_inertia)
    assert data.numerical.M[data.at[1], data.at[1]] == 5.0


def matrices(folder, K, M, more=""):
    np.savez(folder / "a.npz", dofs=np.array(["a.x", "b.x"]), K=np.array(K), M=np.array(M))
    head = f'units = "SI"\nground = "x"\n{more}[matrices]\nfile = "a.npz"\n'
    return head if "C = " in more else head + '[damping]\nkind = "none"\n'


def test_matrices_that_cannot_be_a_structure(tmp_path):
    at = f"{tmp_path / 'problem.toml'}, line 3: "
    good = [[2.0, -1.0], [-1.0, 2.0]]
    read(matrices(tmp_path, good, np.eye(2)), tmp_path)
    text = matrices(tmp_path, [[1.0, -1.0], [-1.0, 1.0]], np.eye(2))
    wanted = "The frame is a mechanism: nothing resists the motion of a.x, b.x."
    assert sentence_of(text, tmp_path) == at + wanted
    text = matrices(tmp_path, [[1.0, -2.0], [-2.0, 1.0]], np.eye(2))
    wanted = "The stiffness is indefinite: it pushes the motion of a.x, b.x on."
    assert sentence_of(text, tmp_path) == at + wanted
    text = matrices(tmp_path, good, np.diag([1.0, -1.0]))
    assert sentence_of(text, tmp_path) == at + "The mass is negative in the motion of b.x."
    text = matrices(tmp_path, good, np.zeros((2, 2)))
    assert sentence_of(text, tmp_path) == at + "Nothing has mass: M is zero."
    text = matrices(tmp_path, good, np.eye(2), 'laboratory = ["a"]\ninterface = ["a.x"]\n')
    assert "`laboratory` names members, but there are matrices" in sentence_of(text, tmp_path)
    text = matrices(tmp_path, good, np.eye(2)).replace('ground = "x"', 'ground = "y"')
    assert "line 2: No degree of freedom ends with .x or .y along" in sentence_of(text, tmp_path)


def test_a_specimen_that_is_more_than_the_reference(tmp_path):
    """More mass is refused; more stiffness leaves a negative one, which is told."""
    head = matrices(tmp_path, [[2.0, -1.0], [-1.0, 2.0]], np.eye(2), 'interface = ["a.x"]\n')
    text = head + '[laboratory_matrices]\nfile = "part.npz"\n'
    part = {"dofs": np.array(["a.x"]), "K": np.array([[5.0]])}
    np.savez(tmp_path / "part.npz", M=np.array([[0.5]]), **part)
    data = read(text, tmp_path)
    assert data.notes[-1].startswith(
        "The laboratory part is stiffer than the reference in the motion"
    )
    np.savez(tmp_path / "part.npz", M=np.array([[1 + 1e-15]]), **part)
    assert read(text, tmp_path).numerical.M[0, 0] == 0.0, "round-off is no mass"
    np.savez(tmp_path / "part.npz", M=np.array([[1.5]]), **part)
    wanted = "line 8: The laboratory part has more mass than the reference in the motion of a.x: "
    assert wanted in sentence_of(text, tmp_path)


def test_sizes_beyond_all_bounds():
    text = GOOD.replace("A = 4e-3\nI", "A = 1e300\nI")
    assert "line 25: Member b-d has a stiffness or a mass beyond all bounds" in sentence_of(text)
    text = GOOD.replace("b = {x = 0, y = 3}", "b = {x = 0, y = 1e200}")
    assert "Member ab has a stiffness or a mass beyond" in sentence_of(text)
    text = GOOD.replace("m = 100.0", "m = 1e25")
    assert "line 28: The natural frequencies cannot be found: stiff" in sentence_of(text)
    text = GOOD.replace("m = 100.0", "m = 1e-300")
    assert "line 28: Equations of the structure are singular here: some" in sentence_of(text)
    text = GOOD.replace("column = {E = 210e9", "column = {E = 1e-20")
    assert "line 28: The frame is a mechanism" in sentence_of(text)


def test_damping_given_twice(tmp_path):
    matrices(tmp_path, np.eye(2), np.eye(2))
    with np.load(tmp_path / "a.npz") as file:
        np.savez(tmp_path / "a.npz", C=np.eye(2), **file)
    text = 'units = "SI"\nground = "x"\n[matrices]\nfile = "a.npz"\n[damping]\nkind = "none"\n'
    found = sentence_of(text, tmp_path)
    assert "line 5: Damping is given twice: by the matrix C and by [damping]." in found
    read(text[: text.index("[damping]")], tmp_path)
