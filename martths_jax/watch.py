"""What went wrong in a trial, and when: kept as data beside the indices."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import jax
import jax.numpy as jnp

from martths_jax.benchmark import VOLT_LIMIT, command_volts

#: A command or stroke beyond this is a loop that has run away: the largest stroke in the study is
#: about a tenth of it, and the coupler has no position for strokes 254 mm apart.
RUNAWAY_MM = 100.0
NEVER = jnp.iinfo(jnp.int32).max


class Status(IntEnum):
    """How a trial ended, in order of gravity."""

    OK = 0
    SATURATED = 1
    DIVERGED = 2
    NONFINITE = 3


#: Signals that are watched, in the order in which they are checked.
WATCHED = ("command", "stroke", "interface")


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Watch:
    """First samples at which something happened, ``NEVER`` where it did not; T trials.

    Attributes:
        saturated: (2, T) first sample at which each valve asks for more than its limit.
        runaway: (3, T) first sample at which each of ``WATCHED`` left its range.
        nonfinite: (T,) first sample at which any of them was not finite.
        volt_peak: (2, T) largest valve command [V].
    """

    saturated: jax.Array
    runaway: jax.Array
    nonfinite: jax.Array
    volt_peak: jax.Array


def init(trials: int) -> Watch:
    """Nothing has happened yet."""
    never = jnp.full((trials,), NEVER, dtype=jnp.int32)
    return Watch(
        saturated=jnp.stack([never] * 2),
        runaway=jnp.stack([never] * len(WATCHED)),
        nonfinite=never,
        volt_peak=jnp.zeros((2, trials)),
    )


def update(watch: Watch, k: jax.Array, valid: jax.Array, signals: dict[str, jax.Array]) -> Watch:
    """Look at sample k.

    Args:
        valid: whether sample k belongs to the record.
        signals: ``u``, ``x_m`` (2, T) [mm] and ``est`` (2, T) [m, rad].
    """
    volts = jnp.abs(command_volts(signals["u"]))
    magnitude = jnp.stack(
        [
            jnp.max(jnp.abs(signals["u"]), axis=0),
            jnp.max(jnp.abs(signals["x_m"]), axis=0),
            jnp.max(jnp.abs(signals["est"]), axis=0) * 1e3,
        ]
    )
    finite = jnp.all(jnp.isfinite(magnitude), axis=0)

    def first(so_far, happened):
        return jnp.where(happened & valid, jnp.minimum(so_far, k.astype(jnp.int32)), so_far)

    return Watch(
        saturated=first(watch.saturated, volts > VOLT_LIMIT),
        runaway=first(watch.runaway, magnitude > jnp.array([[1.0], [1.0], [10.0]]) * RUNAWAY_MM),
        nonfinite=first(watch.nonfinite, ~finite),
        volt_peak=jnp.where(valid, jnp.maximum(watch.volt_peak, volts), watch.volt_peak),
    )


def status_of(watch: Watch) -> jax.Array:
    """(T,) ``Status`` of each trial."""
    happened = lambda first: first != NEVER  # noqa: E731
    status = jnp.where(jnp.any(happened(watch.saturated), axis=0), Status.SATURATED, Status.OK)
    status = jnp.where(happened(watch.nonfinite), Status.NONFINITE, status)
    return jnp.where(jnp.any(happened(watch.runaway), axis=0), Status.DIVERGED, status)
