"""The frequency evaluation index of Guo et al.: error of amplitude and of phase, apart.

With the spectra X of the target and Y of the measured stroke at frequencies f_j,

    FEI = sum_j (Y_j / X_j) |X_j|^l / sum_j |X_j|^l,   f_eq = sum_j f_j |X_j|^l / sum_j |X_j|^l

its magnitude A = |FEI| is the amplitude that is reached and -arg(FEI) / (2 pi f_eq) the delay; with
l = 2 the lines that carry the energy have the weight.  Noise has no part of X in it, so that the
index of a long record is nearly that of the true stroke.

The spectra are Fourier sums at fixed frequencies, ``STEP`` apart, and not the lines of a transform
as long as the record: they can be summed while the run goes, whatever its length.  Each is the
value of the record's continuous spectrum (its DTFT) there, exactly, since a transform of P samples
of the record folded to that length, x(k) + x(k + P) + ..., has the record's spectrum at the P
frequencies j fs/P: all that a sample costs is one addition.  A rig that is linear and at rest in
the beginning and in the end has Y/X = H(f_j) on any such grid.  Outside of ``BAND`` the strokes
of the benchmark have less than 0.1 % of their energy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.indices.base import TINY, Index, Kind, Pair, Row, library, plain
from martths_jax.indices.benchmark import ACTUATORS

#: Frequencies [Hz]: from and to, and about how far apart.
BAND, STEP = (0.25, 20.0), 0.125


@dataclass(frozen=True, kw_only=True)
class FrequencyEvaluation(Kind):
    """``amplitude``: 100 (A - 1) [%], positive = too large; ``delay`` [ms], positive = late.

    Attributes:
        power: the weight's exponent l.
    """

    power: int = 2
    quantities = ("amplitude", "delay")

    @property
    def pieces(self):
        return tuple(dict.fromkeys(row.signal for row in self.rows))

    @property
    def rows(self) -> tuple[Row, ...]:
        """Rows that the pairs are made of, each once."""
        return tuple(dict.fromkeys(r for p in self.pairs for r in (p.target, p.value)))

    @property
    def period(self) -> int:
        """Samples P that the record is folded to."""
        return round(self.fs / STEP)

    @property
    def lines(self) -> np.ndarray:
        """(F,) numbers j of the frequencies j fs/P in the band."""
        j = np.arange(1, self.period // 2)
        f = j * self.fs / self.period
        return j[(f > BAND[0] - STEP / 2) & (f < BAND[1] + STEP / 2)]

    def init(self, trials):
        # Twice as long as the period, so that what is added at a place never has to be parted.
        return {
            "folded": (jnp.zeros((2 * self.period, trials)),) * len(self.rows),
            "samples": jnp.zeros(trials, int),
        }

    def add_piece(self, state, piece):
        n, place = len(piece[self.rows[0].signal]), state["samples"][0] % self.period
        folded = []
        for row, so_far in zip(self.rows, state["folded"], strict=True):
            new = self._fold(piece[row.signal][:, row.row])
            before = jax.lax.dynamic_slice_in_dim(so_far, place, len(new))
            folded.append(jax.lax.dynamic_update_slice_in_dim(so_far, before + new, place, axis=0))
        return {"folded": tuple(folded), "samples": state["samples"] + n}

    def _fold(self, x):
        """(n, T) samples, folded to one period if they are more."""
        if len(x) <= self.period:
            return x
        x = jnp.pad(x, [(0, -len(x) % self.period), (0, 0)])
        return x.reshape(-1, self.period, x.shape[-1]).sum(axis=0)

    def finish(self, state):
        spectra = jnp.stack(
            [jnp.fft.rfft(self._fold(x), axis=0)[self.lines] for x in state["folded"]], axis=1
        )
        return {"real": spectra.real, "imaginary": spectra.imag}

    @jax.numpy_dtype_promotion("standard")  # spectra and real weights
    def result(self, state):
        spectra = state["real"] + 1j * state["imaginary"]  # (F, rows, T)
        xp = library(spectra)
        X, Y = (
            spectra[:, np.array([self.rows.index(getattr(p, end)) for p in self.pairs])]
            for end in ("target", "value")
        )
        weight = xp.abs(X) ** self.power
        total = xp.sum(weight, axis=0)
        missing = (total < TINY) | ~xp.isfinite(total) | ~xp.isfinite(xp.sum(xp.abs(Y), axis=0))
        safe = xp.where(X == 0, 1.0, X)
        index = xp.sum(xp.where(X == 0, 0.0, Y / safe) * weight, axis=0) / total
        frequencies = self.lines * self.fs / self.period
        f_eq = xp.sum(frequencies[:, None, None] * weight, axis=0) / total
        delay = -1e3 * xp.angle(index) / (2 * np.pi * f_eq)
        return {"amplitude": (100 * (xp.abs(index) - 1), missing), "delay": (delay, missing)}


def indices_for(actuators: Sequence[str]) -> tuple[Index, ...]:
    """Those of actuators with these names."""
    return tuple(
        Index(
            f"FEI{name}_{plain(place)}", unit, FrequencyEvaluation(), Pair.of("x_m", "x_a", row),
            f"{of} error of actuator {place} by the frequency evaluation index",
            "Guo et al. 2014, Smart Materials and Structures 23(4)", of,
        )
        for name, of, unit in (("amp", "amplitude", "%"), ("delay", "delay", "ms"))
        for row, place in enumerate(actuators)
    )  # fmt: skip


INDICES = indices_for(ACTUATORS)
