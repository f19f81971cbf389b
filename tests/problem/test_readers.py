"""Models of other programs: OpenSees' printed model, and matrices with names."""

import json
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import csc_matrix

from martths_jax.errors import InputError
from martths_jax.structure.assembly import assemble
from martths_jax.structure.planar import FIXED, PlanarFrame
from martths_jax.structure.readers.labelled import labelled, read_arrays
from martths_jax.structure.readers.opensees import read_opensees
from martths_jax.structure.units import Units
from tests.problem.texts import read, toml_of
from tests.structure.frames import two_storeys

PRINTED = Path(__file__).parent / "opensees_portal.json"
#: Circular frequencies [rad/s] that OpenSees 3.7.1 gave for the model it printed, with nodes 1
#: fixed and 2 pinned, and equalDOF 3 4 1 (eigen -fullGenLapack 8).
OMEGA = [
    10.552824735809589, 28.417501074792764, 202.37730138515784, 204.05066273662254,
    387.75482334986134, 469.44291544, 490.43468357096697, 499.4086099335457,
]  # fmt: skip
#: The same without equalDOF (eigen 9): the girder stretches between its rigid offsets.
OMEGA_LOOSE = [
    10.552026982280612, 28.406342364055387, 202.37723700505475, 204.05054722317615,
    382.830809761541, 392.74923575723, 469.449915213352, 490.43480458223473, 499.40869705696997,
]  # fmt: skip
BESIDE = """units = "SI"
ground = "x"
laboratory = ["1", "mass 3"]
interface = ["3.x", "3.r"]
[damping]
kind = "none"
[opensees]
file = "model.json"
[supports]
1 = "fixed"
2 = "pinned"
[[diaphragms]]
nodes = [3, 4]
"""


def model(tmp_path, change=lambda data: None):
    """The printed model, changed, beside a problem file."""
    data = json.loads(PRINTED.read_text())
    change(data["StructuralAnalysisModel"])
    (tmp_path / "model.json").write_text(json.dumps(data))
    return tmp_path


def test_opensees_own_frequencies(tmp_path):
    """Rigid offsets, a release, shear, mass per length, a rotary mass, as OpenSees has them."""
    data = read(BESIDE, model(tmp_path))
    np.testing.assert_allclose(2 * np.pi * data.reference.frequency, OMEGA, rtol=1e-9)
    loose = read(BESIDE[: BESIDE.index("[[diaphragms]]")], tmp_path)
    np.testing.assert_allclose(2 * np.pi * loose.reference.frequency, OMEGA_LOOSE, rtol=1e-9)
    assert [m.name for m in data.members if m.laboratory] == ["1"]
    column = 210e9 * 3.9e-5 * np.array([[12 / 3.5**3, 6 / 3.5**2], [6 / 3.5**2, 4 / 3.5]])
    np.testing.assert_allclose(data.laboratory.K, column, rtol=1e-12)
    share = 42 * 3.5 / 2
    np.testing.assert_allclose(data.laboratory.M[0, 0], 4200 + share, rtol=1e-12)


def test_what_some_versions_print_of_constraints(tmp_path):
    """Fixities and an equal degree of freedom in the model itself give the same."""

    def constrained(m):
        fixed = [(1, 1), (1, 2), (1, 3), (2, 1), (2, 2)]
        m["geometry"]["constraints"] = [
            {"name": i, "node": node, "dof": dof, "ref_value": 0}
            for i, (node, dof) in enumerate(fixed)
        ] + [{"name": "9", "node": 4, "ref_node": 3, "dofs": [1], "ref_dof": [1],
              "matrix": [[1]]}]  # fmt: skip

    text = BESIDE[: BESIDE.index("[supports]")]
    found = read(text, model(tmp_path, constrained)).reference
    wanted = read(BESIDE, model(tmp_path)).reference
    assert found.dofs == wanted.dofs
    np.testing.assert_array_equal(found.K, wanted.K)
    np.testing.assert_array_equal(found.M, wanted.M)

    def older(m):
        constrained(m)
        m["geometry"]["constraints"][-1] = {
            "name": "9", "node_constrained": 4, "node_retained": 3, "constrained_dof": [1],
            "retained_dof": [1],
        }  # fmt: skip

    np.testing.assert_array_equal(read(text, model(tmp_path, older)).reference.K, wanted.K)


def test_a_rigid_beam_between_nodes_has_the_units_of_the_file(tmp_path):
    """The matrix of a rigid link in millimetres is one of lengths."""

    def linked(m):
        m["geometry"]["constraints"] = [
            {"name": "1", "node": 2, "ref_node": 1, "dofs": [1, 2, 3], "ref_dof": [1, 2, 3],
             "matrix": [[1, 0, -500.0], [0, 1, 2000.0], [0, 0, 1]]}
        ]  # fmt: skip
        m["geometry"]["nodes"] = m["geometry"]["nodes"][:2]
        m["geometry"]["elements"] = []

    found = read_opensees(model(tmp_path, linked) / "model.json", Units("mm", "kN", "t"))
    assert found.nodes["2"].x == 6e-3
    x, y, turn = found.relations
    assert x.terms == {"1.x": 1.0, "1.rotation": pytest.approx(-0.5)}
    assert y.terms == {"1.y": 1.0, "1.rotation": pytest.approx(2.0)}
    assert turn.terms == {"1.rotation": 1.0}


def test_mass_of_an_element_counts_between_its_rigid_ends(tmp_path):
    def heavy(m):
        m["geometry"]["elements"][4]["massperlength"] = 100.0

    members = read_opensees(model(tmp_path, heavy) / "model.json", Units()).members
    assert members["5"].carried * 6.0 == pytest.approx(100.0 * 5.5, rel=1e-12)
    assert (members["5"].rigid_start, members["5"].rigid_end) == pytest.approx((0.2, 0.3))
    assert members["4"].release == ("end",) and members["1"].release == ()


def element(**changes):
    return lambda m: m["geometry"]["elements"][1].update(changes)


def node(**changes):
    return lambda m: m["geometry"]["nodes"][1].update(changes)


def transformation(**changes):
    return lambda m: m["properties"]["crdTransformations"][0].update(changes)


def constraint(**entry):
    return lambda m: m["geometry"].update(constraints=[entry])


REFUSED = {
    "type": (element(type="ForceBeamColumn2d"),
             "element 2 is of type ForceBeamColumn2d: only ElasticBeam2d and"),
    "in space": (element(type="ElasticBeam3d"), "element 2 is of type ElasticBeam3d: only"),
    "unknown node": (element(nodes=[2, 44]), "element 2 names the node 44, which is unknown."),
    "no area": (lambda m: m["geometry"]["elements"][1].pop("A"), "element 2 has no entry 'A'."),
    "negative": (element(Iz=-1), "element 2: Argument `I` must be a number above zero (m^4)"),
    "length": (element(nodes=[2, 2]), "element 2 has no length: both its nodes stand at the"),
    "twice": (element(name=1), "element 1 stands twice."),
    "release": (element(release=7), "element 2 has no entry 7."),
    "words": (element(E="steel"), "element 2 cannot be read: {"),
    "no transformation": (element(crdTransformation="8"),
                          "element 2 names the transformation 8, which is unknown."),
    "large": (transformation(type="PDeltaCrdTransf2d"),
              "element 1 stands on a transformation of type PDeltaCrdTransf2d: only Linear"),
    "aside": (transformation(iOffset=[0.1, 0.2]),
              "element 1 has an offset iOffset that does not point along it: only rigid ends"),
    "through": (transformation(iOffset=[0, 2.0], jOffset=[0, -1.5]),
                "element 1 has no length left between its offsets."),
    "three": (node(ndf=6, crd=[0, 0, 0]),
              "node 2 has 3 coordinates and 6 degrees of freedom: only"),
    "node twice": (node(name=1), "node 1 stands twice."),
    "mass": (node(mass=[1, -2, 0]), "node 2 has a negative mass, -2."),
    "pushed": (constraint(name=4, node=1, dof=1, ref_value=0.1),
               "constraint 4 moves its node by 0.1: only 0 can be read."),
    "held nowhere": (constraint(name=4, node=77, dof=1), "constraint 4 names the node 77, which"),
    "fourth": (constraint(name=4, node=1, dof=4), "constraint 4 names the degree of freedom 4: a"),
    "other": (constraint(name=4, nodes=[1]), "constraint 4 is neither a fixity nor a constraint"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_read_is_refused_by_its_name(case, tmp_path):
    change, sentence = REFUSED[case]
    path = model(tmp_path, change) / "model.json"
    with pytest.raises(InputError) as found:
        read_opensees(path, Units())
    assert f"File {path}: {sentence}" in str(found.value), found.value


def test_a_file_that_is_no_model(tmp_path):
    path = tmp_path / "model.json"
    with pytest.raises(InputError, match=r"cannot be read \(No such file"):
        read_opensees(path, Units())
    for text, sentence in (("{", "is no JSON"), ("[]", "is no model of OpenSees"),
                           ('{"StructuralAnalysisModel": {}}', "is no model of")):  # fmt: skip
        path.write_text(text)
        with pytest.raises(InputError, match=sentence):
            read_opensees(path, Units())
    with pytest.raises(InputError, match=r"problem.toml, line 8: File .*model.json is no model"):
        read(BESIDE, tmp_path)


# --- matrices ---------------------------------------------------------------------------------

FRAME = two_storeys()
WHOLE = assemble(FRAME)
NAMES = [name.replace(".rotation", ".r") for name in WHOLE.coordinates]
ASKED = 'units = "SI"\nground = "x"\ninterface = ["c.x", "c.r"]\noutputs = ["e.x", "f.r"]\n'
RAYLEIGH = '[damping]\nkind = "rayleigh"\nmodes = [1, 2]\nratio = 0.02\n'


def specimen():
    """The column ac alone, on its free degrees of freedom."""
    part = PlanarFrame(
        nodes={n: FRAME.nodes[n] for n in "ac"},
        sections=FRAME.sections,
        materials=FRAME.materials,
        members={"ac": FRAME.members["ac"]},
        supports={"a": FIXED},
    )
    return assemble(part)


def write_npz(folder, stem, names, **matrices):
    np.savez(folder / f"{stem}.npz", dofs=np.array(names), **matrices)
    return f'file = "{stem}.npz"\n'


def write_mat(folder, stem, names, **matrices):
    sparse = {name: csc_matrix(m) if m.ndim == 2 else m for name, m in matrices.items()}
    savemat(folder / f"{stem}.mat", {"dofs": np.array(names, dtype=object), **sparse})
    return f'file = "{stem}.mat"\n'


def write_mat_73(folder, stem, names, **matrices):
    """As MATLAB writes version 7.3: transposed, texts as numbers, cells as references."""
    with h5py.File(folder / f"{stem}.mat", "w", userblock_size=512) as file:
        for name, matrix in matrices.items():
            file[name] = np.atleast_2d(matrix).T
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
        cells = []
        for i, name in enumerate(names):
            item = file.create_dataset(f"#refs#/{i}", data=np.array([[ord(c)] for c in name], "u2"))
            item.attrs["MATLAB_class"] = np.bytes_("char")
            cells.append(item.ref)
        file.create_dataset("dofs", data=np.array([cells], dtype=h5py.ref_dtype))
        file["dofs"].attrs["MATLAB_class"] = np.bytes_("cell")
    return f'file = "{stem}.mat"\n'


def write_csv(folder, stem, names, **matrices):
    """Each matrix in a file of its own, with names above and beside it."""
    text = ""
    for name, matrix in matrices.items():
        rows = [",".join(["", *names])]
        rows += [
            ",".join([n, *map(repr, map(float, row))]) for n, row in zip(names, matrix, strict=True)
        ]
        (folder / f"{stem}_{name}.csv").write_text("\n".join(rows) + "\n")
        text += f'{name} = "{stem}_{name}.csv"\n'
    return text


def write_bare_csv(folder, stem, names, **matrices):
    """Numbers only; the names stand in the problem file."""
    text = f"dofs = {json.dumps(names)}\n"
    for name, matrix in matrices.items():
        np.savetxt(folder / f"{stem}_{name}.csv", matrix, delimiter=",", fmt="%.17g")
        text += f'{name} = "{stem}_{name}.csv"\n'
    return text


WRITERS = [write_npz, write_mat, write_mat_73, write_csv, write_bare_csv]


@pytest.mark.parametrize("write", WRITERS)
def test_matrices_give_what_the_frame_gives(write, tmp_path):
    part = specimen()
    own = [name.replace(".rotation", ".r") for name in part.coordinates]
    text = ASKED + RAYLEIGH + "[matrices]\n" + write(tmp_path, "all", NAMES, K=WHOLE.K, M=WHOLE.M)
    text += "[laboratory_matrices]\n" + write(tmp_path, "part", own, K=part.K, M=part.M)
    found = read(text, tmp_path)
    more = 'laboratory = ["ac"]\n' + ASKED.replace('units = "SI"\n', "").strip()
    wanted = read(toml_of(FRAME, more, RAYLEIGH[10:]))
    for name in ("reference", "numerical", "laboratory"):
        a, b = getattr(found, name), getattr(wanted, name)
        assert a.dofs == b.dofs
        for matrix in "MCK":
            x, y = getattr(a, matrix), getattr(b, matrix)
            np.testing.assert_allclose(x, y, rtol=0, atol=1e-12 * np.abs(y).max())
        np.testing.assert_allclose(a.influence, b.influence, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.output_rows, wanted.output_rows, rtol=0, atol=1e-9)
    assert found.members == () and found.interface == ("c.x", "c.rotation")


def test_damping_and_influence_of_a_file(tmp_path):
    C = 0.2 * WHOLE.M + 1e-3 * WHOLE.K
    r = WHOLE.influence([3, 4])
    asked = ASKED.replace('ground = "x"\n', "condense = false\n")
    text = asked.replace('interface = ["c.x", "c.r"]\n', "") + "[matrices]\n"
    text += write_npz(tmp_path, "all", NAMES, K=WHOLE.K, M=WHOLE.M, C=C, r=r)
    found = read(text, tmp_path).reference
    np.testing.assert_allclose(found.C, C, rtol=1e-14)
    np.testing.assert_allclose(found.influence, r, rtol=0, atol=1e-15)
    condensed = read(text.replace("condense = false\n", ""), tmp_path)
    assert condensed.notes[-1].endswith("but the damping that acts on them follows the others.")
    kept = [i for i, name in enumerate(NAMES) if not name.endswith(".r")]
    turns = [i for i, name in enumerate(NAMES) if name.endswith(".r")]
    R = np.zeros((len(NAMES), len(kept)))
    R[kept] = np.eye(len(kept))
    K = WHOLE.K
    R[turns] = -np.linalg.solve(K[np.ix_(turns, turns)], K[np.ix_(turns, kept)])
    np.testing.assert_allclose(condensed.reference.C, R.T @ C @ R, rtol=1e-9, atol=1e-9 * C.max())


def test_a_specimen_may_have_degrees_of_freedom_of_its_own(tmp_path):
    """A chain of two springs k and 3k: at its end 3k/4, with the inner mass by its motion."""
    k, m = 4000.0, 8.0
    whole = {"K": np.array([[9000.0]]), "M": np.array([[50.0]])}
    inner = {"K": k * np.array([[3.0, -3.0], [-3.0, 4.0]]), "M": np.diag([2.0, m]),
             "C": np.array([[6.0, -6.0], [-6.0, 10.0]])}  # fmt: skip
    text = 'units = "SI"\nground = "x"\ninterface = ["top.x"]\n[damping]\nkind = "none"\n'
    text += "[matrices]\n" + write_npz(tmp_path, "all", ["top.x"], **whole)
    text += "[laboratory_matrices]\n" + write_npz(tmp_path, "part", ["top.x", "mid.x"], **inner)
    data = read(text, tmp_path)
    assert data.laboratory.K[0, 0] == pytest.approx(3 * k / 4, rel=1e-12)
    assert data.laboratory.M[0, 0] == pytest.approx(2 + m * 0.75**2, rel=1e-12)
    assert data.laboratory.C[0, 0] == pytest.approx(6 - 9 + 10 * 0.75**2, rel=1e-12)
    assert data.numerical.K[0, 0] == pytest.approx(9000 - 3 * k / 4, rel=1e-12)


@pytest.mark.parametrize("write", WRITERS[:3])
def test_rows_stay_rows(write, tmp_path):
    """A matrix that is not symmetric, and a vector, come as they were written."""
    K, r = np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([5.0, 6.0])
    name = write(tmp_path, "odd", ["a.x", "b.x"], K=K, r=r).split('"')[1]
    arrays, names = read_arrays(tmp_path / name)
    np.testing.assert_array_equal(arrays["K"], K)
    np.testing.assert_array_equal(arrays["r"].ravel(), r)
    assert names == ("a.x", "b.x")


def test_matrices_in_other_units(tmp_path):
    """kN, mm and t: entries of rotations are moments per radian."""
    arm = np.array([1.0 if not n.endswith(".r") else 1e3 for n in NAMES])
    K, M = WHOLE.K / 1e6 * np.outer(arm, arm), WHOLE.M / 1e3 * np.outer(arm, arm)
    text = ASKED.replace('units = "SI"', 'length = "mm"\nforce = "kN"\nmass = "t"')
    text = text.replace('interface = ["c.x", "c.r"]\n', "condense = false\n") + RAYLEIGH
    text += "[matrices]\n" + write_npz(tmp_path, "all", NAMES, K=K, M=M)
    found = read(text, tmp_path).reference
    r = np.linspace(0.1, 1.2, len(NAMES))
    more = "influence = [" + ", ".join(map(repr, map(float, r / arm))) + "]\n"
    led = read(text.replace('ground = "x"\n', "") + more, tmp_path).reference
    np.testing.assert_allclose(led.influence, r, rtol=1e-14)
    np.testing.assert_allclose(found.K, WHOLE.K, rtol=1e-12, atol=1e-12 * WHOLE.K.max())
    np.testing.assert_allclose(found.M, WHOLE.M, rtol=1e-12, atol=1e-9)


def bent(name, i, j, value):
    def change(arrays):
        arrays[name] = arrays[name].copy()
        arrays[name][i, j] = value

    return change


BAD = {
    "missing": (lambda a: a.pop("M"), "Matrix M is missing: known are K."),
    "misshapen": (lambda a: a.update(M=a["M"][:3]), "Matrix M must be 12 x 12, one row and"),
    "vector": (lambda a: a.update(K=a["K"][0]), "Matrix K must be 12 x 12, one row and column a "
               "name of `dofs`, but is 12."),
    "asymmetric": (bent("K", 0, 1, 5e6), "Matrix K is not symmetric: 5e+06 at c.x, c.y, but"),
    "no number": (bent("M", 0, 0, np.nan), "Matrix M holds no number at c.x, c.x."),
    "influence": (lambda a: a.update(r=np.ones(3)), "The influence vector r must be 12 numbers,"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_a_bad_matrix_is_one_sentence(case, tmp_path):
    change, sentence = BAD[case]
    arrays = {"K": WHOLE.K, "M": WHOLE.M}
    change(arrays)
    text = ASKED + RAYLEIGH + "[matrices]\n" + write_npz(tmp_path, "all", NAMES, **arrays)
    line = text.splitlines().index('file = "all.npz"') + 1
    with pytest.raises(InputError) as found:
        read(text, tmp_path)
    assert str(found.value).startswith(f"{tmp_path / 'problem.toml'}, line {line}: {sentence}")


def test_names_and_files_of_matrices(tmp_path):
    arrays = {"K": WHOLE.K, "M": WHOLE.M}
    with pytest.raises(InputError, match="The names of the degrees of freedom are missing"):
        labelled(arrays, None, Units())
    with pytest.raises(InputError, match=r"`dofs` names 'c.rotation' twice"):
        labelled(arrays, ["c.r", "c.rotation", *NAMES[2:]], Units())
    with pytest.raises(InputError, match=r"has an unknown ending: known are .npz, .mat, .csv"):
        read_arrays(tmp_path / "K.xlsx")
    with pytest.raises(InputError, match=r"K.npz cannot be read \(No such file"):
        read_arrays(tmp_path / "K.npz")
    for ending in ("npz", "mat"):
        (tmp_path / f"K.{ending}").write_bytes(b"nothing")
        with pytest.raises(InputError, match=rf"K.{ending} cannot be read \(.*; save it again"):
            read_arrays(tmp_path / f"K.{ending}")
    for text, sentence in (
        ("a,b\n1,2\n2,x\n", "row 2 of numbers, holds 'x': no number."),
        ("1,2\n2\n", "row 2 of numbers, has 1 entries, the first row 2: complete it."),
        (",a,b\na,1,2\nc,2,3\n", "names its rows in another way than its columns."),
    ):
        (tmp_path / "K.csv").write_text(text)
        with pytest.raises(InputError) as found:
            read_arrays(tmp_path / "K.csv")
        assert sentence in str(found.value)
    np.savez(tmp_path / "pickled.npz", K=np.array([{}], dtype=object))
    with pytest.raises(InputError, match="Object arrays cannot be loaded"):
        read_arrays(tmp_path / "pickled.npz")


def test_files_that_name_different_degrees_of_freedom(tmp_path):
    text = ASKED + RAYLEIGH + "[matrices]\n" + write_csv(tmp_path, "all", NAMES, K=WHOLE.K)
    text += write_csv(tmp_path, "other", NAMES[::-1], M=WHOLE.M)
    with pytest.raises(InputError, match="line 11: Matrix M has other names than K"):
        read(text, tmp_path)
    text = ASKED + RAYLEIGH + '[matrices]\nfile = "a.npz"\nK = "b.csv"\n'
    with pytest.raises(InputError, match="line 9: Give `file` with all matrices, or a file each"):
        read(text, tmp_path)
