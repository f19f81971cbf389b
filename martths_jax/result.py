"""What a run hands back: sums, first samples, signals, and how each trial ended."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import jax
import numpy as np

from martths_jax import watch as watching
from martths_jax.indices import IndexSums, on_host, trials_last
from martths_jax.layout import Layout
from martths_jax.text import counted
from martths_jax.watch import Status


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Result:
    """Outcome of a batch of T trials, which are the first axis of every array but the reference.

    A pytree, so that a function under ``jax.jit`` may return it; its ``status`` is then traced
    inside of that function and known outside.

    Attributes:
        sums: what ``indices`` turns into numbers, see ``IndexSums``, whose trials stand first here.
        watch: first samples of saturation, runaway and non-finite values: ``saturated`` (T, 2) and
            so on, see ``Watch``, likewise.
        counts: (T,) what the controller counted, by the name of its signal: for ADFC ``held``, fits
            that it did not use.
        signals: (T, N, ...) histories if asked for, else empty: ``x_a``, ``x_m``, ``x_hat``, ``u``
            (T, N, 2) [mm]; ``num`` (T, N, 6) numerical and ``est`` (T, N, 2) estimated motion
            [m, rad]; ``force`` (T, N, 3) [N, N m]; whatever the controller adds.
        reference: (N, 6) response of the reference structure [m, rad], as ``num``; all trials share
            it.
        trial: (T,) trial numbers.
        fs: sampling rate [Hz].
        motion, controller: names.
        layout: names and sizes of the problem.
        labels: what is counted, in words, in the order of ``counts``.
    """

    sums: IndexSums
    watch: watching.Watch
    counts: dict[str, Any]
    signals: dict[str, Any]
    reference: Any
    trial: Any
    fs: float = field(metadata={"static": True})
    motion: str = field(metadata={"static": True})
    controller: str = field(metadata={"static": True})
    layout: Layout = field(metadata={"static": True})
    labels: tuple[str, ...] = field(default=(), metadata={"static": True})

    @property
    def status(self) -> np.ndarray:
        """(T,) ``Status`` of every trial; traced under a JAX transformation."""
        watch, sums = trials_last(on_host((self.watch, self.sums)))
        return watching.status_of(watch, sums)

    @property
    def lost(self) -> np.ndarray:
        """(T,) whether a trial diverged, so that it has no indices."""
        return self.status >= Status.DIVERGED

    def describe(self, position: int) -> str:
        """What happened in the trial at `position`: its status, which actuator, from when."""
        watch, sums = trials_last(on_host((self.watch, self.sums)))
        counts = dict(zip(self.labels, on_host(list(self.counts.values())), strict=True))
        line = watching.describe(
            watch, sums, range(len(self.trial))[position], self.fs, self.layout, counts
        )
        return f"Trial {int(np.asarray(self.trial)[position])} {line}"

    def __str__(self) -> str:
        number = self.trial.shape[0]
        head = (
            f"{self.controller} on {self.motion}: {counted(number, 'trial')} at "
            f"{self.fs:g} Hz, {self.reference.shape[0]} samples"
        )
        status = self.status
        if isinstance(status, jax.core.Tracer):
            return f"{head}; traced"
        counts = {s.name.lower(): int(np.sum(status == s)) for s in Status}
        return f"{head}; " + ", ".join(f"{n} {name}" for name, n in counts.items() if n)
