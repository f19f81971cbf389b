"""The frequency evaluation index of Guo et al.: error of amplitude and of phase, apart.

With the spectra X of the target and Y of the measured stroke at frequencies f_j,

    FEI = sum_j (Y_j / X_j) |X_j|^l / sum_j |X_j|^l,   f_eq = sum_j f_j |X_j|^l / sum_j |X_j|^l

its magnitude A = |FEI| is the amplitude that is reached and -arg(FEI) / (2 pi f_eq) the delay; with
l = 2 the lines that carry the energy have the weight.  Noise has no part of X in it, so that the
index of a long record is nearly that of the true stroke.

The spectra are Fourier sums at fixed frequencies, from ``BAND`` on in steps of ``STEP``, and not
the lines of a transform as long as the record: they can be summed while the run goes, whatever its
length.  Each is the value of the record's continuous spectrum (its DTFT) there, exactly; a rig that
is linear and at rest in the beginning and in the end has Y/X = H(f_j) on any such grid.  Beyond the
band the strokes of the benchmark have less than 0.1 % of their energy.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from martths_jax.indices.base import TINY, Index, Kind, Pair, Row, library
from martths_jax.indices.benchmark import ACTUATORS

#: Frequencies [Hz]: from and to, and their distance.
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
    def frequencies(self) -> np.ndarray:
        """(F,) frequencies of the spectra that are below the Nyquist frequency [Hz]."""
        found = np.arange(BAND[0], BAND[1] + STEP / 2, STEP)
        return found[found < self.fs / 2]

    def init(self, trials):
        blank = jnp.zeros((self.frequencies.size, trials))
        return {
            "real": (blank,) * len(self.rows),
            "imaginary": (blank,) * len(self.rows),
            "samples": jnp.zeros(trials),
        }

    def add_piece(self, state, piece):
        strokes = [piece[row.signal][:, row.row] for row in self.rows]
        # Inside a piece the waves are a constant matrix; from piece to piece they are turned on.
        n, f = strokes[0].shape[0], self.frequencies / self.fs
        angle = 2 * np.pi * ((f[:, None] * np.arange(n)) % 1)
        waves = jnp.asarray(np.concatenate([np.cos(angle), -np.sin(angle)]))
        turned = 2 * np.pi * ((f * state["samples"][0]) % 1)
        cos, sin = jnp.cos(turned)[:, None], jnp.sin(turned)[:, None]
        real, imaginary = [], []
        for stroke, re, im in zip(strokes, state["real"], state["imaginary"], strict=True):
            a, b = jnp.split(waves @ stroke, 2)
            real.append(re + (a * cos + b * sin))
            imaginary.append(im + (b * cos - a * sin))
        return {"real": tuple(real), "imaginary": tuple(imaginary),
                "samples": state["samples"] + n}  # fmt: skip

    def finish(self, state):
        return {name: jnp.stack(state[name], axis=1) for name in ("real", "imaginary")}

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
        f_eq = xp.sum(self.frequencies[:, None, None] * weight, axis=0) / total
        delay = -1e3 * xp.angle(index) / (2 * np.pi * f_eq)
        return {"amplitude": (100 * (xp.abs(index) - 1), missing), "delay": (delay, missing)}


INDICES = tuple(
    Index(
        f"FEI{name}_{place}", unit, FrequencyEvaluation(), Pair.of("x_m", "x_a", row),
        f"{of} error of actuator {place} by the frequency evaluation index",
        "Guo et al. 2014, Smart Materials and Structures 23(4)", of,
    )
    for name, of, unit in (("amp", "amplitude", "%"), ("delay", "delay", "ms"))
    for place, row in ACTUATORS.items()
)  # fmt: skip
