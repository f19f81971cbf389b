"""Planar couplers against complex geometry, SciPy's root finder, and the benchmark's coupler."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import fsolve

from martths_jax import build_coupler
from martths_jax.coupler import actuator_to_frame, frame_to_actuator
from martths_jax.errors import InputError
from martths_jax.rig.coupler import Actuator, build_planar_coupler
from martths_jax.rig.direct import Direct
from martths_jax.rig.together import together

#: Two horizontal ones at different heights and a vertical one, all with some slope.
ENDS = (
    Actuator("upper", (-0.3, 0.25), base=(-1.6, 0.31)),
    Actuator("lower", (-0.28, -0.2), base=(-1.7, -0.22)),
    Actuator("stander", (0.15, -0.3), base=(0.11, -1.5)),
)
ALPHA, ARM = np.deg2rad([-25.4633, 25.4633]), float(np.hypot(0.26670, 0.127))


def build(dofs):
    """As many of the three as there are degrees of freedom; x and y ask for two that cross."""
    chosen = {("y",): ENDS[2:], ("x", "y"): ENDS[::2], ("y", "x"): ENDS[::2]}
    return build_planar_coupler(chosen.get(tuple(dofs), ENDS[: len(dofs)]), dofs)


def actuators_of(coupler):
    return [next(e for e in ENDS if e.attachment == tuple(a)) for a in coupler.attachment.tolist()]


def stroke(ends, dofs, motion):
    """Changes of length [mm], with the plane as complex numbers."""
    q = dict(zip(dofs, motion, strict=True))
    node, turn = q.get("x", 0) + 1j * q.get("y", 0), np.exp(1j * q.get("r", 0))
    hinge = [complex(*e.attachment) for e in ends]
    base = [complex(*e.base) for e in ends]
    lengths = [abs(node + turn * a - b) - abs(a - b) for a, b in zip(hinge, base, strict=True)]
    return 1e3 * np.array(lengths)


CASES = [("x",), ("y",), ("r",), ("x", "y"), ("x", "r"), ("r", "x"), ("x", "y", "r"),
         ("r", "y", "x")]  # fmt: skip


def motions(dofs, n=9, seed=0):
    """(n of dofs, n) motions over the working range, up to 0.1 m and 0.3 rad."""
    most = {"x": 0.1, "y": 0.1, "r": 0.3}
    rng = np.random.default_rng(seed)
    return np.stack([most[d] * rng.uniform(-1, 1, n) for d in dofs])


@pytest.mark.parametrize("dofs", CASES)
def test_strokes_and_back(dofs):
    coupler, q = build(dofs), motions(dofs)
    assert coupler.actuators == len(dofs)
    ends = actuators_of(coupler)
    found = np.asarray(coupler.to_actuators(jnp.asarray(q)))
    for k in range(q.shape[1]):
        np.testing.assert_allclose(found[:, k], stroke(ends, dofs, q[:, k]), atol=1e-11)
    np.testing.assert_allclose(coupler.to_frame(jnp.asarray(found)), q, atol=1e-12)
    # The sample before is a guess as good.
    near = jnp.asarray(q) + 1e-3
    np.testing.assert_allclose(coupler.to_frame(jnp.asarray(found), near), q, atol=1e-12)


def test_way_back_is_the_root_that_scipy_finds():
    coupler, dofs = build_planar_coupler(ENDS), ("x", "y", "r")
    wanted = np.array([31.0, -18.0, 12.0])
    theirs = fsolve(lambda q: stroke(ENDS, dofs, q) - wanted, np.zeros(3), xtol=1e-13)
    np.testing.assert_allclose(coupler.to_frame(jnp.asarray(wanted)), theirs, atol=1e-10)


def test_tangent_at_rest_is_that_of_differences():
    for dofs in CASES:
        coupler, step = build(dofs), 1e-6
        ends = actuators_of(coupler)
        columns = [
            (stroke(ends, dofs, step * one) - stroke(ends, dofs, -step * one)) / (2 * step)
            for one in np.eye(len(dofs))
        ]
        np.testing.assert_allclose(coupler.jacobian(), np.stack(columns, axis=1), atol=1e-5)


def test_derivative_through_newtons_method_is_the_inverse_tangent():
    coupler, q = build_planar_coupler(ENDS), jnp.asarray(motions(("x", "y", "r"), 1)[:, 0])
    strokes = coupler.to_actuators(q)
    forward = jax.jacfwd(coupler.to_actuators)(q)
    inverse = np.linalg.inv(forward)
    for differentiate in (jax.jacfwd, jax.jacrev):
        found = differentiate(coupler.to_frame)(strokes)
        np.testing.assert_allclose(found, inverse, atol=1e-12 * np.abs(inverse).max())


def test_derivative_by_the_geometry_is_that_of_differences():
    coupler, strokes = build(("x",)), jnp.array([37.0])
    found = jax.grad(lambda a: _with(coupler, a).to_frame(strokes)[0])(coupler.attachment)
    for step in 1e-6 * np.eye(2)[:, None]:
        there, back = (
            _with(coupler, coupler.attachment + s).to_frame(strokes) for s in (step, -step)
        )
        np.testing.assert_allclose(np.sum(found * step), (there[0] - back[0]) / 2, rtol=1e-6)


def test_second_derivative_is_that_of_the_closed_form():
    """x alone: stroke = sqrt((w + x)^2 + v^2) - rest, so x'' = -stroke'' / stroke'^3."""
    coupler, x = build(("x",)), 0.07
    w, v = 1.3 + x, -0.06
    length = np.hypot(w, v)
    found = jax.grad(jax.grad(lambda s: coupler.to_frame(s[None])[0]))
    strokes = 1e3 * (length - np.hypot(1.3, v))
    expected = -(v**2 / length**3) / (w / length) ** 3 / 1e6
    np.testing.assert_allclose(found(jnp.asarray(strokes)), expected, rtol=1e-9)


def _with(coupler, attachment):
    """The coupler with other hinges, the bases where they are."""
    base = coupler.attachment - coupler.along
    return type(coupler)(attachment, attachment - base, coupler.long, coupler.dofs)


def two(length=None):
    """The benchmark's two arms, with actuators along x of a length [m], or very long ones."""
    ends = []
    for name, alpha in zip(("1", "2"), ALPHA, strict=True):
        hinge = (ARM * np.cos(alpha), ARM * np.sin(alpha))
        far = {"direction": (3.0, 0.0)}
        if length is not None:
            far = {"base": (hinge[0] - length, hinge[1])}
        ends.append(Actuator(name, hinge, **far))
    return build_planar_coupler(ends, ("x", "r"))


def test_long_actuators_along_x_are_the_benchmarks_coupler():
    theirs, ours, q = build_coupler(), two(), jnp.asarray(motions(("x", "r"), 20))
    strokes = frame_to_actuator(theirs, q)
    np.testing.assert_allclose(ours.to_actuators(q), strokes, atol=1e-12)
    np.testing.assert_allclose(
        ours.to_frame(strokes), actuator_to_frame(theirs, strokes), atol=1e-14
    )


def test_the_benchmarks_coupler_is_right_to_the_first_order_of_one_over_the_length():
    """stroke = dx + dy^2 / (2 L) + O(1 / L^2), dy how far the hinge moves across."""
    theirs, q = build_coupler(), motions(("x", "r"), 20)
    strokes = np.asarray(frame_to_actuator(theirs, jnp.asarray(q)))
    dy = ARM * (np.sin(ALPHA[:, None] + q[1]) - np.sin(ALPHA[:, None]))
    left = []
    for length in (1e1, 1e2, 1e3):
        ours = np.asarray(two(length).to_actuators(jnp.asarray(q)))
        left.append(np.abs((ours - strokes) - 1e3 * dy**2 / (2 * length)).max())
    np.testing.assert_allclose(np.array(left[:-1]) / left[1:], 100, rtol=0.05)
    np.testing.assert_allclose(two(1e12).to_actuators(jnp.asarray(q)), strokes, atol=1e-9)


def test_strokes_that_fit_no_position():
    assert np.all(np.isnan(two().to_frame(jnp.array([200.0, -200.0]))))
    # A crank of one metre gives no stroke of more.
    crank = build_planar_coupler([Actuator("a", (0.0, 1.0), direction=(1.0, 0.0))], "r")
    np.testing.assert_allclose(crank.to_frame(jnp.array([[-500.0]])), np.pi / 6, rtol=1e-14)
    assert np.all(np.isnan(crank.to_frame(jnp.array([[-1050.0, 1050.0, 1300.0]]))))


def test_each_actuator_moves_its_own_degree_of_freedom():
    q = jnp.asarray(motions(("x", "y", "r")))
    np.testing.assert_allclose(Direct(3).to_frame(Direct(3).to_actuators(q)), q, rtol=1e-15)
    np.testing.assert_array_equal(Direct(3).to_actuators(q), 1e3 * q)
    np.testing.assert_array_equal(Direct(2).jacobian(), [[1e3, 0.0], [0.0, 1e3]])


def test_couplers_side_by_side():
    first, second = build_planar_coupler(ENDS), build(("r", "x"))
    both = together(first, Direct(1), second)
    q = jnp.asarray(np.concatenate([motions(("x", "y", "r")), motions(("x",)), motions("rx")]))
    strokes = both.to_actuators(q)
    assert both.actuators == 6 and strokes.shape == (6, 9)
    np.testing.assert_array_equal(strokes[3], 1e3 * q[3])
    np.testing.assert_array_equal(strokes[4:], second.to_actuators(q[4:]))
    np.testing.assert_allclose(both.to_frame(strokes), q, atol=1e-12)
    tangent = jax.jacfwd(both.to_actuators)(jnp.zeros(6))
    np.testing.assert_allclose(both.jacobian(), tangent, atol=1e-9)
    with pytest.raises(InputError, match="`parts` must be couplers of the rig, but got None"):
        together()


def along(name, at, direction):
    return Actuator(name, at, direction=direction)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: build_planar_coupler(
            [along("a", (0.0, 1.0), (1, 0)), along("b", (0.0, -1.0), (-2, 0)),
             along("c", (2.0, 0.0), (1, 1e-9))]),
         r"a and b and c are parallel \(condition number .*\), so that a motion in y moves none"),
        (lambda: build_planar_coupler(
            [along("a", (0.0, 0.2), (1, 0)), along("b", (1.0, 0.2), (1, 0))], "xr"),
         r"but a and b are parallel \(condition number inf\), so that a motion in x, r moves none"),
        (lambda: build_planar_coupler(
            [along("a", (2.0, 0.5), (1, 0)), along("b", (1.0, 3.0), (0, 1)),
             along("c", (0.0, -0.5), (1, 1))]),
         r"the lines of a and b and c meet at one point, \(1, 0.5\) m"),
        (lambda: build_planar_coupler([along("a", (0.0, 1.0), (0, 1))], "x"),
         "a stands across the only way that is left to it .* a motion in x moves none of them"),
        (lambda: build_planar_coupler(
            [along("a", (0.0, 1.0), (1, 0)), along("b", (2.0, 2.0), (2, 1))], ("x", "r")),
         "move x, r independently of each other, but the strokes of a and b follow from each"),
        (lambda: build_planar_coupler(ENDS, "xy"), "be as many as the degrees of freedom, but got"),
        (lambda: build_planar_coupler(ENDS, "xyz"), "`dofs` must be some of x, y, r, each once"),
        (lambda: build_planar_coupler(ENDS[:1] * 2, "xy"), "names of their own, but got upper"),
        (lambda: build_planar_coupler(["a"], "x"), "be of the kind Actuator, but got 'a'"),
        (lambda: build_planar_coupler(ENDS, iterations=0), "`iterations` must be a whole number"),
        (lambda: Actuator("a", (0.0, 1.0)), "`base` must be given, or direction, .* got neither"),
        (lambda: Actuator("a", (0, 1), (1, 1), (1, 1)), "of the two, but got both"),
        (lambda: Actuator("a", (0.0, np.nan), (1, 1)), "`attachment` must be two finite numbers"),
        (lambda: Actuator("a", (1.0, 1.0), (1.0, 1.0)), r"`base` must leave the actuator a length"),
        (lambda: Actuator("", (1.0, 1.0), (1.0, 0.0)), "`name` must be a name"),
    ],
)  # fmt: skip
def test_refusals(make, message):
    with pytest.raises(InputError, match=message):
        make()
