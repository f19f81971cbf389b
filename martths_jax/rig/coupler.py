"""A rigid coupler in the plane: n actuators between fixed bases and a plate at an interface node.

The node moves by x, y [m] and turns by r [rad], counter-clockwise.  An actuator's attachment, at a
from the node, moves with the plate, and its stroke is how much longer the actuator has become:

    d = (x, y) + (R(r) - I) a,
    stroke = |w + d| - |w| = (2 w . d + d . d) / (|w + d| + |w|),   w from its base to a at rest.

An actuator so long that only the way along it counts is given by its direction e: stroke = e . d.
With both actuators of the two-actuator benchmark along x, this is its published coupler.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.algebra import angles
from martths_jax.errors import argument_error, as_numbers, check_whole
from martths_jax.once import once
from martths_jax.rig.direct import MM
from martths_jax.rig.geometry import DOFS, check_geometry
from martths_jax.runtime import check_precision

#: Steps of Newton's method: from the linearised guess, three give 0.1 m and 0.3 rad to 1e-13, and
#: the fourth shows that they have.
ITERATIONS = 4
#: A last correction above this [m or rad] says that no position fits the strokes.
CONVERGED = 1e-6


@dataclass(frozen=True)
class Actuator:
    """Ends of an actuator at rest; give its `base`, or its `direction` where it is very long.

    Attributes:
        name: of the actuator.
        attachment: (x, y) of its hinge on the plate, relative to the interface node [m].
        base: (x, y) of its fixed hinge, relative to the interface node at rest [m].
        direction: (x, y) along which it extends, of any length [-].

    Raises:
        InputError: for what are no two finite numbers, both or neither of the last two, or an
            actuator without length.
    """

    name: str
    attachment: tuple[float, float]
    base: tuple[float, float] | None = None
    direction: tuple[float, float] | None = None

    def __post_init__(self):
        if not isinstance(self.name, str) or not self.name:
            raise argument_error("name", "be a name", repr(self.name)[:80])
        if (self.base is None) == (self.direction is None):
            got = "neither" if self.base is None else "both"
            raise argument_error("base", "be given, or direction, of the two", got)
        for name in ("attachment", "base", "direction"):
            point = getattr(self, name)
            if point is None:
                continue
            values = as_numbers(point)
            if values.shape != (2,) or not np.all(np.isfinite(values)):
                raise argument_error(name, "be two finite numbers (x, y)", repr(point)[:80])
            object.__setattr__(self, name, tuple(values.tolist()))
        if not np.hypot(*self.along) > 0:
            given = "direction" if self.base is None else "base"
            raise argument_error(
                given, "leave the actuator a length", f"{getattr(self, given)} for {self.name}"
            )

    @property
    def along(self) -> tuple[float, float]:
        """From its base to its attachment at rest [m], or its direction."""
        if self.base is None:
            return self.direction
        return self.attachment[0] - self.base[0], self.attachment[1] - self.base[1]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class PlanarCoupler:
    """n actuators that move n degrees of freedom of one plate, the same for all trials.

    Attributes:
        attachment: (n, 2) hinges on the plate, relative to the interface node [m].
        along: (n, 2) from base to attachment at rest [m]; a unit vector for a long actuator.
        long: for each actuator, whether only the way along it counts.
        dofs: which of ``x``, ``y``, ``r`` are rows of a motion, in which order; others rest.
        iterations: steps of Newton's method.
    """

    attachment: jax.Array
    along: jax.Array
    long: tuple[bool, ...] = field(metadata={"static": True})
    dofs: tuple[str, ...] = field(metadata={"static": True})
    iterations: int = field(default=ITERATIONS, metadata={"static": True})

    @property
    def actuators(self) -> int:
        """Number n of actuators."""
        return len(self.dofs)

    def to_actuators(self, motion: jax.Array) -> jax.Array:
        """Strokes that put the interface where it is wanted, in closed form.

        Args:
            motion: (n, ...) of `dofs` [m, rad], rotations up to one radian.

        Returns:
            (n, ...) changes of length [mm].
        """
        return _to_actuators(self, motion)

    def to_frame(self, strokes_mm: jax.Array, guess: jax.Array | None = None) -> jax.Array:
        """Interface motion that belongs to n strokes, by Newton's method; differentiable.

        Args:
            strokes_mm: (n, ...) changes of length [mm].
            guess: (n, ...) motion to begin with, such as that of the sample before; the linearised
                one by default.

        Returns:
            (n, ...) motion of `dofs` [m, rad]; NaN where no position was found.
        """
        if guess is None:
            inverse = _inverse(_tangent(self, [jnp.zeros(())] * self.actuators))
            guess = _rows_times(inverse, list(strokes_mm * (1 / MM)))
            guess = jnp.stack(guess)
        return _to_frame(self, strokes_mm, guess)

    def jacobian(self) -> jax.Array:
        """(n, n) strokes per motion at rest [mm/m, mm/rad]."""
        tangent = _tangent(self, [jnp.zeros(())] * self.actuators)
        return MM * jnp.stack([jnp.stack(row) for row in tangent])


def build_planar_coupler(
    actuators: Sequence[Actuator], dofs: Sequence[str] = DOFS, *, iterations: int = ITERATIONS
) -> PlanarCoupler:
    """Coupler of n actuators that move n degrees of freedom of a plate.

    Args:
        actuators: their ends.
        dofs: n of ``x``, ``y``, ``r`` in the order of the problem's interface; the structure holds
            the others still.
        iterations: steps of Newton's method, from 2 to 20.

    Raises:
        InputError: for numbers that do not fit, or actuators that do not move the degrees of
            freedom independently of each other.
    """
    check_precision()
    actuators, dofs = tuple(actuators), tuple(dofs)
    check_whole("iterations", iterations, 2, 20)
    for actuator in actuators:
        if not isinstance(actuator, Actuator):
            raise argument_error("actuators", "be of the kind Actuator", repr(actuator)[:80])
    names = [actuator.name for actuator in actuators]
    if len(set(names)) != len(names):
        raise argument_error("actuators", "have names of their own", ", ".join(names))
    if not dofs or len(set(dofs)) != len(dofs) or not set(dofs) <= set(DOFS):
        raise argument_error("dofs", f"be some of {', '.join(DOFS)}, each once", repr(dofs)[:80])
    if len(actuators) != len(dofs):
        got = f"{len(actuators)} for {', '.join(dofs)}"
        raise argument_error("actuators", "be as many as the degrees of freedom", got)
    long = tuple(actuator.base is None for actuator in actuators)
    attachment = np.array([actuator.attachment for actuator in actuators])
    along = np.array([actuator.along for actuator in actuators])
    along[list(long)] /= np.linalg.norm(along[list(long)], axis=1, keepdims=True)
    check_geometry(names, attachment, along, dofs)
    return PlanarCoupler(jnp.asarray(attachment), jnp.asarray(along), long, dofs, iterations)


def _moved(coupler: PlanarCoupler, q: Sequence):
    """Of each actuator at a motion q, rows (...): stroke [m], its unit vector, its lever [m].

    The lever is that of the actuator's force about the node, which is d stroke / d r.
    """
    place = dict(zip(coupler.dofs, q, strict=True))
    zero = jnp.zeros_like(q[0])
    x, y, r = (place.get(name, zero) for name in DOFS)
    half = angles.sine(r / 2)
    less, turn = -2 * half * half, 2 * half * jnp.sqrt(1 - half * half)  # cos r - 1, sin r
    found = []
    for i, long in enumerate(coupler.long):
        (a, b), (w, v) = coupler.attachment[i], coupler.along[i]
        over, up = a * less - b * turn, b * less + a * turn  # of the attachment, by rotation
        dx, dy = x + over, y + up
        if long:
            stroke, ex, ey = w * dx + v * dy, w, v
        else:
            rest, grown = w * w + v * v, 2 * (w * dx + v * dy) + dx * dx + dy * dy
            length = jnp.sqrt(rest + grown)
            stroke = grown / (length + jnp.sqrt(rest))
            ex, ey = (w + dx) / length, (v + dy) / length
        found.append((stroke, ex, ey, ey * (a + over) - ex * (b + up)))
    return found


def _tangent(coupler: PlanarCoupler, q: Sequence) -> list[list]:
    """n rows of d stroke / d q at a motion q [-, m]."""
    return [_row(coupler, moved) for moved in _moved(coupler, q)]


def _row(coupler: PlanarCoupler, moved) -> list:
    by = dict(zip(DOFS, moved[1:], strict=True))
    return [by[name] for name in coupler.dofs]


@once
def _to_actuators(coupler: PlanarCoupler, motion: jax.Array) -> jax.Array:
    return MM * jnp.stack([moved[0] for moved in _moved(coupler, list(motion))])


def _to_frame(coupler: PlanarCoupler, strokes_mm: jax.Array, guess: jax.Array) -> jax.Array:
    # The last two steps, from constants, have derivatives that are exact up to the third.
    still = jax.tree.map(jax.lax.stop_gradient, (coupler, strokes_mm, guess))
    q = still[2]
    for _ in range(coupler.iterations - 2):
        q = q - _correction(*still[:2], q)
    q = jax.lax.stop_gradient(q)
    q = q - _correction(coupler, strokes_mm, q)
    step = _correction(coupler, strokes_mm, q)
    settled = jnp.sum(jnp.abs(step), axis=0, keepdims=True) < CONVERGED
    return jnp.where(settled, q - step, jnp.nan)


@once  # or the compiler would repeat all steps in each entry of the next
def _correction(coupler: PlanarCoupler, strokes_mm: jax.Array, q: jax.Array) -> jax.Array:
    """(n, ...) by how much one step of Newton's method takes a motion q back [m, rad]."""
    moved = _moved(coupler, list(q))
    rest = [m[0] - s * (1 / MM) for m, s in zip(moved, list(strokes_mm), strict=True)]
    return jnp.stack(_rows_times(_inverse([_row(coupler, m) for m in moved]), rest))


def _rows_times(matrix: Sequence[Sequence], x: Sequence) -> list:
    """Product of a matrix, as rows of arrays, with rows x."""
    return [sum(m * y for m, y in zip(row, x, strict=True)) for row in matrix]


def _inverse(m: Sequence[Sequence]) -> list[list]:
    """Inverse of a matrix of up to three rows of arrays, in closed form."""
    if len(m) == 1:
        return [[1 / m[0][0]]]
    if len(m) == 2:
        (a, b), (c, d) = m
        scale = 1 / (a * d - b * c)
        return [[d * scale, -b * scale], [-c * scale, a * scale]]

    def cofactor(i, j):
        (a, b), (c, d) = ([m[k][l] for l in range(3) if l != j] for k in range(3) if k != i)
        return (-1) ** (i + j) * (a * d - b * c)

    minors = [[cofactor(i, j) for j in range(3)] for i in range(3)]
    scale = 1 / sum(m[0][j] * minors[0][j] for j in range(3))
    return [[minors[j][i] * scale for j in range(3)] for i in range(3)]
