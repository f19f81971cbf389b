"""Damping matrices give the ratios they were asked for."""

import numpy as np
import pytest

from martths_jax.errors import InputError
from martths_jax.structure.assembly import assemble
from martths_jax.structure.damping import (
    caughey_coefficients,
    caughey_damping,
    modal_damping,
    rayleigh_coefficients,
    rayleigh_damping,
)
from tests.structure.frames import two_storeys


@pytest.fixture(scope="module")
def model():
    return assemble(two_storeys(mass="consistent", tied=True))


def ratios_of(C, modes):
    """Modal damping ratios, and the largest coupling relative to them."""
    modal = modes.phi.T @ C @ modes.phi / (2 * modes.omega)
    apart = np.abs(modal - np.diag(np.diag(modal))).max()
    return np.diag(modal), apart


@pytest.mark.parametrize("wanted", [(0.02, 0.02), (0.03, 0.05), (0.05, 0.03)])
def test_rayleigh_in_two_modes(model, wanted):
    modes = model.modes()
    ratio = wanted[0] if wanted[0] == wanted[1] else wanted
    found, apart = ratios_of(rayleigh_damping(model.M, model.K, modes.omega, (1, 3), ratio), modes)
    np.testing.assert_allclose(found[[0, 2]], wanted, rtol=1e-9)
    assert apart < 1e-9


def test_a_pair_of_equal_ratios_is_one_ratio():
    one, pair = (rayleigh_coefficients(13.0, 165.0, r) for r in (0.05, (0.05, 0.05)))
    np.testing.assert_allclose(one, pair, rtol=1e-13)


def test_rayleigh_refuses_what_gains_energy(model):
    with pytest.raises(InputError, match="mass coefficient would be negative"):
        rayleigh_coefficients(10.0, 20.0, (0.01, 0.05))
    with pytest.raises(InputError, match="stiffness coefficient would be negative"):
        rayleigh_coefficients(10.0, 20.0, (0.05, 0.01))
    with pytest.raises(InputError, match="`modes` must be a whole number from 1 to 10"):
        rayleigh_damping(model.M, model.K, model.modes().omega, (1, 11), 0.05)


def test_modal_damping_mode_by_mode(model):
    modes = model.modes()
    wanted = 0.01 * np.arange(1, modes.omega.size + 1)
    found, apart = ratios_of(modal_damping(model.M, modes.omega, modes.phi, wanted), modes)
    np.testing.assert_allclose(found, wanted, rtol=1e-9)
    assert apart < 1e-9
    some = modal_damping(model.M, modes.omega[:3], modes.phi[:, :3], 0.05)
    np.testing.assert_allclose(ratios_of(some, modes)[0], [0.05] * 3 + [0] * 7, atol=1e-9)
    with pytest.raises(InputError, match="one or 10 numbers of at least zero"):
        modal_damping(model.M, modes.omega, modes.phi, (0.05, 0.05))


@pytest.mark.parametrize("powers", [None, (-1, 0, 1), (0, 1, 2), (-2, 0, 1, 2)])
def test_caughey_has_its_ratios_at_its_modes(model, powers):
    modes = model.modes()
    at = np.array([0, 1, 3, 5])[: 3 if powers is None else len(powers)]
    wanted = np.array([0.05, 0.03, 0.04, 0.02])[: at.size]
    a = caughey_coefficients(modes.omega[at], wanted, powers)
    found, apart = ratios_of(caughey_damping(model.M, model.K, a, powers), modes)
    np.testing.assert_allclose(found[at], wanted, rtol=1e-9)
    exponents = np.arange(at.size) if powers is None else np.array(powers)
    terms = a * modes.omega[:, None] ** (2.0 * exponents - 1)
    assert np.all(np.abs(found - terms.sum(axis=1) / 2) < 1e-9 * np.abs(terms).max())
    assert apart < 1e-9 * np.abs(terms).max()


def test_caughey_of_two_terms_is_rayleigh(model):
    omega = model.modes().omega[:2]
    a = caughey_coefficients(omega, 0.05)
    np.testing.assert_allclose(a, rayleigh_coefficients(*omega, 0.05), rtol=1e-12)
    C = caughey_damping(model.M, model.K, a)
    np.testing.assert_allclose(C, a[0] * model.M + a[1] * model.K, rtol=1e-12)


def test_caughey_says_what_it_cannot():
    light = assemble(two_storeys(mass="none"))
    with pytest.raises(InputError, match="condense those without mass first"):
        caughey_damping(light.M, light.K, (1.0, 1.0, 1.0))
    assert caughey_damping(light.M, light.K, (1.0, 1.0), (-1, 1)).shape == light.M.shape
    with pytest.raises(InputError, match="`omega` must be different numbers"):
        caughey_coefficients((3.0, 3.0), 0.05)
    with pytest.raises(InputError, match="`ratios` must be one or 2"):
        caughey_coefficients((3.0, 4.0), (0.05, 0.05, 0.05))
    with pytest.raises(InputError, match="`powers` must be 2 different whole numbers"):
        caughey_coefficients((3.0, 4.0), 0.05, (0, 0))
