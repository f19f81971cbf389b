"""Whole frames against closed forms, and what turning or moving them leaves as it is."""

from dataclasses import replace

import numpy as np
import pytest

from martths_jax.structure.assembly import assemble, free_matrices
from martths_jax.structure.constraints import diaphragm
from martths_jax.structure.members import Member
from martths_jax.structure.planar import FIXED
from tests.structure.frames import SLENDER, STEEL, frame, two_storeys


@pytest.mark.parametrize(("height", "bay"), [(3.0, 6.0), (4.0, 2.5)])
def test_portal_sways_as_in_the_textbook(height, bay):
    """24 EI / h^3 (12 rho + 1) / (12 rho + 4), rho = beam over two columns (Chopra, eq. 1.3.5)."""
    m = {"section": "slender", "material": "steel", "mass": "none"}
    built = frame(
        {"a": (0, 0), "b": (bay, 0), "c": (0, height), "d": (bay, height)},
        {
            "left": Member("a", "c", **m),
            "right": Member("b", "d", **m),
            "beam": Member("c", "d", **m),
        },
        {"a": FIXED, "b": FIXED, "c": ("y",), "d": ("y",)},
        masses={"c.x": 500.0},
        constraints=diaphragm("cd"),
    )
    EI = STEEL.E * SLENDER.I
    rho = (EI / bay) / (2 * EI / height)
    sway = 24 * EI / height**3 * (12 * rho + 1) / (12 * rho + 4)
    model = assemble(built)
    names, _, K, R = model.condensed()
    assert names == ("c.x",)
    np.testing.assert_allclose(K, [[sway]], rtol=1e-9)
    np.testing.assert_allclose(model.modes().omega, [np.sqrt(sway / 500.0)], rtol=1e-9)
    turn = -6 / height**2 / (4 / height + 6 / bay)  # both joints, as the storey moves by one
    np.testing.assert_allclose(np.abs(R[1:, 0]), -turn, rtol=1e-9)


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
@pytest.mark.parametrize("angle", [0.3, np.pi / 2, -2.2])
def test_turning_a_frame_changes_nothing_but_its_axes(angle, mass):
    more = {"mass": mass, "rigid_end": 0.1, "rotatory": mass == "consistent"}
    still = assemble(two_storeys(**more))
    turned = assemble(two_storeys(angle, shift=(12.0, -7.0), **more))
    assert still.coordinates == turned.coordinates
    c, s = np.cos(angle), np.sin(angle)
    R = np.kron(np.eye(4), np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]))
    for before, after in ((still.K, turned.K), (still.M, turned.M)):
        np.testing.assert_allclose(R @ before @ R.T, after, atol=1e-12 * np.abs(before).max())
    before, after = still.modes(), turned.modes()
    np.testing.assert_allclose(after.omega, before.omega, rtol=1e-9)
    for way in ((1.0, 0.0), (0.6, -0.8)):
        there = (c * way[0] - s * way[1], s * way[0] + c * way[1])
        np.testing.assert_allclose(
            after.effective_mass(there), before.effective_mass(way), atol=1e-9 * 3200
        )


@pytest.mark.parametrize("mass", ["none", "lumped", "consistent"])
def test_members_carry_their_mass(mass):
    """Point masses, steel and what lies on the members, in every direction."""
    more = {"mass": mass, "carried": 250.0}
    built = two_storeys(**more)
    per_length = 250.0 + STEEL.density * SLENDER.A
    at = {name: np.array([n.x, n.y]) for name, n in built.nodes.items()}
    lengths = {name: np.linalg.norm(at[m.end] - at[m.start]) for name, m in built.members.items()}
    whole = replace(built, supports={})  # of a supported frame the lowest parts do not move
    steel = per_length * sum(lengths.values()) if mass != "none" else 0.0
    names, _, M = free_matrices(whole)
    for d in "xy":
        l = np.array([float(name.endswith(f".{d}")) for name in names])
        assert l @ M @ l == pytest.approx(3200.0 + steel, rel=1e-12)


def test_names_find_their_rows():
    model = assemble(two_storeys(tied=True))
    assert model.dofs[:3] == ("c.x", "c.y", "c.rotation")
    assert "d.x" not in model.coordinates and len(model.coordinates) == 10
    np.testing.assert_array_equal(model.at("d.x"), model.at("c.x"))
    np.testing.assert_array_equal(model.at("f.y"), np.eye(10)[model.coordinates.index("f.y")])
