"""The ways down: they resume to the bit, they survive what diverges, and they get there."""

import numpy as np
import pytest

from martths_jax.tune.descent import LBFGS, METHODS
from martths_jax.tune.gradient import EACH, FORWARD, REVERSE, cheaper_mode

NAMES = ("x", "y")


def valley(point):
    """Rosenbrock's, whose floor bends from the start to (1, 1): value and slope."""
    x, y = point["x"], point["y"]
    slope = {"x": -400 * x * (y - x * x) - 2 * (1 - x), "y": 200 * (y - x * x)}
    return 100 * (y - x * x) ** 2 + (1 - x) ** 2, slope


def descend(method, evaluate, start, steps, good=lambda point: True):
    """(values at good points, all points) of a descent."""
    known, values, points = method.init(start), [], []
    while not known["ended"] and len(points) < steps:
        point = dict(known["trial"])
        points.append(point)
        loss, slope = evaluate(point)
        fine = good(point)
        if fine:
            values.append(loss)
        method.advance(known, loss if fine else np.nan, slope, fine)
    return values, points, known


def test_lbfgs_follows_a_bent_valley_and_adam_does_not():
    start = {"x": -1.2, "y": 1.0}
    quick, _, _ = descend(LBFGS(NAMES, 0.1), valley, start, 60)
    slow, _, _ = descend(METHODS["adam"](NAMES, 0.1), valley, start, 60)
    assert min(quick) < 1e-9 < 1e-2 < min(slow)


@pytest.mark.parametrize("wall", [-0.5, 0.0, 0.6])
def test_a_point_that_is_not_good_bounds_the_search(wall):
    """Beyond a wall across the valley nothing has a value; the descent ends at its foot."""
    values, points, known = descend(
        LBFGS(NAMES, 0.1), valley, {"x": -1.2, "y": 1.0}, 200, lambda p: p["x"] < wall
    )
    assert any(p["x"] >= wall for p in points), "it has looked beyond"
    assert known["here"]["x"] < wall and known["ended"]
    assert known["loss"] == min(values)
    floor = valley({"x": wall, "y": wall**2})[0]
    assert floor <= known["loss"] < 1.05 * floor


def test_no_accepted_step_goes_up():
    accepted, method = [], LBFGS(NAMES, 0.1)
    known = method.init({"x": -1.2, "y": 1.0})
    while not known["ended"]:
        loss, slope = valley(known["trial"])
        if method.advance(known, loss, slope, True):
            accepted.append(loss)
    assert len(accepted) > 20 and np.all(np.diff(accepted) < 0)


def test_a_kink_ends_it():
    """|x| has no slope that vanishes: the search finds no more and says so."""
    kink = lambda p: (abs(p["x"]), {"x": float(np.sign(p["x"])), "y": 0.0})  # noqa: E731
    values, points, known = descend(LBFGS(NAMES, 0.1), kink, {"x": 0.73, "y": 0.0}, 500)
    assert known["ended"] and len(points) < 200 and min(values) < 1e-2


@pytest.mark.parametrize("numbers", range(1, 30))
def test_the_cheaper_mode(numbers):
    costs = {"forward": FORWARD + EACH * numbers, "reverse": REVERSE}
    assert costs[cheaper_mode(numbers)] == min(costs.values())


def test_modes_of_the_packages_own():
    assert cheaper_mode(2) == cheaper_mode(6) == "forward" and cheaper_mode(20) == "reverse"
