"""Whether all that a controller remembers is in the state that it hands on."""

from __future__ import annotations

from collections.abc import Mapping, Set
from typing import Any

import jax
import numpy as np

from martths_jax.conformity.report import Finding
from martths_jax.conformity.stand import Stand, apart, same
from martths_jax.control.base import Controller, Estimator

REMEDY = (
    "keep all that it remembers in the state that `init` returns and `step` hands on (or in a "
    "delay line), not in lists, counters, files or the outputs of callbacks."
)
#: How deep values inside of values are looked at.
DEPTH = 6


def memory(stand: Stand) -> Finding:
    """The same bits again: in turn, after other trials, and in plain Python; self unchanged."""
    name = "outside state"
    before = _attributes(stand.controller)
    try:
        first = stand.u
        stand.again(_other_trials(stand.strokes))
        again = stand.again(stand.strokes)
    except jax.errors.UnexpectedTracerError:
        return Finding(
            name, False, None,
            f"It keeps a value of an earlier trace, so that it cannot run again; {REMEDY}",
        )  # fmt: skip
    if not same(first, again).all():
        return Finding(
            name, False, apart(first, again),
            f"The same strokes give other commands after a run of other trials; {REMEDY}",
            "of the largest",
        )  # fmt: skip
    plain = _twice(stand)
    if plain is not None and not same(*plain).all():
        return Finding(
            name, False, apart(*plain),
            f"The same samples give other commands when `step` is called again; {REMEDY}",
            "of the largest",
        )  # fmt: skip
    after = _attributes(stand.controller)
    changed = sorted(key for key in before.keys() | after.keys() if _differ(before, after, key))
    if changed:
        return Finding(
            name, False, len(changed),
            f"Running it changes {', '.join(changed)}; {REMEDY}", "attributes",
        )  # fmt: skip
    return Finding(name, True, None, "The same bits again, also after a run of other trials.")


def _other_trials(strokes):
    """Strokes of other trials: turned round in their order and in their sign."""
    return tuple(-x[..., ::-1] for x in strokes)


def _twice(stand: Stand) -> tuple[np.ndarray, np.ndarray] | None:
    """Commands of the same samples, twice in plain Python; None if it does not run there."""
    try:
        return stand.eager(), stand.eager()
    except Exception:  # what goes wrong without jit is the affair of another check
        return None


def _attributes(controller: Controller) -> dict[str, Any]:
    """What a controller, its estimator and their classes hold, to be compared."""
    found = {}
    for owner in (controller, controller.estimator):
        kinds = [k for k in type(owner).__mro__ if k not in (Controller, Estimator, object)]
        for place in (owner, *kinds):
            name = place.__name__ if isinstance(place, type) else f"self ({type(owner).__name__})"
            for key, value in vars(place).items() if hasattr(place, "__dict__") else ():
                if not (key.startswith("__") or key == "_abc_impl" or callable(value)):
                    found[f"`{key}` of {name}"] = _content(value, DEPTH)
    return found


def _content(value, depth: int):
    """What a value holds, as something that can be compared later."""
    if isinstance(value, (np.ndarray, jax.Array)):
        if isinstance(value, jax.core.Tracer):
            return id(value)
        array = np.asarray(value)
        return array.shape, str(array.dtype), array.tobytes()
    if depth and isinstance(value, Mapping):
        return tuple((repr(key), _content(x, depth - 1)) for key, x in value.items())
    if depth and isinstance(value, (list, tuple)):
        return tuple(_content(x, depth - 1) for x in value)
    if isinstance(value, Set):
        return frozenset(map(repr, value))
    if value is None or isinstance(value, (bool, int, float, complex, str, bytes)):
        return repr(value)
    if depth and hasattr(value, "__dict__"):
        return id(value), tuple((k, _content(x, depth - 1)) for k, x in vars(value).items())
    return id(value)


def _differ(before: dict, after: dict, key: str) -> bool:
    return key not in before or key not in after or before[key] != after[key]
