"""Reference structure, partition and restoring force against the published numbers."""

import numpy as np
import pytest
from scipy import linalg

from martths_jax import Quirks, published
from martths_jax.structure.damping import rayleigh_coefficients
from martths_jax.structure.experimental import (
    condensation,
    ideal_frame,
    measured_frame,
    restoring_maps,
)
from martths_jax.structure.frame import (
    N_FREE,
    assemble_stiffness,
    build_reference,
    diaphragm_map,
    modes,
)
from martths_jax.structure.sections import FrameGeometry

# Equation numbers of the other program, by floor and column line (see design notes): its x axis
# points the other way than ours once its rotations are read counter-clockwise.
STOREYS = [27, 26, 13]
VERTICAL = [[16, 20, 28, 1], [23, 25, 6, 12], [4, 9, 15, 8]]
ROTATION = [[17, 21, 29, 2], [22, 24, 5, 11], [3, 10, 14, 7]]
BASES = [18, 19]


def in_our_order(matrix):
    lines = [(line, floor) for line in range(4) for floor in range(3)]
    order = (
        STOREYS
        + [VERTICAL[floor][line] for line, floor in lines]
        + [ROTATION[floor][line] for line, floor in lines]
        + BASES
    )
    order = np.array(order) - 1
    sign = np.where(np.arange(N_FREE) < 3, -1.0, 1.0)
    return matrix[np.ix_(order, order)] * np.outer(sign, sign)


def test_modes_print_like_table_1():
    found = modes(build_reference())
    for mode, (frequency, mass) in published.TABLE1.items():
        assert round(found.frequency[mode - 1], 4) == frequency
        ours = 100 * found.effective_mass[mode - 1]
        digits = 7 if mass < 1e-3 else 3 if mass < 1 else 2
        assert round(ours, digits) == mass


def test_stiffness_and_mass_meet_the_other_program(records):
    reference = build_reference()
    for name, ours in (("K", reference.K), ("M", reference.M)):
        theirs = in_our_order(np.loadtxt(records / f"{name}_reference_sap29.csv", delimiter=","))
        scale = np.sqrt(np.outer(np.diag(theirs), np.diag(theirs))) + (name == "M")
        assert np.abs((ours - theirs) / scale).max() < 1e-5
        entries = np.abs(theirs) > 1e-6 * scale.max()
        np.testing.assert_allclose(ours[entries], theirs[entries], rtol=1e-5)


def test_supported_frame_has_no_mechanism():
    """Its diaphragms hold the column line with two pins in the ground floor; nothing else does."""
    K = assemble_stiffness(FrameGeometry())
    np.testing.assert_allclose(K, K.T, atol=1e-6 * np.abs(K).max())
    found = linalg.eigvalsh(K)
    assert abs(found[0]) < 1e-12 * found[-1] and found[1] > 1e-6 * found[-1]
    T = diaphragm_map()
    assert linalg.eigvalsh(T.T @ K @ T)[0] > 1e-4 * found[-1]


def test_released_column_carries_no_moment_at_its_pin():
    """Turning node 7 about the pin (rigidly, with the arm above it) meets only the beams."""
    g = FrameGeometry()
    K = assemble_stiffness(g)
    turn = np.zeros(38)
    turn[7 - 1], turn[24 + 7 - 1] = -g.pin_offset, 1.0  # the pin itself stays where it is
    base = 38 - 1
    assert abs((K @ turn)[base]) < 1e-6 * abs(K[base, base])
    assert abs(K[37 - 1, 24 + 4 - 1]) > 0.1 * K[37 - 1, 37 - 1], "the one under node 4 does"


def test_rayleigh_damping_has_the_ratio_at_its_anchors():
    a_0, a_1 = rayleigh_coefficients(13.493, 165.125, 0.05)
    assert a_0 == pytest.approx(1.2473724, rel=1e-7)
    assert a_1 == pytest.approx(5.5985399e-4, rel=1e-7)
    for omega in (13.493, 165.125):
        assert a_0 / (2 * omega) + a_1 * omega / 2 == pytest.approx(0.05)


def test_removed_frame():
    frame = ideal_frame()
    np.testing.assert_allclose(np.diag(frame.M), [902.527382, 17.8650616, 17.8650616], rtol=1e-8)
    b_1 = frame.C[0, 1] / frame.K[0, 1]
    b_0 = (frame.C[0, 0] - b_1 * frame.K[0, 0]) / frame.M[0, 0]
    assert (b_0, b_1) == (pytest.approx(2.25591114, rel=1e-7), pytest.approx(3.29183259e-4))
    assert frame.K[1, 2] < 0, "the benchmark's sign"
    assert ideal_frame(Quirks(removed_rotation_coupling=1.0)).K[1, 2] == -frame.K[1, 2]
    steel = ideal_frame(Quirks(removed_density=7850.0))
    np.testing.assert_allclose(steel.M * 100, frame.M)


def test_measured_frame():
    frame = measured_frame()
    expected = [13359474.87, 2142024.80, 1358243.71, 221192.65]
    found = [frame.K[0, 0], frame.K[0, 1], frame.K[1, 1], frame.K[1, 2]]
    np.testing.assert_allclose(found, expected, atol=5e-3)
    np.testing.assert_allclose(
        np.diag(frame.M), [8.453989, 0.890444, 0.890444, 0.409054, 0.409054], rtol=1e-6
    )
    omega = np.sqrt(linalg.eigvalsh(frame.K, frame.M))
    np.testing.assert_allclose(
        omega / (2 * np.pi), [56.85, 147.56, 175.50, 259.40, 328.09], atol=5e-3
    )
    # Five percent in every mode, of the frequencies rounded to 0.01 rad/s.
    _, phi = linalg.eigh(frame.K, frame.M)
    np.testing.assert_allclose(
        phi.T @ frame.C @ phi, np.diag(0.1 * np.round(omega, 2)), atol=1e-9 * omega.max()
    )
    np.testing.assert_allclose(condensation(frame)[2], [-0.94840363, -0.19587067], rtol=1e-7)


def test_restoring_force_is_the_finite_difference_formula():
    """The three taps give K p + C dp + M ddp with backward differences of the condensed p."""
    frame, dt = measured_frame(), 1 / 1024
    q = np.random.default_rng(0).standard_normal((3, 2)) * 1e-3  # q(k), q(k-1), q(k-2)
    p = q @ condensation(frame).T
    v, v_before = (p[0] - p[1]) / dt, (p[1] - p[2]) / dt
    force = frame.K @ p[0] + frame.C @ v + frame.M @ ((v - v_before) / dt)
    taps = restoring_maps(frame, dt)
    np.testing.assert_allclose(np.einsum("tij,tj->i", taps, q), force[:3], rtol=1e-9)
