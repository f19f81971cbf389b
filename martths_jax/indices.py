"""The 24 evaluation indices of the benchmark, as running sums over a trajectory.

J1, J4 are delays [ms]; J2, J5, J7, J8 root-mean-square errors and J3, J6, J9, J10 peak errors, in
percent of the target (Condori Uribe et al. 2023, section on evaluation criteria; the numbers behind
the underscore name the actuator or the degree of freedom).  All but the delays need four running
values a pair of signals; the delays need the cross-correlation at a range of lags.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.runtime import check_runtime

#: The ten compared pairs: name of the RMS index, name of the peak index.
PAIRS = (
    ("J2_1", "J3_1"), ("J2_2", "J3_2"), ("J5_4", "J6_4"), ("J5_28", "J6_28"),
    ("J7_4", "J9_4"), ("J7_28", "J9_28"), ("J8_2", "J10_2"), ("J8_26", "J10_26"),
    ("J8_3", "J10_3"), ("J8_27", "J10_27"),
)  # fmt: skip
#: The four cross-correlated pairs: measured, then estimated strokes against their targets.
DELAYS = ("J1_1", "J1_2", "J4_1", "J4_2")
#: All indices in the order of Table 4.
NAMES = (
    "J1_1", "J1_2", "J2_1", "J2_2", "J3_1", "J3_2", "J4_1", "J4_2", "J5_4", "J5_28", "J6_4",
    "J6_28", "J7_4", "J7_28", "J8_2", "J8_26", "J8_3", "J8_27", "J9_4", "J9_28", "J10_2",
    "J10_26", "J10_3", "J10_27",
)  # fmt: skip


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class IndexSums:
    """What a run accumulates, trials on the last axis (in a ``Result`` on the first).

    Attributes:
        error_square, target_square: (10, T) sums of squares of the ``PAIRS``.
        error_peak, target_peak: (10, T) largest magnitudes.
        correlation: (lags, 4, T) cross-correlations of ``DELAYS``.
        lags: (lead, lag): the correlation covers -lead ... lag samples.
        fs: sampling rate [Hz].
    """

    error_square: jax.Array
    target_square: jax.Array
    error_peak: jax.Array
    target_peak: jax.Array
    correlation: jax.Array
    lags: tuple[int, int] = field(metadata={"static": True})
    fs: float = field(metadata={"static": True})


def pairs(signals: Mapping[str, jax.Array], reference: jax.Array):
    """(value, target) of the ``PAIRS`` at one sample, in four groups of 2, 2, 2 and 4 rows.

    Args:
        signals: ``x_a``, ``x_m`` (2, T) [mm], ``num`` (6, T), ``est`` (2, T) [m, rad].
        reference: (6, 1) response of the reference structure in the order of ``num``.
    """
    num, est = signals["num"], signals["est"]
    return (
        (signals["x_m"], signals["x_a"]),
        (est, num[:2]),
        (est, jnp.broadcast_to(reference[:2], est.shape)),
        (num[2:], jnp.broadcast_to(reference[2:], num[2:].shape)),
    )


def blank_sums(trials: int):
    """Zero (error square, target square, error peak, target peak) of the groups of ``pairs``."""
    return tuple((jnp.zeros((rows, trials)),) * 4 for rows in (2, 2, 2, 4))


def correlate(y: jax.Array, x: jax.Array, lags: tuple[int, int]) -> jax.Array:
    """Products sum_k y(k) x(k - l) for l = -lead ... lag.

    Args:
        y: (n, T) samples w ... w + n - 1.
        x: (n + lead + lag, T) samples w - lag ... w + n - 1 + lead.
        lags: (lead, lag) [samples].

    Returns:
        (lead + lag + 1, T).
    """
    width, n = sum(lags) + 1, y.shape[0]
    # Blocks of a few samples, each one fused sum over its samples for all lags at once, so that
    # the accumulator is read and written once a block and the signals stay in the cache.
    block = 16
    blocks = -(-n // block)
    short = [(0, blocks * block - n), (0, 0)]
    y, x = jnp.pad(y, short), jnp.pad(x, short)

    def add(total, b):
        y_b = jax.lax.dynamic_slice_in_dim(y, b * block, block)
        x_b = jax.lax.dynamic_slice_in_dim(x, b * block, block + width - 1)
        # Row j of the total is lag `lag - j`.
        return total + sum(y_b[i] * x_b[i : i + width] for i in range(block)), None

    total, _ = jax.lax.scan(add, jnp.zeros((width, y.shape[1])), jnp.arange(blocks))
    return total[::-1]


def library(*arrays):
    """NumPy for arrays on the host, which then needs no compiling; ``jax.numpy`` for others."""
    return jnp if any(isinstance(x, jax.Array) for x in arrays) else np


def delay_ms(sums: IndexSums, interpolate: bool) -> jax.Array:
    """(4, T) lags of the largest cross-correlations, positive = late [ms].

    Args:
        interpolate: refine the whole-sample lag by the parabola through its neighbours.
    """
    r = sums.correlation
    xp = library(r)
    best = xp.argmax(r, axis=0)
    lag = (best - sums.lags[0]).astype(float)
    if interpolate:
        inside = xp.clip(best, 1, r.shape[0] - 2)
        left, middle, right = (
            xp.take_along_axis(r, (inside + d)[None], axis=0)[0] for d in (-1, 0, 1)
        )
        bend = left - 2 * middle + right
        offset = xp.where(bend < 0, (left - right) / (2 * xp.where(bend < 0, bend, 1.0)), 0.0)
        lag = lag + xp.where(inside == best, xp.clip(offset, -0.5, 0.5), 0.0)
    return lag / sums.fs * 1e3


def peak_at_edge(sums: IndexSums) -> jax.Array:
    """(T,) whether a correlation peaks at the end of its range, so that the delay is a bound."""
    xp = library(sums.correlation)
    best = xp.argmax(sums.correlation, axis=0)
    return xp.any((best == 0) | (best == sums.correlation.shape[0] - 1), axis=0)


def trials_first(tree):
    """Arrays whose last axis counts the trials, turned so that the first does."""
    return jax.tree.map(lambda x: library(x).moveaxis(x, -1, 0), tree)


def trials_last(tree):
    """The inverse of ``trials_first``."""
    return jax.tree.map(lambda x: library(x).moveaxis(x, 0, -1), tree)


def on_host(tree):
    """Arrays of a finished run as NumPy's; a tree that is still traced as it is."""
    if any(isinstance(x, jax.core.Tracer) for x in jax.tree.leaves(tree)):
        return tree
    return jax.tree.map(np.asarray, tree)


def without_value(sums: IndexSums) -> dict[str, jax.Array]:
    """Index -> (T,) whether it has no value, because its target does not move or it overflows.

    A delay has none where the actuator's target does not move.
    """
    xp = library(sums.error_square)
    still = sums.target_square < np.finfo(float).tiny  # below, squares have lost their digits
    found = {name: still[PAIRS.index(("J2_1", "J3_1")) + (name[-1] == "2")] for name in DELAYS}
    for i, (rms_name, peak_name) in enumerate(PAIRS):
        found[rms_name] = still[i] | ~xp.isfinite(sums.error_square[i])
        found[peak_name] = still[i] | ~xp.isfinite(sums.error_peak[i])
    return {name: found[name] for name in NAMES}


def indices_of(sums: IndexSums, interpolate: bool = False) -> dict[str, jax.Array]:
    """The 24 indices (T,) from the sums of a run, trials on the last axis.

    Differentiable; the delays only with `interpolate`, see ``indices``.
    """
    with np.errstate(all="ignore"):  # a trial that diverged, or a target that never moves
        rms = 100 * library(sums.error_square).sqrt(sums.error_square / sums.target_square)
        peak = 100 * sums.error_peak / sums.target_peak
    found = dict(zip(DELAYS, delay_ms(sums, interpolate), strict=True))
    for (rms_name, peak_name), r, p in zip(PAIRS, rms, peak, strict=True):
        found[rms_name], found[peak_name] = r, p
    return {name: found[name] for name in NAMES}


def final_indices(sums: IndexSums, lost: np.ndarray, interpolate: bool = False):
    """The 24 indices (T,) of a finished run: NaN in trials (T,) that are `lost`, and without value.

    Args:
        sums: on the host, trials on the last axis.
    """
    missing = without_value(sums)
    return {
        name: np.where(lost | missing[name], np.nan, value)
        for name, value in indices_of(sums, interpolate).items()
    }


def indices(result, *, interpolate: bool = False) -> dict[str, np.ndarray]:
    """The 24 indices of every trial.

    Args:
        result: what ``simulate`` returned.
        interpolate: give J1 and J4 between the samples, by the vertex of the parabola through the
            largest cross-correlation and its neighbours.  Without it they are whole samples, as in
            the benchmark, so that their gradient is zero everywhere and says nothing; to tune or
            differentiate a delay, interpolate.

    Returns:
        Mapping from ``J1_1`` ... ``J10_27`` to arrays (trials,): J1, J4 in ms, the others in
        percent.  Trials that diverged have NaN throughout, and an index whose target does not move
        is NaN; ``result.status`` says so.  Under a JAX transformation the values are traced, with
        whatever number or infinity the sums give in such trials.

    Raises:
        InputError: in single precision.
    """
    check_runtime()
    sums = trials_last(on_host(result.sums))
    if isinstance(sums.error_square, jax.core.Tracer):
        return indices_of(sums, interpolate)
    return final_indices(sums, np.asarray(result.lost), interpolate)
