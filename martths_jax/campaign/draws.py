"""Plants of a study by trial number: drawn independently, spread evenly, or read from a CSV file.

Trial 0 is the nominal plant.  Independent draws of trial i depend on (seed, i) alone
(``Problem.draw``), so a study can be extended.  Latin hypercube and Sobol' samples fill the cube of
the uncertain parameters evenly for one given number of trials, so they cannot be.
"""

from __future__ import annotations

import csv
import hashlib
import warnings
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.special import ndtri

from martths_jax.campaign.files import writing
from martths_jax.errors import InputError, argument_error
from martths_jax.problem import Problem, find_problem
from martths_jax.resources import available_memory

#: Trials that are drawn together.  Always the same number at the same place, so that the bits of a
#: draw do not depend on how many are asked for.
BLOCK = 128
#: Points of scipy's Sobol' sequence, and memory that making an even draw takes a number [bytes].
MOST_SOBOL, EVEN_BYTES = 2**30, 4 * 8


@dataclass(frozen=True)
class Draws:
    """Where the plants come from.

    Attributes:
        trials: number N of uncertain plants, trials 1 ... N.
        seed: seed of the study.
        spread: factor on the standard deviations.
        table: (N, p) given draws, or None where they are drawn independently.
        problem: whose plants they are.
    """

    trials: int
    seed: int
    spread: float
    table: np.ndarray | None = None
    problem: Problem = field(default_factory=find_problem)

    def plants(self, trial: np.ndarray):
        """The plants of trials (T,), on the host."""
        trial = np.asarray(trial)
        draws = np.zeros((trial.size, len(self.problem.parameters)))
        uncertain = trial > 0
        if self.table is not None:
            draws[uncertain] = self.table[trial[uncertain] - 1]
        else:
            for block in np.unique(trial[uncertain] // BLOCK):
                drawn = self.problem.draw(
                    BLOCK, self.seed, first=int(block) * BLOCK, spread=self.spread
                )
                mine = uncertain & (trial // BLOCK == block)
                draws[mine] = np.asarray(drawn.draws)[trial[mine] % BLOCK]
        return self.problem.plants(draws, trial, float(self.spread))

    @property
    def sha256(self) -> str | None:
        """Checksum of given draws; None where they are independent."""
        return None if self.table is None else hashlib.sha256(self.table.tobytes()).hexdigest()


def make_draws(config, problem: Problem | None = None) -> Draws:
    """Plants of a ``StudyConfig``, by default of the maRTHS benchmark.

    Raises:
        InputError: a CSV file that cannot be used.
    """
    problem = problem or find_problem()
    table, trials = None, config.trials
    if config.plants:
        table = read_plants(Path(config.plants), config.plants_as, config.spread, problem)
        trials = len(table)
    elif config.draws != "independent":
        table = even_draws(config.draws, config.trials, config.seed, len(problem.parameters))
    if table is not None and table.size:
        problem.check(problem.plants(table, np.arange(len(table)), config.spread))
    return Draws(trials, config.seed, config.spread, table, problem)


def even_draws(kind: str, trials: int, seed: int, parameters: int) -> np.ndarray:
    """(trials, p) standard normal draws from a Latin hypercube or scrambled Sobol' sequence.

    Raises:
        InputError: more trials than there are points, or than fit into memory.
    """
    # Half a second that only even draws have to wait for.
    from scipy.stats import qmc

    points = MOST_SOBOL if kind == "sobol" else np.inf
    most = int(min(available_memory() / (EVEN_BYTES * parameters), points))
    if trials > most:
        raise argument_error(
            "trials", f"be at most {most} with {kind} draws, which are made all at once", trials,
            "Use independent draws.",
        )  # fmt: skip
    make = {"lhs": qmc.LatinHypercube, "sobol": qmc.Sobol}[kind]
    with warnings.catch_warnings():
        # Sobol' balance wants a power of two; any number is allowed here and documented.
        warnings.simplefilter("ignore", UserWarning)
        cube = make(parameters, rng=np.random.default_rng(seed)).random(trials)
    return standard_normal(cube)


def standard_normal(unit: np.ndarray) -> np.ndarray:
    """Standard normal draws of points in [0, 1], by the inverse distribution function.

    0 and 1, which would be infinite, count as the points nearest to them.
    """
    return ndtri(np.clip(unit, 2.0**-54, 1 - 2.0**-53))


def read_plants(
    path: Path, kind: str = "auto", spread: float = 1.0, problem: Problem | None = None
) -> np.ndarray:
    """(T, p) standard normal draws from a CSV file with the uncertain parameters, a plant a row.

    With a header the columns are found by name: ``zero1_col1_draw`` ... for draws (exact) or
    ``zero1_col1_hz`` ... for zeros and poles.  Without one there are p columns in the order of
    ``Problem.parameters``, and `kind` says what they are.

    Args:
        path: CSV file.
        kind: ``draws``, one of ``Problem.readings``, or ``auto`` to go by the header.
        spread: factor on the standard deviations that the draws are counted in.
        problem: whose plants they are, by default the maRTHS benchmark's.

    Raises:
        InputError: with the line that cannot be used.
    """
    problem = problem or find_problem()
    try:
        rows = [r for r in csv.reader(path.read_text("utf-8-sig").splitlines()) if any(r)]
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise InputError(f"Plants {path} cannot be read ({reason}).") from None
    header = None
    if rows and not _is_number(rows[0][0]):
        header = [cell.strip() for cell in rows.pop(0)]
    if not rows:
        raise InputError(
            f"Plants {path} holds no plant; give one row of {_count(problem)} numbers a plant."
        )
    columns, kind = _columns(path, header, kind, problem)
    first = 1 + (header is not None)
    values = np.empty((len(rows), len(columns)))
    for i, row in enumerate(rows):
        try:
            values[i] = [float(row[c]) for c in columns]
        except (ValueError, IndexError):
            raise InputError(
                f"Plants {path}, line {i + first}: wanted {len(problem.parameters)} numbers, "
                f"got {','.join(row)[:80]!r}."
            ) from None
    if kind == "draws":
        return values
    if spread == 0:
        raise InputError("Plants given by their parameters need a `spread` above zero.")
    return problem.readings[kind].draws(values, spread)


def _count(problem: Problem) -> str:
    """Number of uncertain parameters, in words where they are few."""
    words = "no one two three four five six seven eight nine ten".split()
    n = len(problem.parameters)
    return words[n] if n < len(words) else str(n)


def _columns(
    path: Path, header: list[str] | None, kind: str, problem: Problem
) -> tuple[list[int], str]:
    names, readings = problem.parameters, problem.readings
    known = ["draws", *readings]
    if kind not in ("auto", *known):
        raise argument_error("plants_as", f"be one of auto, {', '.join(known)}", repr(kind))
    if header is None:
        if kind == "auto":
            raise InputError(
                f"Plants {path} has no header that says what its numbers are; give `plants_as` "
                f"(--plants-as) {', '.join(readings)} or draws."
            )
        return list(range(len(names))), kind
    endings = {"draws": "_draw"} | {name: one.ending for name, one in readings.items()}
    tried = [(k, e) for k, e in endings.items() if (e if kind == "auto" else k == kind)]
    if kind != "auto":
        tried.append((kind, ""))
    for found, ending in tried:
        wanted = [name + ending for name in names]
        if set(wanted) <= set(header):
            return [header.index(name) for name in wanted], found
    ending = next(one.ending for one in readings.values())
    raise InputError(
        f"Plants {path} must have the columns {', '.join(p + ending for p in names)} (or "
        f"..._draw), but its header is {', '.join(header)[:200]}."
    )


def write_plants(plants, path: Path, problem: Problem | None = None) -> None:
    """Draws and parameters of every trial as CSV, digits enough to read them back."""
    problem = problem or find_problem()
    own = next(one.ending for one in problem.readings.values())
    names = [p + ending for ending in ("_draw", own) for p in problem.parameters]
    values = np.hstack([np.asarray(plants.draws), np.asarray(plants.values)])
    with writing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(["trial", *names]) + "\n")
        for trial, row in zip(np.asarray(plants.trial), values.tolist(), strict=True):
            file.write(",".join([str(trial), *map(repr, row)]) + "\n")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
