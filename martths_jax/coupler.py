"""The rigid coupler between two actuators and the interface node (benchmark, nonlinear).

Both actuators are hinged to a rigid bar whose arms of length p stand at angles alpha_1 and
alpha_2 = -alpha_1 when the frame is at rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.algebra import angles
from martths_jax.errors import argument_error, as_numbers
from martths_jax.once import once
from martths_jax.runtime import check_precision

MM = 1e3  # mm per m


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Coupler:
    """Geometry of the coupler, the same for all trials.

    Attributes:
        arm: length p of an arm [m].
        alpha: angle alpha_2 = -alpha_1 of the arms at rest [rad].
    """

    arm: jax.Array
    alpha: jax.Array

    def to_actuators(self, interface: jax.Array) -> jax.Array:
        """(2, T) strokes [mm] of an interface motion (2, T) [m, rad]."""
        return frame_to_actuator(self, interface)

    def to_frame(self, strokes_mm: jax.Array) -> jax.Array:
        """(2, T) interface motion [m, rad] of strokes (2, T) [mm]."""
        return actuator_to_frame(self, strokes_mm)


def build_coupler(
    arm: float = float(np.hypot(0.26670, 0.127)), alpha_deg: float = 25.4633
) -> Coupler:
    """Coupler of the benchmark: arm [m] and angle at rest [degrees].

    Args:
        arm: positive; may be traced.
        alpha_deg: between 0, where the arms lie in line, and 90 degrees; may be traced.

    Raises:
        InputError: for values outside of these ranges.
    """
    check_precision()
    for name, value, most, wanted in (
        ("arm", arm, np.inf, "be positive and finite (m)"),
        ("alpha_deg", alpha_deg, 90.0, "lie between 0 and 90 degrees"),
    ):
        if isinstance(value, jax.core.Tracer):
            continue
        number = as_numbers(value)
        if number.ndim or not 0 < number < most:
            raise argument_error(name, wanted, repr(value)[:80])
    traced = isinstance(alpha_deg, jax.core.Tracer)
    alpha = jnp.deg2rad(alpha_deg) if traced else np.deg2rad(alpha_deg)
    return Coupler(arm=jnp.asarray(arm), alpha=jnp.asarray(alpha))


@once
def frame_to_actuator(coupler: Coupler, interface: jax.Array) -> jax.Array:
    """Strokes that put the interface where it is wanted.

        x_a,i = x_4 + p (cos(alpha_i + theta_28) - cos(alpha_i))

    The paper prints a plus before the second cosine; at rest the stroke is zero.

    Args:
        interface: (2, ...) translation of node 4 [m] and its rotation [rad].

    Returns:
        (2, ...) strokes of the two actuators [mm].
    """
    x, theta = interface
    # cos(alpha_i + theta) - cos(alpha_i) = -2 sin^2(theta/2) cos(alpha) -+ sin(theta) sin(alpha)
    half = angles.sine(theta / 2)
    common = x - 2 * coupler.arm * jnp.cos(coupler.alpha) * half**2
    sine = 2 * half * jnp.sqrt(1 - half**2)
    skew = coupler.arm * jnp.sin(coupler.alpha) * sine
    return MM * jnp.stack([common + skew, common - skew])


@once
def actuator_to_frame(coupler: Coupler, strokes_mm: jax.Array) -> jax.Array:
    """Interface motion that belongs to two strokes: the inverse of ``frame_to_actuator``.

        theta_28 = asin((x_1 - x_2) / (2 p sin(alpha_2))),
        x_4 = x_1 - p (cos(alpha_1 + theta_28) - cos(alpha_1))

    Args:
        strokes_mm: (2, ...) strokes [mm].

    Returns:
        (2, ...) translation of node 4 [m] and rotation [rad]; NaN where no position fits.
    """
    x_1, x_2 = strokes_mm * (1 / MM)
    sine = (x_1 - x_2) * (1 / (2 * coupler.arm * jnp.sin(coupler.alpha)))
    half = sine / (1 + jnp.sqrt(1 - sine * sine))  # tan(theta / 2)
    # The mean stroke is x_4 + p cos(alpha) (cos(theta) - 1), with 1 - cos = sin tan(theta / 2).
    drop = coupler.arm * jnp.cos(coupler.alpha) * sine * half
    return jnp.stack([(x_1 + x_2) * 0.5 + drop, angles.angle(half)])
