"""Delay by the largest cross-correlation: argmax over l of sum_k y(k) x(k - l), positive = late."""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.indices.base import TINY, Kind, Row, library

#: Ranges of the cross-correlations (lead, lag) [samples at 1024 Hz], tried in turn until the peak
#: is inside.
RANGES = ((6, 13), (32, 96), (256, 512))
ATTEMPTS = len(RANGES)


def lag_range(attempt: int, fs: float) -> tuple[int, int]:
    """(lead, lag) of an attempt at a sampling rate [samples]."""
    lead, lag = RANGES[attempt]
    return max(2, round(lead * fs / 1024)), max(2, round(lag * fs / 1024))


@dataclass(frozen=True, kw_only=True)
class Delay(Kind):
    """J1, J4 of the benchmark [ms].

    Attributes:
        interpolate: refine the whole-sample lag by the parabola through its neighbours.
        lags: (lead, lag): the correlations cover -lead ... lag samples.
    """

    interpolate: bool = False
    lags: tuple[int, int] = (0, 0)

    @property
    def pieces(self):
        return tuple(dict.fromkeys(row.signal for row in self.rows))

    @property
    def rows(self) -> tuple[Row, ...]:
        """Rows that the pairs are made of, each once, the targets first."""
        targets, values = ([getattr(p, end) for p in self.pairs] for end in ("target", "value"))
        return tuple(dict.fromkeys([*targets, *values]))

    def on(self, pairs, fs, attempt=0):
        return replace(self, pairs=pairs, fs=fs, lags=lag_range(attempt, fs))

    def smooth(self):
        return self.interpolated()

    def interpolated(self):
        return replace(self, interpolate=True)

    def init(self, trials):
        width = sum(self.lags)
        return {
            "tail": (jnp.zeros((width, trials)),) * len(self.rows),
            "correlation": (jnp.zeros((width + 1, trials)),) * len(self.pairs),
            "target_square": (jnp.zeros(trials),) * len(self.pairs),
        }

    def add_piece(self, state, piece):
        return self._correlate(state, [piece[row.signal][:, row.row] for row in self.rows])

    def finish(self, state):
        # The last `lead` samples still wait for targets that come after them: none do.
        nothing = jnp.zeros((self.lags[0], state["tail"][0].shape[-1]))
        state = self._correlate(state, [nothing] * len(self.rows))
        return {
            "correlation": jnp.stack(state["correlation"], axis=1),
            "target_square": jnp.stack(state["target_square"]),
        }

    def _correlate(self, state, strokes):
        """Add what the next (n, T) samples of each row give, and keep what the ones after need."""
        lag = self.lags[1]
        n = strokes[0].shape[0]
        row = {r: jnp.concatenate(x) for r, *x in zip(self.rows, state["tail"], strokes,
                                                      strict=True)}  # fmt: skip
        new = dict(zip(self.rows, strokes, strict=True))
        added = [correlate(row[p.value][lag : lag + n], row[p.target], self.lags)
                 for p in self.pairs]  # fmt: skip
        squares = {p.target: jnp.sum(new[p.target] * new[p.target], axis=0) for p in self.pairs}
        plus = lambda totals, more: tuple(map(jnp.add, totals, more))  # noqa: E731
        return {
            "tail": tuple(x[n:] for x in row.values()),
            "correlation": plus(state["correlation"], added),
            "target_square": plus(state["target_square"], [squares[p.target] for p in self.pairs]),
        }

    def result(self, state):
        r = state["correlation"]
        xp = library(r)
        best = xp.argmax(r, axis=0)
        lag = (best - self.lags[0]).astype(float)
        if self.interpolate:
            inside = xp.clip(best, 1, r.shape[0] - 2)
            left, middle, right = (
                xp.take_along_axis(r, (inside + d)[None], axis=0)[0] for d in (-1, 0, 1)
            )
            bend = left - 2 * middle + right
            offset = xp.where(bend < 0, (left - right) / (2 * xp.where(bend < 0, bend, 1.0)), 0.0)
            lag = lag + xp.where(inside == best, xp.clip(offset, -0.5, 0.5), 0.0)
        return {"": (lag / self.fs * 1e3, state["target_square"] < TINY)}

    def short(self, state):
        """Whether a correlation peaks at the end of its range, so that the delay is a bound."""
        r = state["correlation"]
        xp = library(r)
        best = xp.argmax(r, axis=0)
        return xp.any((best == 0) | (best == r.shape[0] - 1), axis=0)

    def join(self, blocks):
        """Blocks with different ranges come to the widest one; what was not needed is -inf."""
        lead, lag = (max(kind.lags[i] for kind, _ in blocks) for i in (0, 1))
        wide = replace(self, lags=(lead, lag))

        def pad(kind, state):
            edges = [(lead - kind.lags[0], lag - kind.lags[1]), (0, 0), (0, 0)]
            r = np.pad(np.asarray(state["correlation"]), edges, constant_values=-np.inf)
            return state | {"correlation": r}

        return Kind.join(wide, [(wide, pad(*block)) for block in blocks])


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
        return total + sum(y_b[i][None] * x_b[i : i + width] for i in range(block)), None

    total, _ = jax.lax.scan(add, jnp.zeros((width, y.shape[1])), jnp.arange(blocks))
    return total[::-1]
