"""What went wrong in a trial, and when: kept as data beside the indices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.indices import IndexSums, library, without_value
from martths_jax.layout import Layout
from martths_jax.observers import Observer

NEVER = float(2**53)
NOTHING: Mapping[str, Any] = MappingProxyType({})


class Status(IntEnum):
    """How a trial ended, in order of gravity.

    SATURATED: a valve was asked for more than its limit; the run is whole and has indices (the
    valves are only monitored).  UNDEFINED: the run is whole, but an index has no value (it is NaN),
    since its target does not move or is too small to be squared.  DIVERGED: a command or stroke
    left its range.  NONFINITE: a stroke turned into NaN or infinity without having left its range
    before.  The last two are *lost*: their indices are NaN, and their numbers the only ones from
    ``DIVERGED`` on.
    """

    OK = 0
    SATURATED = 1
    UNDEFINED = -1
    DIVERGED = 2
    NONFINITE = 3


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Watch:
    """First samples at which something happened, ``NEVER`` where it did not; T trials.

    The trials are the last axis here, in the loop; in a ``Result`` they are the first.

    Attributes:
        saturated: (n, T) each valve asks for more than its limit.
        command: (n, T) a command left its range or is not a number.
        stroke: (n, T) a measured stroke left its range or is not a number.
        nonfinite: (n, T) a measured stroke is not finite.
        volt_peak: (n, T) largest valve command while it was in range [V].
    """

    saturated: jax.Array
    command: jax.Array
    stroke: jax.Array
    nonfinite: jax.Array
    volt_peak: jax.Array


@dataclass(frozen=True)
class Watcher(Observer):
    """Keeps the ``Watch`` of a run; looks at ``u`` and ``x_m`` (n, T) [mm].

    Attributes:
        layout: of the problem, whose limits it goes by.
    """

    layout: Layout

    def init(self, trials):
        """Nothing has happened yet."""
        shape = len(self.layout.actuators), trials
        never = jnp.full(shape, NEVER)
        return Watch(never, never, never, never, jnp.zeros(shape))

    def add(self, state, signals, reference, k, valid):
        watch = state
        valves, most = self.layout.valves, self.layout.runaway_mm
        volts = jnp.abs(valves.volts(signals["u"]))
        in_range = jnp.abs(signals["u"]) <= most
        now = jnp.where(valid, k.astype(float), NEVER)

        def first(so_far, good):
            return jnp.minimum(so_far, jnp.where(good, NEVER, now))

        peak = valid & in_range & (volts > watch.volt_peak)
        return Watch(
            saturated=first(watch.saturated, ~(volts > valves.limit)),
            # NaN compares false, so it counts as out of range.
            command=first(watch.command, in_range),
            stroke=first(watch.stroke, jnp.abs(signals["x_m"]) <= most),
            nonfinite=first(watch.nonfinite, jnp.isfinite(signals["x_m"])),
            volt_peak=jnp.where(peak, volts, watch.volt_peak),
        )


def status_of(watch: Watch, sums: IndexSums | None = None) -> jax.Array:
    """(T,) ``Status`` of each trial, trials on the last axis.

    Args:
        watch: of a finished run.
        sums: of the same run; without them no trial is ``UNDEFINED``.
    """
    xp = library(*vars(watch).values())
    happened = lambda first: xp.any(first != NEVER, axis=0)  # noqa: E731
    runaway = happened(watch.command) | happened(watch.stroke)
    # A trial that ran away overflows in the end; only one that is lost at once is "nonfinite".
    first_bad = xp.minimum(xp.min(watch.command, axis=0), xp.min(watch.stroke, axis=0))
    at_once = happened(watch.nonfinite) & (xp.min(watch.nonfinite, axis=0) <= first_bad)
    status = xp.where(happened(watch.saturated), Status.SATURATED, Status.OK)
    if sums is not None:
        undefined = xp.any(xp.stack(list(without_value(sums).values())), axis=0)
        status = xp.where(undefined, Status.UNDEFINED, status)
    status = xp.where(runaway, Status.DIVERGED, status)
    return xp.where(at_once, Status.NONFINITE, status)


def describe(
    watch: Watch,
    sums: IndexSums,
    trial: int,
    fs: float,
    layout: Layout,
    counts: Mapping[str, Any] = NOTHING,
) -> str:
    """One line about a trial: its status, and what happened first, where and when.

    Args:
        watch, sums: of a finished run, trials on the last axis.
        trial: position in the batch.
        fs: sampling rate [Hz].
        layout: of the problem.
        counts: (T,) what the controller counted, by what it counted.
    """
    status = Status(int(np.asarray(status_of(watch, sums))[trial]))
    column = lambda name: np.asarray(getattr(watch, name))[..., trial]  # noqa: E731
    parts = []
    if status >= Status.DIVERGED:
        parts.append(_first_cause(column, status, fs, layout))
    if status == Status.UNDEFINED:
        names = [n for n, missing in without_value(sums).items() if np.asarray(missing)[trial]]
        parts.append(f"{', '.join(names)} without a value, since the target does not move")
    for i, name in enumerate(layout.actuators):
        first = column("saturated")[i]
        if first != NEVER:
            parts.append(
                f"actuator {name} beyond {layout.valves.limit:g} V from {_when(first, fs)}, "
                f"peak {column('volt_peak')[i]:.3g} V"
            )
    parts += [f"{what}: {int(n[trial])}" for what, n in counts.items() if n[trial]]
    return f"{status.name.lower()}: {'; '.join(parts)}" if parts else status.name.lower()


def _first_cause(column, status: Status, fs: float, layout: Layout) -> str:
    """What took a trial away: the first event of its watch, whose arrays `column` picks."""
    limit = f"left +-{layout.runaway_mm:g} mm or became NaN"
    causes = [("command", limit), ("stroke", limit), ("nonfinite", "is not finite")]
    if status == Status.NONFINITE:
        causes.reverse()
    # `min` keeps the first of equals: the cause before its consequence.
    first, i, name, what = min(
        (
            (column(name)[i], i, name, what)
            for name, what in causes
            for i in range(len(layout.actuators))
        ),
        key=lambda event: event[0],
    )
    signal = "command u" if name == "command" else "measured stroke x_m"
    return f"{signal} of actuator {layout.actuators[i]} {what} at {_when(first, fs)}"


def _when(sample: float, fs: float) -> str:
    return f"sample {int(sample)} ({sample / fs:.3f} s)"
