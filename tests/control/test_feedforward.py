"""The adaptive feedforward out of pieces as a controller, and pieces that a user adds."""

from dataclasses import dataclass

import jax
import numpy as np
import pytest

from martths_jax import ADFC, InputError, SensorNoise, draw_plants, nominal_plant, simulate
from martths_jax.control.adaptive import (
    BackwardDifferences,
    Bounds,
    ConditionGate,
    ExcitationGate,
    Fading,
    Fit,
    Fitted,
    Guard,
    MotionThreshold,
    NormalisedGradient,
    Pull,
    RandomWalk,
    RateLimit,
    Recursive,
    Window,
    fir,
)
from martths_jax.control.controllers import AdaptiveFeedforward, FrozenFeedforward
from tests.engine.motions import burst

VELOCITY = BackwardDifferences(order=1, accuracy=2)
RNG = np.random.default_rng(13)


@pytest.fixture
def short(monkeypatch):
    """Its delays are looked for in the widest range at once: one program instead of three."""
    for kind in (ADFC, AdaptiveFeedforward, FrozenFeedforward):
        monkeypatch.setattr(kind, "first_lag_range", 2)
    return burst(0.4)


def test_adfc_is_one_choice_of_the_pieces(benchmark, short):
    """To the bit: the general controller with these pieces is the special one."""
    special = ADFC(nb=64, no=60, pull=2e-4, towards="inverse")
    ready = special.prepare(benchmark)
    pieces = AdaptiveFeedforward(
        fit=Window(64, 60), guards=(Pull(2e-4, ready.anchor), ConditionGate())
    )
    plants = draw_plants(3, seed=1)
    one, other = (simulate(benchmark, c, plants, short, keep=True) for c in (special, pieces))
    for name in ("C_A", "u", "x_m"):
        np.testing.assert_array_equal(one.signals[name], other.signals[name])


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Halfway(Guard):
    """A guard of one's own: goes a share of the way to each new fit."""

    share: float = 0.5

    def cut(self, part, proposed, last):
        return jax.tree.map(lambda new, old: old + self.share * (new - old), proposed, last)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class LeastMean(Fit):
    """A fit of one's own: least mean squares."""

    rate: float = 0.05

    def init(self, part, trials):
        return ()

    def due(self, k, reach):
        return k > reach

    def step(self, state, part, pair, last, weigh):
        moved = []
        for s, value in enumerate(pair.values):
            error = value - sum(row[s] * f for row, f in zip(last, pair.phi, strict=True))
            moved.append([row[s] + self.rate * f * error for row, f in zip(last, pair.phi)])  # noqa: B905
        return state, Fitted(tuple(zip(*moved, strict=True)))


def test_pieces_of_ones_own_run(benchmark, short):
    """One trial by the engine's loop; each trial its own number; halving rate and share alike."""
    plants, quiet = nominal_plant()[[0, 0]], SensorNoise(noise_power=0.0)

    def run(rate, share):
        own = AdaptiveFeedforward(
            fir(2), LeastMean(rate), (Halfway(share), Bounds(-2.0, 2.0)), joint=False
        )
        return simulate(benchmark, own, plants, short, quiet, keep=True).signals["C_A"]

    halved = run(np.array([0.1, 0.2]), 0.5)
    rates = run(np.array([0.05, 0.1]), 1.0)
    np.testing.assert_allclose(halved, rates, rtol=1e-9, atol=1e-12)
    assert np.abs(halved[0, -1] - halved[1, -1]).max() > 1e-5
    assert halved.shape[2:] == (2, 2)


def test_numbers_of_the_pieces_may_differ_from_trial_to_trial(benchmark, short):
    weights, most = np.array([1e-4, 1e-3, 1e-2]), RNG.uniform(0.001, 0.1, (4, 2, 3))

    def build(weight, most):
        guards = (Pull(weight), RateLimit(most), MotionThreshold(1e-3, 8.0))
        return AdaptiveFeedforward(VELOCITY, Window(32), guards)

    plants = draw_plants(3, seed=1)
    together = simulate(benchmark, build(weights, most), plants, short, keep=True)
    each = [build(float(w), most[..., i]) for i, w in enumerate(weights)]
    alone = simulate(benchmark, each, plants, short, keep=True)
    np.testing.assert_allclose(together.signals["C_A"], alone.signals["C_A"], rtol=1e-9)


def test_a_frozen_controller_is_one_that_never_fits(benchmark, short):
    coefficients = RNG.uniform(0.5, 0.9, (2, 2)) * [[1.0, 1.0], [20.0, 10.0]]
    waits = AdaptiveFeedforward(
        VELOCITY, NormalisedGradient(wait=10**6), joint=False, start=coefficients
    )
    frozen = waits.frozen(benchmark, coefficients)
    one, other = (
        simulate(benchmark, c, nominal_plant(), short, keep=True).signals["u"]
        for c in (waits, frozen)
    )
    np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(
    ("pieces", "message"),
    [
        ({"fit": Window(8)}, r"`fit.nb` must be a whole number of at least 9 \(8 unknowns\)"),
        ({"fit": Window(64, 64)}, r"`fit.no` must lie in \[0, nb - 1 = 63\]"),
        ({"fit": Window(64, solver="qr")}, r"`fit.solver` must be one of \['ldl', 'lu'\]"),
        ({"fit": Fading(1.0)}, "`fit.forgetting` must lie between 0 and 1"),
        ({"fit": Recursive(forgetting=1.1)}, "`fit.forgetting` must be above 0 and at most 1"),
        ({"fit": Recursive(np.eye(3))}, r"`fit.prior` must have shape .*\(8, 8\).* got shape"),
        ({"fit": RandomWalk(r=0.0)}, "`fit.r` must be positive"),
        ({"fit": NormalisedGradient(-1.0)}, "`fit.gain` must be zero or positive"),
        ({"guards": (ConditionGate(), Pull(-1.0))}, r"`guards\[1\].weight` must be zero or pos"),
        ({"guards": (Pull(1.0, np.eye(3)),)}, r"`guards\[0\].anchor` must have shape \(8, 2\)"),
        ({"guards": (Bounds(1.0, 0.0),)}, r"`guards\[0\].low` must be at most `high`"),
        ({"guards": (RateLimit(0.0),)}, r"`guards\[0\].most` must be positive"),
        ({"fit": Recursive(), "guards": (Pull(1.0),)},
         "`fit` must solve normal equations, which Pull changes, but got Recursive"),
        ({"guards": (ExcitationGate(),), "q": np.full(1, 1e-5)},
         r"`guards\[0\].variance` must be given where q differs"),
        ({"regressor": BackwardDifferences(9)}, "`regressor.order` must be a whole number from 0"),
        ({"learns_from": "target"}, "`learns_from` must be one of"),
        ({"start": np.zeros((4, 2))}, r"`start` must have shape \(8, 2\), but got shape \(4, 2\)"),
    ],
)  # fmt: skip
def test_what_does_not_fit_together_is_refused(benchmark, short, pieces, message):
    with pytest.raises(InputError, match=message):
        simulate(benchmark, AdaptiveFeedforward(**pieces), nominal_plant(), short)
