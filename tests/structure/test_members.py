"""Stiffness and mass of one member against beam theory."""

from dataclasses import replace

import numpy as np
import pytest

from martths_jax.structure.assembly import assemble, free_matrices
from martths_jax.structure.members import (
    Member,
    Node,
    bending_shapes,
    bending_stiffness,
    member_matrices,
)
from martths_jax.structure.planar import FIXED
from tests.structure.frames import (
    SLENDER,
    STEEL,
    STOUT,
    WEIGHTLESS,
    beam,
    displacement,
)

EI, GA, EA = STEEL.E * STOUT.I, STEEL.G * STOUT.A_s, STEEL.E * STOUT.A
L = 1.7
ANGLES = (0.0, np.pi / 2, 0.6, -2.4)


def matrices(section=STOUT, material=STEEL, angle=0.0, **more):
    end = Node(L * np.cos(angle), L * np.sin(angle))
    return member_matrices(Member("1", "2", "", "", **more), section, material, Node(0, 0), end)


def along_and_across(model, angle, node, along, across, direction):
    """Displacement of a node along or across a turned beam under forces along and across it."""
    c, s = np.cos(angle), np.sin(angle)
    load = {f"{node}.x": c * along - s * across, f"{node}.y": s * along + c * across}
    x, y = (displacement(model, load, f"{node}.{d}") for d in "xy")
    return c * x + s * y if direction == "along" else -s * x + c * y


@pytest.mark.parametrize("angle", ANGLES)
def test_cantilever(angle):
    """P L^3 / 3 EI + P L / G A_s at its tip, P L / EA along it."""
    for pieces in (1, 3):
        model = assemble_with_mass(beam(L, pieces, {"0": FIXED}, angle=angle))
        tip, P = str(pieces), 1e4
        found = along_and_across(model, angle, tip, 0, P, "across")
        assert found == pytest.approx(P * L**3 / (3 * EI) + P * L / GA, rel=1e-9)
        found = along_and_across(model, angle, tip, P, 0, "along")
        assert found == pytest.approx(P * L / EA, rel=1e-9)
        turned = displacement(model, {f"{tip}.rotation": P}, f"{tip}.rotation")
        assert turned == pytest.approx(P * L / EI, rel=1e-9)


def assemble_with_mass(frame):
    return assemble(replace(frame, masses={"1": 1.0}))


@pytest.mark.parametrize("angle", ANGLES)
def test_beam_fixed_at_both_ends(angle):
    """P L^3 / 192 EI + P L / 4 G A_s in its middle."""
    model = assemble_with_mass(beam(L, 4, {"0": FIXED, "4": FIXED}, angle=angle))
    found = along_and_across(model, angle, "2", 0, 1.0, "across")
    assert found == pytest.approx(L**3 / (192 * EI) + L / (4 * GA), rel=1e-9)


@pytest.mark.parametrize("angle", ANGLES)
def test_rigid_ends(angle):
    """Only the part between them bends: tip P ((b + l)^3 - b^3) / 3 EI + P l / G A_s."""
    a, b = 0.2, 0.35
    l = L - a - b
    frame = beam(L, 1, {"0": FIXED}, angle=angle, rigid_start=a, rigid_end=b)
    found = along_and_across(assemble_with_mass(frame), angle, "1", 0, 1.0, "across")
    assert found == pytest.approx(((b + l) ** 3 - b**3) / (3 * EI) + l / GA, rel=1e-9)
    for rigid, stretched in ((False, L), (True, l)):
        more = {"rigid_start": a, "rigid_end": b, "rigid_axially": rigid}
        model = assemble_with_mass(beam(L, 1, {"0": FIXED}, angle=angle, **more))
        found = along_and_across(model, angle, "1", 1.0, 0, "along")
        assert found == pytest.approx(stretched / EA, rel=1e-9)


def test_released_ends():
    """One end free of moment: 3 EI / L^3 (1 + phi / 4) at the other; both: a bar."""
    phi = 12 * EI / (GA * L**2)
    for end, (v, r) in {"end": (1, 2), "start": (4, 5)}.items():
        K, _ = matrices(release=(end,))
        assert K[v, v] == pytest.approx(3 * EI / (L**3 * (1 + phi / 4)), rel=1e-12)
        assert K[r, r] == pytest.approx(3 * EI / (L * (1 + phi / 4)), rel=1e-12)
        assert not K[{"end": 5, "start": 2}[end]].any()
    K, _ = matrices(release=("start", "end"), angle=0.6)
    n = np.array([-np.cos(0.6), -np.sin(0.6), 0, np.cos(0.6), np.sin(0.6), 0])
    np.testing.assert_allclose(K, EA / L * np.outer(n, n), atol=1e-12 * EA / L)


@pytest.mark.parametrize("more", [{}, {"rigid_end": 0.3}, {"release": ("start",)}])
@pytest.mark.parametrize("angle", ANGLES)
def test_moving_as_a_whole_meets_no_force_and_all_mass(angle, more):
    m = STEEL.density * STOUT.A + 40.0
    for mass in ("lumped", "consistent"):
        K, M = matrices(angle=angle, carried=40.0, mass=mass, **more)
        x, y = np.array([1, 0, 0, 1, 0, 0.0]), np.array([0, 1, 0, 0, 1, 0.0])
        turn = np.array([0, 0, 1, -L * np.sin(angle), L * np.cos(angle), 1])
        for motion in (x, y, turn):
            np.testing.assert_allclose(K @ motion, 0, atol=1e-12 * np.abs(K).max())
        for motion in (x, y):
            assert motion @ M @ motion == pytest.approx(m * L, rel=1e-12)
        assert abs(x @ M @ y) < 1e-12 * m * L
        share = 3 if mass == "consistent" else 2  # a rod about its end, or half of it at the other
        assert turn @ M @ turn == pytest.approx(m * L**3 / share, rel=1e-12)
        assert np.linalg.eigvalsh(M)[0] > -1e-12 * m * L


def test_consistent_mass_is_the_textbooks():
    """Chopra, eq. 17.9.1 (Euler-Bernoulli): m L / 420 [156, 22 L, 54, -13 L, ...]."""
    _, M = matrices(SLENDER, mass="consistent")
    bending = [1, 2, 4, 5]
    expected = np.array(
        [
            [156, 22 * L, 54, -13 * L],
            [22 * L, 4 * L**2, 13 * L, -3 * L**2],
            [54, 13 * L, 156, -22 * L],
            [-13 * L, -3 * L**2, -22 * L, 4 * L**2],
        ]
    )
    m = STEEL.density * SLENDER.A
    np.testing.assert_allclose(M[np.ix_(bending, bending)], m * L / 420 * expected, rtol=1e-12)
    along = m * L / 6 * np.array([[2, 1], [1, 2]])
    np.testing.assert_allclose(M[np.ix_([0, 3], [0, 3])], along, rtol=1e-12)


def test_stiffness_is_the_energy_of_the_shape_functions():
    """Integral of EI r'^2 + G A_s (v' - r)^2, the derivatives taken by differences."""
    points, weights = np.polynomial.legendre.leggauss(4)
    h, K = 1e-3, np.zeros((6, 6))
    for z, w in zip((1 + points) / 2, weights * L / 2, strict=True):
        # Central differences of a cubic: exact but for h^2 v''' / 6, taken off by Richardson.
        def slope(step, z=z):
            after, before = (bending_shapes(STOUT, STEEL, L, z + d) for d in (step, -step))
            return (after - before) / (2 * step * L)

        dv, dr = (4 * slope(h) - slope(2 * h)) / 3
        shear = dv - bending_shapes(STOUT, STEEL, L, z)[1]
        K += w * (EI * np.outer(dr, dr) + GA * np.outer(shear, shear))
    at = [1, 2, 4, 5]
    expected = bending_stiffness(STOUT, L, STEEL.E, STEEL.G)
    np.testing.assert_allclose(K[np.ix_(at, at)], expected, rtol=1e-8)


def test_a_support_takes_its_rows_out():
    names, K, _ = free_matrices(beam(L, 1, {"0": FIXED}))
    assert names == ("1.x", "1.y", "1.rotation")
    np.testing.assert_array_equal(K, matrices(material=WEIGHTLESS)[0][3:, 3:])


def test_rigid_ends_move_as_the_nodes_or_stretch():
    """Mass along the member: m L / 3 at a node, or m (a + l / 3) beside a rigid end of a."""
    a, b = 0.2, 0.35
    m, more = STEEL.density * STOUT.A, {"rigid_start": a, "rigid_end": b, "mass": "consistent"}
    _, M = matrices(**more)
    np.testing.assert_allclose(M[[0, 0, 3], [0, 3, 3]], m * L / np.array([3, 6, 3]), rtol=1e-12)
    _, M = matrices(**more, rigid_axially=True)
    l = L - a - b
    expected = m * np.array([a + l / 3, l / 6, b + l / 3])
    np.testing.assert_allclose(M[[0, 0, 3], [0, 3, 3]], expected, rtol=1e-12)
