"""Arguments of the pieces: what forms they may come in, and what is said of those they may not."""

from __future__ import annotations

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.base import ACTUATORS, Part, parts_of
from martths_jax.errors import argument_error, as_numbers

#: Shapes that an argument with one number a coefficient, or one matrix a part, may come in; see
#: ``check_shape``.
SHAPES = ("number", "unknowns", "coefficients")
MATRICES = ("number", "unknowns", "matrix", "matrices")


def per_part(value, columns: int, joint: bool, actuators: int = ACTUATORS) -> jax.Array:
    """A symmetric matrix for each part, (parts, n, n) or (parts, n, n, T).

    Args:
        value: such an array, or one number, n numbers of a diagonal, or a matrix (n, n), the same
            for all parts.
        columns, joint, actuators: see ``parts_of``.
    """
    value = jnp.asarray(value, dtype=float)
    if value.ndim > 2:
        return value
    parts = parts_of(columns, joint, actuators)
    n = parts[0].unknowns
    matrix = value if value.ndim == 2 else jnp.diag(jnp.broadcast_to(value, (n,)))
    return jnp.broadcast_to(matrix, (len(parts), n, n))


def per_coefficient(value, columns: int, joint: bool, actuators: int = ACTUATORS) -> jax.Array:
    """One number a coefficient, (n, actuators) or (n, actuators, T).

    Args:
        value: such an array, or one number, or n numbers, the same for all actuators.
        columns, joint, actuators: see ``parts_of``.
    """
    value = jnp.asarray(value, dtype=float)
    n = parts_of(columns, joint, actuators)[0].unknowns
    if value.ndim < 2:
        value = jnp.broadcast_to(value, (n,))[:, None]
        value = jnp.broadcast_to(value, (n, actuators))
    return value


def known(value) -> np.ndarray | None:
    """Numbers of an argument; None where there are none yet, since it is traced or left out."""
    leaves = jax.tree.leaves(value)
    if not leaves or any(isinstance(x, jax.core.Tracer) or type(x) is object for x in leaves):
        return None
    return np.asarray(value)


def complaint(good, name: str, wanted: str, got) -> list[str]:
    """One sentence about an argument, or none if all of `good` holds."""
    return [] if np.all(good) else [str(argument_error(name, wanted, got))]


def check_positive(name: str, value, *, zero: bool = False) -> list[str]:
    """A sentence about an argument whose numbers are not all finite and positive."""
    if known(value) is None:
        return []
    number = as_numbers(value)
    good = np.isfinite(number) & ((number >= 0) if zero else (number > 0))
    wanted = "be zero or positive" if zero else "be positive"
    return complaint(good, name, wanted, f"{value!r:.80}")


def check_shape(name: str, value, parts: Sequence[Part], shapes: Sequence[str]) -> list[str]:
    """A sentence about an argument of a shape that no part can use.

    Args:
        name: of the argument.
        value: it.
        parts: of the controller.
        shapes: those allowed, of ``number``, ``unknowns``, ``coefficients`` (n, actuators),
            ``matrix`` (n, n), ``matrices`` (parts, n, n); the last may have one value a trial too.
    """
    number = known(value)
    if number is None:
        return []
    n, actuators = parts[0].unknowns, sum(len(part.sides) for part in parts)
    sizes = {
        "number": (), "unknowns": (n,), "coefficients": (n, actuators), "matrix": (n, n),
        "matrices": (len(parts), n, n),
    }  # fmt: skip
    allowed = [sizes[s] for s in shapes]
    last = allowed[-1]
    good = number.shape in allowed or (number.ndim == len(last) + 1 and number.shape[:-1] == last)
    wanted = " or ".join(str(s) for s in allowed)
    return complaint(good, name, f"have shape {wanted}", f"shape {number.shape}")
