"""Modes, effective masses and condensation of frames, and a beam whose modes are known."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy import linalg

from martths_jax.structure.assembly import assemble
from martths_jax.structure.constraints import Relation, rigid_link
from martths_jax.structure.members import Material
from martths_jax.structure.modes import condense, effective_masses, natural_modes
from martths_jax.structure.planar import FIXED
from tests.structure.frames import SLENDER, STEEL, STOUT, beam, two_storeys

WAYS = ("x", "y", (1.0, 1.0), (-0.28, 0.96))


@pytest.mark.parametrize("tied", [False, True])
@pytest.mark.parametrize("mass", ["none", "lumped", "consistent"])
def test_effective_masses_sum_to_the_total(mass, tied):
    model = assemble(two_storeys(mass=mass, tied=tied))
    modes = model.modes()
    for way in WAYS:
        shares = modes.effective_mass(way)
        assert np.all(shares >= 0)
        assert np.sum(shares) == pytest.approx(model.total_mass(way), rel=1e-9)
        if mass == "none":
            assert model.total_mass(way) == pytest.approx(3200.0, rel=1e-12)


def test_a_lever_takes_part_of_the_mass_with_the_ground():
    """Its constraint forbids moving as a whole: (T'Ml)' (T'MT)^-1 T'Ml is what can be excited."""
    built = replace(two_storeys(mass="none"), constraints=(Relation("e.x", {"c.x": 0.5}),))
    model = assemble(built)
    total = np.sum(model.modes().effective_mass("x"))
    c, e = 900.0, 700.0  # both on c.x, by 1 and by 1/2
    assert total == pytest.approx(1100 + 500 + (c + 0.5 * e) ** 2 / (c + 0.25 * e), rel=1e-9)
    assert total < model.total_mass("x") == pytest.approx(3200.0)


@pytest.mark.parametrize("tied", [False, True])
def test_condensation_keeps_the_frequencies(tied):
    """Against the eigenvalues of K^-1 M, massless coordinates and all."""
    model = assemble(two_storeys(mass="lumped", tied=tied))
    every = np.sort(linalg.eigvals(np.linalg.solve(model.K, model.M)).real)[::-1]
    names, M, K, R = model.condensed()
    assert len(names) < len(model.coordinates)
    expected = 1 / np.sqrt(every[: len(names)])
    np.testing.assert_allclose(np.sqrt(linalg.eigvalsh(K, M)), expected, rtol=1e-9)
    omega, phi = natural_modes(model.M, model.K)
    np.testing.assert_allclose(omega, expected, rtol=1e-9)
    # And the recovered shapes solve the whole problem.
    residual = model.K @ phi - model.M @ phi * omega**2
    assert np.abs(residual).max() < 1e-9 * np.abs(model.K @ phi).max()
    np.testing.assert_allclose(R.T @ model.K @ R, K, atol=1e-9 * np.abs(K).max())
    np.testing.assert_allclose(phi.T @ model.M @ phi, np.eye(omega.size), atol=1e-12)


def test_condensing_nothing_or_in_another_order():
    K = assemble(two_storeys()).K
    same, R = condense(K, range(K.shape[0]))
    np.testing.assert_array_equal(same, K)
    np.testing.assert_array_equal(R, np.eye(K.shape[0]))
    one, first = condense(K, [0, 4])
    other, second = condense(K, [4, 0])
    np.testing.assert_allclose(one, other[::-1, ::-1], rtol=1e-12)
    np.testing.assert_allclose(first, second[:, ::-1], atol=1e-12)


def test_mass_on_an_arm_gives_as_many_modes_as_it_can_move():
    """A point mass on a rigid arm makes M singular without a zero row; the arm's limit is exact."""
    built = beam(2.0, 1, {"0": FIXED}, section="slender")
    nodes = built.nodes | {"arm": replace(built.nodes["1"], y=0.3)}
    link = rigid_link(nodes, "1", "arm")
    built = replace(built, nodes=nodes, masses={"arm": 50.0}, constraints=link)
    model = assemble(built)
    omega, phi = natural_modes(model.M, model.K)
    assert omega.size == 2
    slightly = model.M + np.diag([0, 0, 1e-9])
    np.testing.assert_allclose(omega, np.sqrt(linalg.eigvalsh(model.K, slightly))[:2], rtol=1e-9)
    np.testing.assert_allclose(phi.T @ model.M @ phi, np.eye(2), atol=1e-12)
    total = effective_masses(model.M, phi, model.influence("y")).sum()
    assert total == pytest.approx(50.0, rel=1e-9)


def frequencies(pieces, supports, **member):
    model = assemble(beam(2.0, pieces, supports, mass="consistent", **member))
    return model.modes().omega


def limit(coarse, fine, order):
    """Richardson's limit of two refinements by two."""
    return (2**order * fine - coarse) / (2**order - 1)


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_cantilever_vibrates_as_euler_and_bernoulli_say(angle):
    """omega = beta^2 sqrt(EI / m L^4), beta = 1.8751, 4.6941; the error falls as h^4."""
    member = {"section": "slender", "material": "steel", "angle": angle}
    beta = np.array([1.8751040687119611, 4.694091132974175])
    m = STEEL.density * SLENDER.A
    exact = beta**2 * np.sqrt(STEEL.E * SLENDER.I / (m * 2.0**4))
    found = [frequencies(n, {"0": FIXED}, **member)[:2] for n in (6, 12, 24)]
    error = [f / exact - 1 for f in found]
    assert np.all(error[2] > 0)
    for coarse, fine in pairwise(error):
        np.testing.assert_allclose(np.log2(coarse / fine), 4, atol=0.1)
    once = limit(found[0], found[1], 4), limit(found[1], found[2], 4)
    np.testing.assert_allclose(limit(*once, 6)[0], exact[0], rtol=1e-9)
    np.testing.assert_allclose(limit(*once, 6), exact, rtol=1e-7)


def test_simply_supported_beam_vibrates_as_timoshenko_says():
    """rho I m w^4 - (m G A_s + (rho I G A_s + EI m) k^2) w^2 + EI G A_s k^4 = 0, k = n pi / L."""
    rho, E = STEEL.density, STEEL.E
    m, J, EI, GA = rho * STOUT.A, rho * STOUT.I, E * STOUT.I, STEEL.G * STOUT.A_s
    k = np.pi * np.arange(1, 3) / 2.0
    b = m * GA + (J * GA + EI * m) * k**2
    exact = np.sqrt((b - np.sqrt(b**2 - 4 * J * m * EI * GA * k**4)) / (2 * J * m))
    supports = {"0": ("x", "y"), "{n}": ("y",)}
    found = []
    for n in (8, 16, 32):
        at = {node.format(n=n): held for node, held in supports.items()}
        omega = frequencies(n, at, material="steel", rotatory=True)
        found.append(np.array([omega[np.argmin(np.abs(omega - e))] for e in exact]))
    error = [np.abs(f / exact - 1) for f in found]
    assert np.all(error[2] < 1e-3)
    rate = np.log2(error[1] / error[2])
    order = int(np.rint(rate[0]))
    assert order >= 2 and np.all(np.abs(rate - order) < 0.05)
    np.testing.assert_allclose(limit(found[1], found[2], order), exact, rtol=1e-5)


def test_a_density_of_zero_leaves_what_is_carried():
    light = beam(2.0, 8, {"0": FIXED}, section="slender", mass="consistent", carried=31.4)
    heavy = replace(light, materials=light.materials | {"weightless": Material(210e9, 81e9)})
    np.testing.assert_array_equal(assemble(light).M, assemble(heavy).M)
    m = STEEL.density * SLENDER.A
    same = beam(2.0, 8, {"0": FIXED}, section="slender", mass="consistent", material="steel")
    np.testing.assert_allclose(assemble(light).M * m / 31.4, assemble(same).M, rtol=1e-12)
