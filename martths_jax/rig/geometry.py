"""Whether actuators move a plate's degrees of freedom independently of each other (host)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from martths_jax.errors import InputError

#: Degrees of freedom of a plate in the plane.
DOFS = ("x", "y", "r")
#: Largest condition number of the tangent at rest.
CONDITION = 1e5
#: Parts of a unit vector below this count for nothing.
PART = 1e-3


def check_geometry(
    names: Sequence[str], attachment: np.ndarray, along: np.ndarray, dofs: Sequence[str]
) -> None:
    """Refuse actuators of which one's stroke, at rest, follows from the others'.

    Rotations are counted by the way of a point at the levers' root mean square from the node, so
    that the condition number of d stroke / d motion has no unit.

    Args:
        names: of the n actuators.
        attachment: (n, 2) hinges on the plate, relative to the interface node [m].
        along: (n, 2) along the actuators, of any length.
        dofs: n of ``DOFS``.

    Raises:
        InputError: with the condition number, and which actuators stand how.
    """
    e = along / np.linalg.norm(along, axis=1, keepdims=True)
    lever = e[:, 1] * attachment[:, 0] - e[:, 0] * attachment[:, 1]
    size = np.sqrt(np.mean(lever**2)) or 1.0
    tangent = np.stack([{"x": e[:, 0], "y": e[:, 1], "r": lever / size}[d] for d in dofs], axis=1)
    U, s, Vt = np.linalg.svd(tangent)
    if s[-1] * CONDITION >= s[0] and s[0] > 0:
        return
    condition = s[0] / s[-1] if s[-1] > 1e-14 * s[0] and s[0] > 0 else np.inf
    # What combination of strokes is always zero, and what motion moves no actuator.
    tied = [i for i in range(len(names)) if abs(U[i, -1]) > PART]
    free = ", ".join(d for d, part in zip(dofs, Vt[-1], strict=True) if abs(part) > PART)
    who = " and ".join(names[i] for i in tied)
    raise InputError(
        f"Argument `actuators` must move {', '.join(dofs)} independently of each other, but "
        f"{_how(who, e[tied], lever[tied])} (condition number {condition:.2g}), so that a motion "
        f"in {free} moves none of them; move or turn one."
    )


def _how(who: str, e: np.ndarray, lever: np.ndarray) -> str:
    """How some actuators stand, in words: `e` (m, 2) unit vectors, `lever` (m,) [m]."""
    if len(e) == 1:
        return f"{who} stands across the only way that is left to it"
    if np.all(np.abs(e[0, 0] * e[:, 1] - e[0, 1] * e[:, 0]) < PART):
        return f"{who} are parallel"
    # A point P is on all lines of action if the levers about it, lever - e x P, are zero.
    across = np.stack([-e[:, 1], e[:, 0]], axis=1)
    point, *_ = np.linalg.lstsq(across, -lever, rcond=None)
    if len(e) > 2 and np.allclose(across @ point, -lever, atol=PART * max(1e-9, np.ptp(lever))):
        return f"the lines of {who} meet at one point, ({point[0]:.3g}, {point[1]:.3g}) m"
    return f"the strokes of {who} follow from each other"
