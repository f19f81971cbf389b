"""Time integration of the structures and the reduction of their order."""

import numpy as np
import pytest
from scipy import linalg, signal

from martths_jax import InputError, build_benchmark
from martths_jax.structure.experimental import benchmark_partition, ideal_frame
from martths_jax.structure.frame import build_reference
from martths_jax.structure.integrators import INTEGRATORS
from martths_jax.structure.modal import from_dense, respond, to_dense
from martths_jax.structure.statespace import INPUT_SCALE, discretise, first_order

DT = 1 / 1024


def numerical():
    return benchmark_partition(build_reference(), ideal_frame())


def newmark_by_the_book(structure, load, dt):
    """Average acceleration in d, v, a with the singular mass matrix (Chopra, table 5.4.2)."""
    M, C, K = structure.M, structure.C, structure.K
    effective = K + 2 / dt * C + 4 / dt**2 * M
    d = v = a = np.zeros(M.shape[0])
    history = []
    for p in load:
        rhs = p + M @ (4 / dt**2 * d + 4 / dt * v + a) + C @ (2 / dt * d + v)
        new = linalg.solve(effective, rhs, assume_a="pos")
        v_new = 2 / dt * (new - d) - v
        a = 4 / dt**2 * (new - d) - 4 / dt * v - a
        d, v = new, v_new
        history.append(d)
    return np.array(history)


def test_newmark_equals_the_textbook_recursion():
    structure, rng = numerical(), np.random.default_rng(0)
    u = rng.standard_normal((400, 4)) * INPUT_SCALE
    load = np.zeros((400, 29))
    load[:] = np.outer(u[:, 0], -structure.M @ structure.influence)
    for column, coordinate in ((1, 0), (2, 18), (3, 21)):
        load[:, coordinate] += u[:, column]
    book = newmark_by_the_book(structure, load, DT)[:, [0, 18, 1, 16, 2, 17]]
    ours = np.asarray(respond(discretise(structure, INTEGRATORS["newmark"], DT), u))
    np.testing.assert_allclose(ours, book, atol=1e-8 * np.abs(book).max(axis=0).max(), rtol=0)
    assert np.all(np.abs(ours - book).max(axis=0) < 2e-8 * np.abs(book).max(axis=0))


@pytest.mark.parametrize("name", sorted(INTEGRATORS))
def test_methods_converge_to_the_exact_response_with_their_order(name):
    """Under a smooth load: order 2 for Newmark, 1 for the held input of the other two."""
    A, B, C = first_order(build_reference())
    load = lambda t: np.sin(2 * np.pi * 3 * t) ** 3  # noqa: E731
    T, errors = 0.5, []
    fine = signal.cont2discrete((A, B, C, np.zeros((6, 4))), 1 / 65536, method="foh")
    t = np.arange(round(T * 65536) + 1) / 65536
    u = np.zeros((t.size, 4))
    u[:, 0] = load(t)
    system = from_dense(*fine[:4])
    exact = np.asarray(respond(system, u))[-1, 0]
    for fs in (1024, 2048, 4096):
        s = discretise(build_reference(), INTEGRATORS[name], 1 / fs)
        t = np.arange(round(T * fs) + 1) / fs
        u = np.zeros((t.size, 4))
        u[:, 0] = load(t)
        errors.append(abs(np.asarray(respond(s, u))[-1, 0] - exact))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    expected = 2.0 if name == "newmark" else 1.0
    np.testing.assert_allclose(orders, expected, atol=0.15)


def test_zero_order_hold_is_scipys():
    A, B, C = first_order(build_reference())
    ours = INTEGRATORS["zoh"].discretise(A, B, C, DT)
    D = np.zeros((C.shape[0], B.shape[1]))
    theirs = signal.cont2discrete((A, B, C, D), DT)[:4]
    for found, expected in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=0)


def test_rk4_and_zero_order_hold_agree():
    """With a held input the exact solution and RK4 differ by the fifth order of dt."""
    u = np.random.default_rng(1).standard_normal((600, 4)) * INPUT_SCALE
    u[:, 1:] = 0.0
    rk4, zoh = (
        np.asarray(respond(discretise(build_reference(), INTEGRATORS[n], DT), u))
        for n in ("rk4", "zoh")
    )
    scale = np.abs(zoh).max(axis=0)
    assert np.all(np.abs(rk4 - zoh).max(axis=0) < 1e-5 * scale)
    assert np.any(rk4 != zoh)


@pytest.mark.parametrize("name", sorted(INTEGRATORS))
def test_reduction_keeps_an_earthquake_response_to_1e_9(name, records):
    from martths_jax import load_motion

    ground = load_motion("elcentro", records=records).acceleration[:12000]
    structure = numerical()
    u = np.zeros((ground.size, 4))
    u[:, 0] = ground
    u[:, 1:] = np.roll(ground, 40)[:, None] * np.array([4e3, 600.0, 400.0])
    A, B, C, D = INTEGRATORS[name].discretise(*first_order(structure), DT)
    full = signal.dlsim((A, B, C, D, DT), u)[1]
    reduced = discretise(structure, INTEGRATORS[name], DT)
    assert reduced.order <= 30 < A.shape[0]
    ours = np.asarray(respond(reduced, u))
    assert np.all(np.abs(ours - full).max(axis=0) < 1e-9 * np.abs(full).max(axis=0))


def test_modal_form_of_a_mixed_system():
    """Complex pairs and an odd number of real poles, against the dense recursion."""
    A = linalg.block_diag([[0.9, 0.3], [-0.3, 0.9]], 0.5, -0.2, 0.7)
    rng = np.random.default_rng(0)
    T = rng.standard_normal((5, 5))
    A = T @ A @ np.linalg.inv(T)
    B, C, D = rng.standard_normal((5, 2)), rng.standard_normal((3, 5)), rng.standard_normal((3, 2))
    u = rng.standard_normal((50, 2))
    system = from_dense(A, B, C, D)
    np.testing.assert_allclose(respond(system, u), signal.dlsim((A, B, C, D, 1.0), u)[1], rtol=1e-9)
    again = from_dense(*to_dense(system))
    np.testing.assert_allclose(respond(again, u), respond(system, u), rtol=1e-9)


def test_repeated_poles_have_no_modal_form():
    with pytest.raises(ValueError, match="repeated poles"):
        from_dense(np.array([[0.5, 1.0], [0.0, 0.5]]), np.ones((2, 1)), np.ones((1, 2)), None)


def test_rk4_refuses_a_rate_it_cannot_integrate():
    with pytest.raises(InputError, match=r"unstable.*raise fs"):
        build_benchmark(fs=256, integrator="rk4")


@pytest.mark.parametrize("fs", [0, -1024, np.nan, np.inf, "1024"])
def test_bad_rate(fs):
    with pytest.raises(InputError, match="`fs` must be a positive sampling rate"):
        build_benchmark(fs=fs)


@pytest.mark.parametrize("name", ["integrator", "partition"])
def test_unknown_method(name):
    with pytest.raises(InputError, match=f"`{name}` must be one of .* but got 'euler'"):
        build_benchmark(**{name: "euler"})
