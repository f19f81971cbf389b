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
NEVER = float(2**53)


class Status(IntEnum):
    """How a trial ended, in order of gravity."""

    OK = 0
    SATURATED = 1
    DIVERGED = 2
    NONFINITE = 3


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Watch:
    """First samples at which something happened, ``NEVER`` where it did not; T trials.

    Attributes:
        saturated: (2, T) each valve asks for more than its limit.
        command: (2, T) a command left its range or is not a number.
        stroke: (2, T) a measured stroke left its range or is not a number.
        nonfinite: (2, T) a measured stroke is not finite.
        volt_peak: (2, T) largest valve command [V].
    """

    saturated: jax.Array
    command: jax.Array
    stroke: jax.Array
    nonfinite: jax.Array
    volt_peak: jax.Array


def init(trials: int) -> Watch:
    """Nothing has happened yet."""
    never = jnp.full((2, trials), NEVER)
    return Watch(never, never, never, never, jnp.zeros((2, trials)))


def update(watch: Watch, k: jax.Array, valid: jax.Array, signals: dict[str, jax.Array]) -> Watch:
    """Look at sample k.

    Args:
        k: number of the sample.
        valid: whether it belongs to the record.
        signals: ``u`` and ``x_m`` (2, T) [mm].
    """
    volts = jnp.abs(command_volts(signals["u"]))
    now = jnp.where(valid, k.astype(float), NEVER)

    def first(so_far, good):
        return jnp.minimum(so_far, jnp.where(good, NEVER, now))

    return Watch(
        saturated=first(watch.saturated, ~(volts > VOLT_LIMIT)),
        # NaN compares false, so it counts as out of range.
        command=first(watch.command, jnp.abs(signals["u"]) <= RUNAWAY_MM),
        stroke=first(watch.stroke, jnp.abs(signals["x_m"]) <= RUNAWAY_MM),
        nonfinite=first(watch.nonfinite, jnp.isfinite(signals["x_m"])),
        volt_peak=jnp.where(valid, jnp.maximum(watch.volt_peak, volts), watch.volt_peak),
    )


def status_of(watch: Watch) -> jax.Array:
    """(T,) ``Status`` of each trial."""
    happened = lambda first: jnp.any(jnp.asarray(first) != NEVER, axis=0)  # noqa: E731
    runaway = happened(watch.command) | happened(watch.stroke)
    # A trial that ran away overflows in the end; only one that is lost at once is "nonfinite".
    first_bad = jnp.minimum(jnp.min(watch.command, axis=0), jnp.min(watch.stroke, axis=0))
    at_once = happened(watch.nonfinite) & (jnp.min(watch.nonfinite, axis=0) <= first_bad)
    status = jnp.where(happened(watch.saturated), Status.SATURATED, Status.OK)
    status = jnp.where(runaway, Status.DIVERGED, status)
    return jnp.where(at_once, Status.NONFINITE, status)
