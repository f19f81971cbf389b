"""The points a Sobol' analysis runs: Saltelli's design on a scrambled Sobol' sequence.

Two independent matrices A and B of N points each, and for every factor i the matrix AB_i: A with
column i taken from B (Saltelli et al. 2010, Comput. Phys. Commun. 181, 259-270).  In all
N (d + 2) runs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from martths_jax.campaign.draws import standard_normal
from martths_jax.campaign.memory import RESULT_BYTES
from martths_jax.problem import Problem, find_problem
from martths_jax.resources import available_memory

#: The factor that picks the noise realisation, and the one that picks the motion.
NOISE, MOTION = "noise", "motion"
#: Noise realisations the uniform factor picks from; trial numbers of a study lie below.
STREAMS = 2**30
FIRST_STREAM = 2**31 - STREAMS
#: Copies of the points that a design and its estimates make.
COPIES = 4


@dataclass(frozen=True)
class Design:
    """The rows of an analysis: base sample after base sample, each A, B, AB_1 ... AB_d.

    Attributes:
        factors: d names: the nine plant parameters, ``noise`` and, if there are several motions,
            ``motion``.
        unit: (N, d + 2, d) points in the unit cube.
        problem: whose plants are varied.
    """

    factors: tuple[str, ...]
    unit: np.ndarray
    problem: Problem

    @property
    def samples(self) -> int:
        """N, the number of base samples."""
        return self.unit.shape[0]

    @property
    def rows(self) -> int:
        """N (d + 2), the number of runs of a controller."""
        return self.unit.shape[0] * self.unit.shape[1]

    def column(self, factor: str) -> np.ndarray:
        """(rows,) points of a factor."""
        return self.unit.reshape(self.rows, -1)[:, self.factors.index(factor)]

    def draws(self) -> np.ndarray:
        """(rows, p) standard normal draws of the plants, by the inverse distribution function."""
        unit = self.unit.reshape(self.rows, -1)[:, : len(self.problem.parameters)]
        return standard_normal(unit)

    def streams(self) -> np.ndarray:
        """(rows,) number of the trial whose noise a row sees."""
        return FIRST_STREAM + np.floor(self.column(NOISE) * STREAMS).astype(np.int64)

    def motions(self, count: int) -> np.ndarray:
        """(rows,) which of so many motions a row sees."""
        if MOTION not in self.factors:
            return np.zeros(self.rows, dtype=np.int64)
        return np.minimum(np.floor(self.column(MOTION) * count), count - 1).astype(np.int64)

    def plants(self, which: np.ndarray, spread: float):
        """Plants of some rows, numbered by row."""
        return self.problem.plants(self.draws()[which], np.asarray(which), float(spread))


def saltelli(samples: int, dimensions: int, seed: int) -> np.ndarray:
    """(N, d + 2, d) points A, B, AB_1 ... AB_d of a scrambled Sobol' sequence.

    Args:
        samples: N, a power of two.
        dimensions: d.
        seed: of the scrambling.
    """
    # Half a second that only those who make a design have to wait for.
    from scipy.stats import qmc

    rng = np.random.default_rng(seed)
    both = qmc.Sobol(2 * dimensions, scramble=True, rng=rng).random_base2(int(math.log2(samples)))
    A, B = both[:, :dimensions], both[:, dimensions:]
    unit = np.repeat(A[:, None], dimensions + 2, axis=1)
    unit[:, 1] = B
    for i in range(dimensions):
        unit[:, 2 + i, i] = B[:, i]
    return unit


def make_design(samples: int, motions: int, seed: int, problem: Problem | None = None) -> Design:
    """Design over the plant's parameters, the noise and, if there are several, the motion."""
    problem = problem or find_problem()
    factors = (*problem.parameters, NOISE, *([MOTION] if motions > 1 else []))
    return Design(factors, saltelli(samples, len(factors), seed), problem)


def most_samples(problem: Problem | None = None) -> int:
    """Largest N for which a problem's design fits into the memory that is free."""
    d = len((problem or find_problem()).parameters) + 2
    room = available_memory() / (8 * d * (d + 2) * COPIES + RESULT_BYTES * (d + 2))
    return 2 ** int(min(30, math.log2(max(room, 2))))


def is_power_of_two(value: int) -> bool:
    """Whether a whole number is 2, 4, 8, ..."""
    return value >= 2 and value & (value - 1) == 0
