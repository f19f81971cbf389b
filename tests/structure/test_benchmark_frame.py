"""The benchmark's frame as data is, to the bit, the matrix that its members give one by one."""

import numpy as np
import pytest

from martths_jax.structure.assembly import assemble
from martths_jax.structure.frame import (
    assemble_stiffness,
    build_reference,
    independent_coordinate,
    modes,
    planar_frame,
)
from martths_jax.structure.members import bending_stiffness
from martths_jax.structure.sections import FrameGeometry, Section


def geometries():
    """The benchmark's and some with lengths and sections that no decimal fraction writes."""
    yield FrameGeometry()
    draws = np.random.default_rng(7)
    for _ in range(4):
        a, b, c, d, e = draws.uniform(0.6, 1.4, 5)
        beam = Section(0.0, 4e-7 * c, 5e-4 * d)
        yield FrameGeometry(storey=0.635 * a, bay=0.762 * b, E=2e11 * c, G=7.7e10 * d, beam=beam,
                            pin_offset=0.03 * e)  # fmt: skip


def by_hand(g):
    """(38, 38) stiffness, each member written to its places."""
    K = np.zeros((39, 39))  # the last row collects what is held

    def dofs(line, floor):
        if floor == 0:
            return -1, -1, {1: 36, 2: 37}.get(line, -1)
        node = 3 * line + floor - 1
        return node, 12 + node, 24 + node

    for line in range(4):
        for floor in range(3):
            inner = floor == 0 and line in (1, 2)
            section = g.interior_ground_column if inner else g.column
            k = bending_stiffness(section, g.storey, g.E, g.G)
            if (line, floor) == (2, 0):
                arm = g.pin_offset
                k = bending_stiffness(section, g.storey - arm, g.E, g.G)
                k = k[:3, :3] - np.outer(k[:3, 3], k[3, :3]) / k[3, 3]
                rigid = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -arm]])
                k = rigid.T @ k @ rigid
            (x1, y1, r1), (x2, y2, r2) = dofs(line, floor), dofs(line, floor + 1)
            left = np.array([-1.0, 1, -1, 1])  # to the left of a column is -x
            K[np.ix_([x1, r1, x2, r2], [x1, r1, x2, r2])] += left[:, None] * k * left
            axial = g.E * section.A / g.storey
            K[np.ix_([y1, y2], [y1, y2])] += axial * np.array([[1.0, -1], [-1, 1]])
    for bay in range(3):
        for floor in (1, 2, 3):
            section = g.interior_ground_beam if (bay, floor) == (1, 1) else g.beam
            (_, y1, r1), (_, y2, r2) = dofs(bay, floor), dofs(bay + 1, floor)
            at = np.ix_([y1, r1, y2, r2], [y1, r1, y2, r2])
            K[at] += bending_stiffness(section, g.bay, g.E, g.G)
    return K[:38, :38]


@pytest.mark.parametrize("g", list(geometries()))
def test_stiffness_keeps_its_bits(g):
    expected = by_hand(g)
    np.testing.assert_array_equal(assemble_stiffness(g), expected)
    T = np.zeros((38, 29))
    for dof in range(1, 39):
        T[dof - 1, independent_coordinate(dof)] = 1.0
    reference = build_reference(g)
    np.testing.assert_array_equal(reference.K, T.T @ expected @ T)
    mass = [*g.storey_mass, *np.ravel(g.vertical_mass), *[0.0] * 14]
    np.testing.assert_array_equal(reference.M, np.diag(mass))


def test_the_general_way_gives_the_benchmarks_modes():
    """Node by node, with its own condensation: the same frequencies and effective masses."""
    model = assemble(planar_frame(FrameGeometry()))
    general, expected = model.modes(), modes(build_reference())
    np.testing.assert_allclose(general.frequency, expected.frequency, rtol=1e-11)
    share = general.effective_mass("x") / model.total_mass("x")
    np.testing.assert_allclose(share, expected.effective_mass, rtol=1e-7, atol=1e-12)
    np.testing.assert_allclose(model.total_mass("x"), np.sum(FrameGeometry().storey_mass))
