"""Structures through a problem file: closed forms, the Python interface, what partition means."""

from dataclasses import replace

import numpy as np
import pytest

from martths_jax.problem.file.problem import read_problem
from martths_jax.problem.file.template import template, write_template
from martths_jax.structure.assembly import assemble
from martths_jax.structure.constraints import rigid_link
from martths_jax.structure.damping import caughey_coefficients
from martths_jax.structure.frame import build_reference, modes, planar_frame
from martths_jax.structure.members import Member
from martths_jax.structure.sections import FrameGeometry
from tests.problem.texts import read, toml_of
from tests.structure.frames import beam, two_storeys

E, I, A, G, A_s = 210e9, 3e-5, 4e-3, 81e9, 2e-3
SI = 'units = "SI"\n'
METRIC = 'length = "mm"\nforce = "kN"\nmass = "t"\n'
IMPERIAL = 'length = "in"\nforce = "kip"\nmass = "kip s^2/in"\n'
INCH, KIP = 0.0254, 4448.2216152605
#: Metres, newtons and kilograms in the units of each head.
UNITS = {SI: (1.0, 1.0, 1.0), METRIC: (1e-3, 1e3, 1e3), IMPERIAL: (INCH, KIP, KIP / INCH)}


def line(head, length, pieces, held, mass_at, mass, shear=True, more="", member=""):
    """A straight line along x as a file in any units, ground motion across it."""
    m, n, kg = UNITS[head]
    text = head + 'ground = "y"\n[damping]\nkind = "none"\n[nodes]\n'
    text += "".join(
        f"{i} = {{x = {length * i / pieces / m!r}, y = 0}}\n" for i in range(pieces + 1)
    )
    text += f"[sections.s]\nE = {E / n * m**2!r}\nA = {A / m**2!r}\nI = {I / m**4!r}\n"
    text += f"G = {G / n * m**2!r}\nA_s = {A_s / m**2!r}\n" if shear else ""
    text += "[members]\n"
    text += "".join(
        f'm{i} = {{ends = [{i}, {i + 1}], section = "s", mass = "none"{member}}}\n'
        for i in range(pieces)
    )
    text += f"[supports]\n{held}\n[[masses]]\nnode = {mass_at}\nm = {mass / kg!r}\n"
    return text + more


@pytest.mark.parametrize("head", UNITS, ids=["SI", "metric", "imperial"])
@pytest.mark.parametrize("shear", [True, False])
def test_a_cantilever_bends_and_shears(head, shear):
    """Tip flexibility L^3 / 3EI + L / G A_s, in any units."""
    L, m = 2.5, 700.0
    data = read(line(head, L, 1, '0 = "fixed"', 1, m, shear))
    k = 1 / (L**3 / (3 * E * I) + (L / (G * A_s) if shear else 0))
    lowest = np.sqrt(k / m) / (2 * np.pi)
    axial = np.sqrt(E * A / L / m) / (2 * np.pi)
    np.testing.assert_allclose(data.reference.frequency, [lowest, axial], rtol=1e-12)
    np.testing.assert_allclose(data.reference.effective_mass, [m, 0], rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("head", UNITS, ids=["SI", "metric", "imperial"])
def test_a_beam_fixed_at_both_ends(head):
    """Midspan stiffness of two halves that end without rotation, 12 EI / (h^3 (1 + phi)) each."""
    L, m = 6.0, 900.0
    data = read(line(head, L, 2, '0 = "fixed"\n2 = "fixed"', 1, m))
    h = L / 2
    phi = 12 * E * I / (G * A_s * h**2)
    k = 2 * 12 * E * I / (h**3 * (1 + phi))
    assert data.reference.frequency[0] == pytest.approx(np.sqrt(k / m) / (2 * np.pi), rel=1e-12)


@pytest.mark.parametrize("head", UNITS, ids=["SI", "metric", "imperial"])
def test_a_rigid_end_shortens_what_bends(head):
    """A guided column with a rigid length a: 12 EI / (L - a)^3."""
    L, a, m = 3.0, 0.4, 500.0
    unit = UNITS[head][0]
    member = f", rigid_end = {a / unit!r}"
    text = line(head, L, 1, '0 = "fixed"\n1 = ["x", "r"]', 1, m, shear=False, member=member)
    k = 12 * E * I / (L - a) ** 3
    data = read(text)
    assert data.reference.dofs == ("1.y",)
    assert data.reference.K[0, 0] == pytest.approx(k, rel=1e-12)
    assert data.reference.M[0, 0] == pytest.approx(m, rel=1e-14)


def portal(beam_more="", more="", I_b=5e-5, h=3.5, L=6.0, m=2000.0, girder=A):
    """A portal whose nodes do not move up or down."""
    return (
        SI + f'ground = "x"\n{more}[damping]\nkind = "none"\n'
        f"[nodes]\na = {{x = 0, y = 0}}\nb = {{x = 0, y = {h}}}\nc = {{x = {L}, y = 0}}\n"
        f"d = {{x = {L}, y = {h}}}\n"
        f"[sections]\ncolumn = {{E = {E}, A = {A}, I = {I}}}\n"
        f"girder = {{E = {E}, A = {girder}, I = {I_b}}}\n"
        '[members]\nab = {ends = ["a", "b"], section = "column", group = "columns"}\n'
        'cd = {ends = ["c", "d"], section = "column", group = "columns"}\n'
        f'bd = {{ends = ["b", "d"], section = "girder"{beam_more}}}\n'
        '[supports]\na = "fixed"\nb = ["y"]\nc = "fixed"\nd = ["y"]\n'
        f"[masses]\nb = {{m_x = {m / 2}}}\nd = {{m_x = {m / 2}}}\n"
    )


DIAPHRAGM = '[[diaphragms]]\nnodes = ["b", "d"]\n'


def sway(I_b, h=3.5, L=6.0):
    """Sway stiffness of a portal: both corners turn alike (slope deflection)."""
    turn = 6 * E * I / h**2 / (4 * E * I / h + 6 * E * I_b / L)
    return 2 * (12 * E * I / h**3 - 6 * E * I / h**2 * turn)


@pytest.mark.parametrize("I_b", [1e-9, 5e-5, 1e-2])
def test_a_portal_sways(I_b):
    data = read(portal(I_b=I_b) + DIAPHRAGM)
    assert data.reference.dofs == ("b.x",)
    assert data.reference.K[0, 0] == pytest.approx(sway(I_b), rel=1e-9)
    assert data.reference.M[0, 0] == pytest.approx(2000.0, rel=1e-14)


def test_a_diaphragm_is_a_member_that_does_not_stretch():
    tied, loose = read(portal() + DIAPHRAGM), read(portal(girder=1e3))
    assert len(loose.reference.dofs) == 2
    assert loose.reference.frequency[0] == pytest.approx(tied.reference.frequency[0], rel=1e-6)


def test_mass_of_a_load_is_its_weight():
    """8 kN/m on 6 m is a mass of 48 kN / g, lumped to both nodes."""
    data = read(portal(beam_more=", load = 8e3") + DIAPHRAGM)
    assert data.reference.M[0, 0] == pytest.approx(2000.0 + 48e3 / 9.80665, rel=1e-12)


FRAMES = {
    "two storeys": two_storeys(),
    "turned": two_storeys(angle=0.4),
    "tied": two_storeys(tied=True),
    "consistent": two_storeys(mass="consistent", rotatory=True, carried=300.0),
    "rigid ends": two_storeys(rigid_start=0.3, rigid_end=0.2, rigid_axially=True),
    "released": replace(
        two_storeys(), members=two_storeys().members | {"df": Member("d", "f", "slender", "steel",
        release=("end",))}
    ),
    "beam": beam(7.0, 3, {"0": ("x", "y"), "3": ("y",)}, angle=0.3, material="steel"),
    "rigid body": replace(
        two_storeys(), constraints=rigid_link(two_storeys().nodes, "e", "f")
    ),
    "lever": replace(
        two_storeys(), constraints=rigid_link(two_storeys().nodes, "c", "d")[:1]
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", FRAMES)
def test_a_file_gives_the_matrices_of_the_python_interface(name):
    frame = FRAMES[name]
    assembly = assemble(frame)
    kept = read(toml_of(frame, 'ground = "x"\ncondense = false')).reference
    assert kept.dofs == assembly.coordinates
    size = np.sqrt(np.outer(np.diag(assembly.K), np.diag(assembly.K)))
    np.testing.assert_allclose(kept.K / size, assembly.K / size, rtol=0, atol=1e-12)
    np.testing.assert_allclose(kept.M, assembly.M, rtol=1e-12, atol=1e-12 * assembly.M.max())
    np.testing.assert_allclose(kept.influence, assembly.influence("x"), rtol=0, atol=1e-12)
    names, M, K, _ = assembly.condensed()
    condensed = read(toml_of(frame)).reference
    assert condensed.dofs == names
    np.testing.assert_allclose(condensed.M, M, rtol=1e-12, atol=1e-12 * M.max())
    size = np.sqrt(np.outer(np.diag(K), np.diag(K)))
    np.testing.assert_allclose(condensed.K / size, K / size, rtol=0, atol=1e-10)
    np.testing.assert_allclose(condensed.frequency, assembly.modes().frequency, rtol=1e-9)
    effective = assembly.modes().effective_mass("x")
    np.testing.assert_allclose(
        condensed.effective_mass, effective, rtol=1e-6, atol=1e-8 * effective.sum()
    )


def test_constraints_have_the_unit_of_the_file():
    """A rigid link, once as such in metres, once as relations whose arms stand in millimetres."""
    text = portal() + '[[rigid_links]]\nleader = "b"\nfollowers = ["d"]\n'
    text = text.replace('b = ["y"]\n', "").replace('d = ["y"]\n', "")
    metres = read(text).reference
    arms = portal(h=3500.0, L=6000.0, I_b=5e-5 * 1e12, m=2.0).replace(SI, METRIC)
    arms = arms.replace(f"E = {E}", f"E = {E / 1e9}")
    arms = arms.replace(f"A = {A}", f"A = {A * 1e6}").replace(f"I = {I}", f"I = {I * 1e12}")
    arms = arms.replace('b = ["y"]\n', "").replace('d = ["y"]\n', "")
    for dof, terms in (
        ("d.x", '"b.x" = 1'),
        ("d.y", '"b.y" = 1, "b.r" = 6000.0'),
        ("d.r", '"b.r" = 1'),
    ):
        arms += f'[[constraints]]\ndof = "{dof}"\nequals = {{{terms}}}\n'
    found = read(arms).reference
    assert found.dofs == metres.dofs
    np.testing.assert_allclose(found.K, metres.K, rtol=1e-9, atol=1e-9 * metres.K.max())


def test_the_benchmarks_frame_as_a_file():
    """Table 1's modes and, with nothing condensed, the whole reference model."""
    frame, reference = planar_frame(FrameGeometry()), build_reference()
    rule = 'kind = "rayleigh"\nomega = [13.493, 165.125]\nratio = 0.05'
    published = modes(reference)
    for more in ("", "condense = false\n"):
        data = read(toml_of(frame, f'ground = "x"\n{more}', rule))
        np.testing.assert_allclose(data.reference.frequency, published.frequency, rtol=1e-9)
        total = reference.M[:3, :3].sum()
        effective = data.reference.effective_mass / total
        np.testing.assert_allclose(effective, published.effective_mass, rtol=0, atol=1e-9)
    names = [f"{i}.x" for i in (1, 2, 3)] + [f"{i}.y" for i in range(1, 13)]
    names += [f"{i}.rotation" for i in range(1, 13)] + ["base 2.rotation", "base 3.rotation"]
    at = [data.reference.dofs.index(name) for name in names]
    for found, wanted in (
        (data.reference.K, reference.K),
        (data.reference.C, reference.C),
        (data.reference.M, reference.M),
    ):
        np.testing.assert_allclose(
            found[np.ix_(at, at)], wanted, rtol=1e-12, atol=1e-12 * wanted.max()
        )


def by_hand():
    """The template's frame, assembled here from slope-deflection terms: (b.x, b.y, d.y, b.r, d.r,
    c.r) with d.x = b.x."""
    h, L, a = 3.0, 5.0, 0.1
    EI, EA = 210e9 * 3.9e-5, 210e9 * 5.4e-3
    EI_l = 210e9 * 2e-6  # of the slender column, a to b
    K = np.zeros((6, 6))
    K[0, 0] = 12 * (EI + EI_l) / h**3
    K[0, 3] = K[3, 0] = 6 * EI_l / h**2
    K[0, 4] = K[4, 0] = K[0, 5] = K[5, 0] = 6 * EI / h**2
    K[3, 3] = 4 * EI_l / h
    K[4, 4] = K[5, 5] = 4 * EI / h
    K[4, 5] = K[5, 4] = 2 * EI / h
    K[1, 1] = K[2, 2] = EA / h
    l, EI_b = L - 2 * a, 210e9 * 8.4e-5
    phi = 12 * EI_b / (81e9 * 2.1e-3 * l**2)
    near, far = (4 + phi) * EI_b / (l * (1 + phi)), (2 - phi) * EI_b / (l * (1 + phi))
    bend = np.array([[near, far], [far, near]])
    # End rotations less the chord's: the rigid ends lift by a r at b and lower by a r at d.
    turn = np.array([[1 / l, -1 / l, 1 + a / l, a / l], [1 / l, -1 / l, a / l, 1 + a / l]])
    K[np.ix_([1, 2, 3, 4], [1, 2, 3, 4])] += turn.T @ bend @ turn
    carried = (7850 * 5.4e-3 + 8e3 / 9.80665) * L / 2
    M = np.diag([7500 + 2 * carried, 1500 + carried, 6000 + carried, 400, 0, 0])
    return M, K


def test_the_template_parses_and_is_the_frame_it_describes(tmp_path):
    write_template(tmp_path / "problem.toml")
    data = read_problem(tmp_path / "problem.toml").structure
    M, K = by_hand()
    flexible = np.linalg.inv(K)[:4, :4] @ M[:4, :4]
    omega = 1 / np.sqrt(np.sort(np.linalg.eigvals(flexible).real)[::-1])
    np.testing.assert_allclose(data.reference.frequency, omega / (2 * np.pi), rtol=1e-9)
    h, EI = 3.0, 210e9 * 2e-6
    column = EI * np.array([[12 / h**3, 6 / h**2], [6 / h**2, 4 / h]])
    np.testing.assert_allclose(data.laboratory.K, column, rtol=1e-12)
    np.testing.assert_allclose(data.laboratory.M, np.zeros((2, 2)), atol=1e-12)
    assert data.interface == ("b.x", "b.rotation")
    assert [m.name for m in data.members if m.laboratory] == ["left column"]
    assert data.members[2].start == (0.0, 3.0) and data.members[2].end == (5.0, 3.0)
    assert data.reference.effective_mass.sum() == pytest.approx(M[0, 0], rel=1e-12)
    with pytest.raises(Exception, match="exists already"):
        write_template(tmp_path / "problem.toml")


RULES = {
    "none": 'kind = "none"',
    "rayleigh": 'kind = "rayleigh"\nmodes = [1, 2]\nratio = 0.05',
    "rayleigh apart": 'kind = "rayleigh"\nmodes = [1, 3]\nratio = [0.02, 0.03]',
    "omega": 'kind = "rayleigh"\nomega = [10.0, 80.0]\nratio = 0.04',
    "coefficients": 'kind = "rayleigh"\na_0 = 0.3\na_1 = 2e-4',
    "modal": 'kind = "modal"\nratio = 0.03',
    "modal list": 'kind = "modal"\nratio = [0.03, 0.02]',
    "caughey": 'kind = "caughey"\nmodes = [1, 2, 4]\nratio = [0.02, 0.03, 0.2]',
}


@pytest.mark.parametrize("rule", RULES)
def test_a_rule_of_damping_gives_its_ratios(rule):
    found = read(toml_of(two_storeys(), damping=RULES[rule])).reference
    omega_2, phi = np.linalg.eig(np.linalg.solve(found.M, found.K))
    order = np.argsort(omega_2.real)
    omega, phi = np.sqrt(omega_2.real[order]), phi.real[:, order]
    modal = np.einsum("in,ij,jn->n", phi, found.M, phi)
    ratio = np.einsum("in,ij,jn->n", phi, found.C, phi) / (2 * omega * modal)
    a = caughey_coefficients(omega[[0, 1, 3]], [0.02, 0.03, 0.2])
    wanted = {
        "none": 0 * omega,
        "modal": 0.03 + 0 * omega,
        "modal list": [0.03, 0.02, *0 * omega[2:]],
        "coefficients": 0.3 / omega / 2 + 2e-4 * omega / 2,
        "caughey": (a[0] / omega + a[1] * omega + a[2] * omega**3) / 2,
    }
    if rule in wanted:
        np.testing.assert_allclose(ratio, wanted[rule], rtol=1e-8, atol=1e-10)
    elif rule == "omega":
        a_0, a_1 = 2 * 0.04 * 800 / 90, 2 * 0.04 / 90
        np.testing.assert_allclose(ratio, a_0 / omega / 2 + a_1 * omega / 2, rtol=1e-8)
    else:
        second, pair = (1, [0.05, 0.05]) if rule == "rayleigh" else (2, [0.02, 0.03])
        np.testing.assert_allclose(ratio[[0, second]], pair, rtol=1e-9)


def test_a_caughey_series_leaves_what_has_no_mass_undamped():
    """With a rotation kept for an actuator, the modes have the ratios that they have without."""
    free = read(toml_of(two_storeys(), damping=RULES["caughey"])).reference
    found = with_part("a column", RULES["caughey"]).reference
    heavy = [i for i, name in enumerate(found.dofs) if not name.endswith(".rotation")]
    assert len(heavy) == len(found.dofs) - 1
    np.testing.assert_allclose(
        found.C[np.ix_(heavy, heavy)], free.C, rtol=1e-8, atol=1e-8 * free.C.max()
    )
    assert not np.any(np.delete(found.C, heavy, axis=0))


#: Laboratory parts of the two-storey frame: members and masses, interface, what is held there.
PARTS = {
    "a column": ('["ac"]', '["c.x", "c.r"]', "[]"),
    "column and mass": ('["ac", "at c"]', '["c.x", "c.y", "c.r"]', "[]"),
    "column on rollers": ('["ac", "at c"]', '["c.x"]', '["c.r"]'),
    "storey": ('["ac", "bd", "cd", "at c", "at d"]', '["c.x", "c.r", "d.x"]', "[]"),
    "top": ('["ce", "df", "ef", "at e"]', '["c.x", "d.x", "e.x"]', '["c.y", "d.y"]'),
    "all at e": ('["ce", "ef"]', '["e.x", "e.y", "c.x", "f.y"]', "[]"),
}


def with_part(part, rule='kind = "none"'):
    members, interface, held = PARTS[part]
    more = (
        f'ground = "x"\nlaboratory = {members}\ninterface = {interface}\n'
        f'laboratory_held = {held}\noutputs = ["f.x"]'
    )
    return read(toml_of(two_storeys(), more, rule))


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("part", PARTS)
def test_numerical_and_laboratory_part_are_the_reference(part, rule):
    data = with_part(part, RULES[rule])
    E_b = np.zeros((len(data.reference.dofs), len(data.interface)))
    for j, name in enumerate(data.interface):
        E_b[data.reference.dofs.index(name), j] = 1.0
    assert list(data.at) == [data.reference.dofs.index(name) for name in data.interface]
    for matrix in "MCK":
        whole, numerical, laboratory = (
            getattr(p, matrix) for p in (data.reference, data.numerical, data.laboratory)
        )
        atol = 1e-12 * max(np.abs(whole).max(), 1e-300)
        np.testing.assert_allclose(numerical + E_b @ laboratory @ E_b.T, whole, rtol=0, atol=atol)
        assert np.array_equal(laboratory, laboratory.T)
    size = np.sqrt(np.diag(data.reference.K))
    left = np.linalg.eigvalsh(data.numerical.K / np.outer(size, size))
    if PARTS[part][2] == "[]":  # what is free in the laboratory takes no more than there is
        assert left.min() > -1e-9
    told = any("stiffness is negative" in note for note in data.notes)
    assert told == (left.min() < -1e-9)


@pytest.mark.parametrize("part", PARTS)
def test_the_laboratory_answers_as_its_members_alone(part):
    """Members of the part alone, moved at the interface with all else free but what is held."""
    members, interface, held = (
        [name.replace(".r", ".rotation") for name in eval(text)] for text in PARTS[part]
    )
    frame = two_storeys()
    dofs = frame.dofs
    K = np.zeros((len(dofs),) * 2)
    touched = set()
    for name in set(members) & set(frame.members):
        m = frame.members[name]
        at = [dofs.index(f"{n}.{d}") for n in (m.start, m.end) for d in ("x", "y", "rotation")]
        K[np.ix_(at, at)] += frame.member_matrices(name)[0]
        touched |= set(at)
    b = [dofs.index(name) for name in interface]
    rest = [i for i in touched if i not in b and dofs[i] not in (*frame.held, *held)]
    wanted = K[np.ix_(b, b)] - K[np.ix_(b, rest)] @ np.linalg.solve(
        K[np.ix_(rest, rest)], K[np.ix_(rest, b)]
    )
    found = with_part(part).laboratory
    np.testing.assert_allclose(found.K, wanted, rtol=0, atol=1e-9 * np.abs(wanted).max())


def column_in_pieces(pieces, density):
    """A portal whose left column, in the laboratory, is of several members."""
    text = portal(more='laboratory = ["columns left"]\ninterface = ["b.x", "b.r"]\n')
    old = 'ab = {ends = ["a", "b"], section = "column", group = "columns"}\n'
    names = ["a", *(f"p{i}" for i in range(1, pieces)), "b"]
    rows = [
        f'l{i} = {{ends = ["{names[i]}", "{names[i + 1]}"], section = "column", '
        f'group = "columns left"}}\n'
        for i in range(pieces)
    ]
    text = text.replace(old, "".join(rows)).replace(f"I = {I}}}", f"I = {I}, density = {density}}}")
    nodes = [f"p{i} = {{x = 0, y = {3.5 * i / pieces}}}\n" for i in range(1, pieces)]
    return text.replace("[nodes]\n", "[nodes]\n" + "".join(nodes)) + DIAPHRAGM


def test_nodes_inside_the_specimen_are_condensed():
    """Without mass exactly; with mass as Guyan does, and the loss is told."""
    one, three = read(column_in_pieces(1, 0.0)), read(column_in_pieces(3, 0.0))
    for a, b in ((one.laboratory, three.laboratory), (one.numerical, three.numerical)):
        assert a.dofs == b.dofs
        np.testing.assert_allclose(a.K, b.K, rtol=1e-9, atol=1e-9 * np.abs(a.K).max())
    assert any(note.startswith("Only the laboratory part has p1.x") for note in three.notes)
    assert not any("change by" in note for note in three.notes)
    heavy = read(column_in_pieces(3, 7850.0))
    assert any("p1.x, p1.y, p2.x, p2.y have mass" in note for note in heavy.notes)
    h, m = 3.5, 7850 * A * 3.5 / 3
    z = np.array([1 / 3, 2 / 3])
    shape = np.array([3 * z**2 - 2 * z**3, -h * (z**3 - z**2)])  # x per (b.x, b.r)
    wanted = m * shape @ shape.T
    wanted[0, 0] += m / 2
    np.testing.assert_allclose(heavy.laboratory.M, wanted, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(heavy.numerical.M[0, 0], 2000 + 1.5 * m, rtol=1e-9)
    load = heavy.reference.M @ heavy.reference.influence
    np.testing.assert_allclose(
        load[heavy.at], [2000 + 2 * m + m * shape[0].sum(), m * shape[1].sum()], rtol=1e-9
    )
    text = column_in_pieces(3, 7850.0)
    whole = text[: text.index("laboratory")] + text[text.index("[damping]") :]
    change = 100 * (heavy.reference.frequency[0] / read(whole).reference.frequency[0] - 1)
    assert any(f"change by {change:+.2g} %" in note for note in heavy.notes) and change != 0


def test_a_floors_degree_of_freedom_goes_by_the_name_of_the_interface():
    """d.x follows b.x; whichever is named is what the result calls it."""
    for name in ("b.x", "d.x"):
        more = (
            f'laboratory = ["columns"]\ninterface = ["{name}"]\noutputs = ["b.x", "d.x", "b.r"]\n'
        )
        data = read(portal(more=more) + DIAPHRAGM)
        assert data.reference.dofs == (name,) and data.interface == (name,)
        assert data.outputs == ("b.x", "d.x", "b.rotation")
        turn = -6 * E * I / 3.5**2 / (4 * E * I / 3.5 + 6 * E * 5e-5 / 6.0)
        np.testing.assert_allclose(data.output_rows[:, 0], [1, 1, turn], rtol=1e-9)


def test_damping_of_the_laboratory():
    """Its share of Rayleigh damping, none of modal damping, or a rule of its own."""
    more = 'ground = "x"\nlaboratory = ["ac", "at c"]\ninterface = ["c.x", "c.r"]'
    shared = read(toml_of(two_storeys(), more, RULES["coefficients"])).laboratory
    np.testing.assert_allclose(shared.C, 0.3 * shared.M + 2e-4 * shared.K, rtol=1e-12)
    modal = read(toml_of(two_storeys(), more, RULES["modal"]))
    assert not np.any(modal.laboratory.C) and "no damping of its own" in modal.notes[-1]
    own = RULES["modal"] + '\n[laboratory_damping]\nkind = "modal"\nratio = 0.02'
    data = read(toml_of(two_storeys(), more, own))
    M, C, K = data.laboratory.M, data.laboratory.C, data.laboratory.K
    k = K[0, 0] - K[0, 1] ** 2 / K[1, 1]
    assert M[1, 1] == 0
    assert C[0, 0] == pytest.approx(2 * 0.02 * np.sqrt(k * M[0, 0]), rel=1e-9)


def test_the_ground_moves_along_any_direction():
    """l of a slanting motion is the cosines; without constraints they stand on x and y."""
    data = read(toml_of(two_storeys(), "ground = [3, 4]\n"))
    wanted = [{"x": 0.6, "y": 0.8}[name[-1]] for name in data.reference.dofs]
    np.testing.assert_allclose(data.reference.influence, wanted, rtol=0, atol=1e-12)


def test_the_template_is_the_text_that_is_written():
    assert template().startswith("# A problem of virtual")
