"""Fast forms of an algorithm against the plain ones they stand for."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax import (
    ADFC,
    Passthrough,
    blocks,
    build_coupler,
    draw_plants,
    indices,
    loop,
    simulate,
)
from martths_jax.algebra import least_squares as ls
from martths_jax.control.adaptive.differences import BACKWARD_DIFFERENCES, TAPS, BackwardDifferences
from martths_jax.control.adaptive.window import Window
from martths_jax.coupler import actuator_to_frame, frame_to_actuator
from martths_jax.indices import NAMES, Peak, Rms, correlate, delay
from tests.engine.motions import burst

#: Buffer and motion of other tests of this folder too, so that all use one compiled program.
NB = 128
MOTION = burst()


@pytest.fixture(scope="module")
def batch(benchmark):
    """A hundred trials, more than a block on one device."""
    return indices(simulate(benchmark, ADFC(nb=NB, no=NB - 1), draw_plants(100, 4), MOTION))


def packed(G, h):
    """(T, n, n) and (T, n, r) as packed rows."""
    n = G.shape[1]
    return tuple(
        (*(jnp.asarray(G[:, j, i]) for i in range(j, n)), *jnp.asarray(h[:, j].T)) for j in range(n)
    )


def test_ldl_and_lu_solve_the_same_systems():
    """Random normal matrices whose scaled condition numbers go up to about 1e6."""
    rng = np.random.default_rng(1)
    A = rng.standard_normal((200, 30, 8))
    A[:, :, 1] = A[:, :, 0] + np.geomspace(1, 1e-3, 200)[:, None] * A[:, :, 1]
    A *= np.geomspace(1, 1e-4, 8)
    G, h = np.swapaxes(A, 1, 2) @ A, rng.standard_normal((200, 8, 2))
    expected = np.linalg.solve(G, h)
    for solver in ("ldl", "lu"):
        found, tolerance = jax.jit(ls.SOLVERS[solver])(packed(G, h))
        found = np.moveaxis(np.array(found), -1, 0)
        error = np.abs(found - expected).max(1) / np.abs(expected).max(1)
        assert np.median(error) < 1e-12 and error.max() < 1e-8
        pivots = np.diagonal(np.linalg.cholesky(G), axis1=1, axis2=2) ** 2
        shares = pivots / np.diagonal(G, axis1=1, axis2=2)
        np.testing.assert_allclose(tolerance, shares.min(1), rtol=1e-6)


def test_both_solvers_say_when_a_matrix_is_singular_or_indefinite():
    """Round-off can make a normal matrix indefinite, which a large pivot alone would not show."""
    G, h = np.eye(8)[None].repeat(3, 0), np.ones((3, 8, 2))
    G[1, 3] = G[1, :, 3] = 0.0
    G[2, 3, 4] = G[2, 4, 3] = 2.0
    for solver in ls.SOLVERS.values():
        tolerance = np.asarray(jax.jit(solver)(packed(G, h))[1])
        assert tolerance[0] == 1.0 and not np.any(tolerance[1:] > 0)


def test_a_run_with_ldl_meets_one_with_lu(benchmark, batch):
    reference = indices(
        simulate(benchmark, ADFC(nb=NB, no=NB - 1, solver="lu"), draw_plants(4, 4), MOTION)
    )
    followed = indices(simulate(benchmark, ADFC(nb=NB, no=0), draw_plants(4, 4), MOTION))
    for name in NAMES:
        np.testing.assert_allclose(batch[name][:4], reference[name], rtol=1e-7)
    # The fits matter: with one in N_b samples the run is another.
    assert np.all(np.abs(followed["J2_1"] / reference["J2_1"] - 1) > 1e-4)


@pytest.fixture(scope="module")
def dying_rows():
    """40 000 observations (rows, regressors and values, trials) whose size falls by 1e4."""
    rng = np.random.default_rng(2)
    size = np.geomspace(1, 1e-4, 40_000)[:, None, None]
    return size * rng.standard_normal((40_000, 10, 3))


def slide(rows, nb, turn):
    """Normal equations after all rows by adding the newest and taking the oldest away."""

    def one(sums, pair):
        whole, new = sums
        entering, leaving = pair
        added, taken = ((row[:8], row[8:]) for row in (entering, leaving))
        whole = ls.exchange_observation(whole, *added, *taken)
        return (whole, ls.add_observation(new, *added)), None

    window = jax.jit(lambda sums, pairs: jax.lax.scan(one, sums, pairs)[0])
    sums = (ls.zeros(8, 2, 3),) * 2
    leaving = np.concatenate([np.zeros((nb, *rows.shape[1:])), rows[:-nb]])
    for first in range(0, len(rows), nb):
        sums = window(sums, (rows[first : first + nb], leaving[first : first + nb]))
        if first + nb <= len(rows):
            state = turn({"rows": sums[0], "new": sums[1]})
            sums = (state["rows"], state["new"])
    return ls.full_matrices(sums[0])


def relative_error(found, rows, nb):
    """Largest error of a normal matrix on the scale of its diagonal, against the last rows."""
    last = rows[-nb:]
    G = np.einsum("kit,kjt->ijt", last[:, :8], last[:, :8])
    h = np.einsum("kit,kst->ist", last[:, :8], last[:, 8:])
    scale = np.sqrt(np.einsum("iit->it", G))
    values = np.sqrt(np.sum(last[:, 8:] ** 2, axis=0))
    error = np.abs(found[0] - G) / (scale[:, None] * scale)
    error_h = np.abs(found[1] - h) / (scale[:, None] * values)
    return max(error.max(), error_h.max())


def test_refreshed_sliding_sums_do_not_drift(dying_rows):
    """The end lies inside a window, so that rows of the last and of this one are in the sum."""
    nb = 1024
    assert len(dying_rows) % nb
    refreshed = slide(dying_rows, nb, Window(nb).renew)
    assert relative_error(refreshed, dying_rows, nb) < 1e-12


def test_sliding_sums_that_are_never_refreshed_do_drift(dying_rows):
    """What the refreshed accumulator is there for."""
    plain = slide(dying_rows, 1024, lambda state: state)
    assert relative_error(plain, dying_rows, 1024) > 1e-10


def test_difference_recurrences_give_the_backward_differences():
    rng = np.random.default_rng(3)
    samples = np.concatenate([np.zeros((TAPS - 1, 2, 3)), rng.standard_normal((30, 2, 3))])
    regressor = BackwardDifferences()
    kept = regressor.init(3)
    for k in range(TAPS - 1, len(samples)):
        kept, phi = regressor.step(kept, jnp.asarray(samples[k]))
        taps = samples[k - TAPS + 1 : k + 1][::-1]
        expected = np.einsum("dn,nat->adt", BACKWARD_DIFFERENCES, taps)
        np.testing.assert_allclose(np.array(phi), expected, rtol=0, atol=1e-13)


def test_pieces_divide_a_window():
    for window, piece in ((1024, 256), (1000, 250), (4096, 256), (200, 200), (9, 9), (641, 641)):
        assert loop.piece_length(window) == piece
    assert loop.piece_length(2 * 641) == 2 * 641  # pieces of two samples would cost more


@pytest.mark.slow
def test_pieces_of_a_window_change_only_round_off(benchmark, monkeypatch):
    """Three pieces a window, and whole windows, with delays found across their ends."""
    plants, controller = draw_plants(3, 4), ADFC(nb=192, no=191)

    def outcome(piece):
        monkeypatch.setattr(loop, "PIECE", piece)
        blocks.compiled.cache_clear()
        sums = simulate(benchmark, controller, plants, MOTION).sums
        sums = [sums.of(kind) for kind in (delay.Delay, Rms, Peak)]
        names = ("correlation", "error_square", "error_peak")
        return [np.asarray(x[name]) for x, name in zip(sums, names, strict=True)]

    whole, pieces = outcome(192), outcome(64)
    blocks.compiled.cache_clear()
    for a, b in zip(whole, pieces, strict=True):
        np.testing.assert_allclose(b, a, rtol=1e-11)


@pytest.mark.parametrize("n", [16, 100, 7])
def test_blocked_correlation_is_numpys(n):
    rng = np.random.default_rng(n)
    lead, lag = 6, 13
    y, x = rng.standard_normal((n, 2)), rng.standard_normal((n + lead + lag, 2))
    found = jax.jit(lambda y, x: correlate(y, x, (lead, lag)))(y, x)
    expected = [np.correlate(x[:, i], y[:, i], "valid")[::-1] for i in range(2)]
    np.testing.assert_allclose(found, np.stack(expected, axis=1), rtol=0, atol=1e-13 * n)


def test_coupler_is_exact_trigonometry():
    coupler = build_coupler()
    p, alpha = float(coupler.arm), float(coupler.alpha)
    small = np.geomspace(1e-12, 1e-3, 40)
    theta = np.concatenate([-small, [0.0], small, np.linspace(-1, 1, 401)])
    x = np.linspace(-0.05, 0.05, theta.size)
    strokes = np.asarray(frame_to_actuator(coupler, jnp.asarray([x, theta]))) / 1e3
    for stroke, angle in zip(strokes, (-alpha, alpha), strict=True):
        # cos(a + t) - cos(a) without its cancellation
        turned = -2 * np.sin(angle + theta / 2) * np.sin(theta / 2)
        np.testing.assert_allclose(stroke, x + p * turned, rtol=0, atol=2e-16)
    back = np.asarray(actuator_to_frame(coupler, jnp.asarray(strokes * 1e3)))
    exact = np.arcsin((strokes[0] - strokes[1]) / (2 * p * np.sin(alpha)))
    np.testing.assert_allclose(back[1], exact, rtol=2e-15, atol=1e-16)
    np.testing.assert_allclose(back, [x, theta], rtol=0, atol=4e-15)


@pytest.mark.parametrize("position", [5, 70])
def test_a_trial_has_the_same_bits_in_any_batch(benchmark, batch, position):
    """Alone, and as one of a hundred in its first or second block."""
    plants, controller = draw_plants(100, 4), ADFC(nb=NB, no=NB - 1)
    alone = indices(simulate(benchmark, controller, plants[position], MOTION))
    for name in NAMES:
        assert alone[name][0] == batch[name][position], name


def test_a_widened_lag_range_leaves_the_bits(benchmark, monkeypatch):
    """The same trials with a first range that holds their delays, and with one that does not."""
    plants, first = draw_plants(3, 4), Passthrough().first_lag_range
    usual = simulate(benchmark, Passthrough(), plants, MOTION)
    assert usual.sums.observers[0].lags == delay.RANGES[first] == (32, 96)
    narrow = ((2, 2),) * (first + 1)
    monkeypatch.setattr(delay, "RANGES", (*narrow, (40, 100)))
    widened = simulate(benchmark, Passthrough(), plants, MOTION)
    assert widened.sums.observers[0].lags == (40, 100)
    found, expected = indices(widened), indices(usual)
    for name in NAMES:
        np.testing.assert_array_equal(found[name], expected[name], err_msg=name)
    wide, narrow = (x.sums.of(delay.Delay)["correlation"] for x in (widened, usual))
    np.testing.assert_allclose(wide[:, 8:-4], narrow, rtol=0, atol=1e-9)
