"""Plants of a study by trial number: drawn independently, spread evenly, or read from a CSV file.

Trial 0 is the nominal plant.  Independent draws of trial i depend on (seed, i) alone
(``plant.draw_plants``), so a study can be extended.  Latin hypercube and Sobol' samples fill the
nine-dimensional cube evenly for one given number of trials, so they cannot be.
"""

from __future__ import annotations

import csv
import hashlib
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.special import ndtri

from martths_jax.campaign.files import writing
from martths_jax.errors import InputError, argument_error
from martths_jax.plant import PARAMETERS, SIGMA, Plants, draw_plants
from martths_jax.plant import plant_from_draws as check_draws
from martths_jax.resources import available_memory
from martths_jax.transfer import HZ, NOMINAL_HZ

#: Trials that are drawn together.  Always the same number at the same place, so that the bits of a
#: draw do not depend on how many are asked for.
BLOCK = 128
#: Points of scipy's Sobol' sequence, and memory that making an even draw takes [bytes].
MOST_SOBOL, EVEN_BYTES = 2**30, 4 * 9 * 8


@dataclass(frozen=True)
class Draws:
    """Where the plants come from.

    Attributes:
        trials: number N of uncertain plants, trials 1 ... N.
        seed: seed of the study.
        spread: factor on the standard deviations.
        table: (N, 9) given draws, or None where they are drawn independently.
    """

    trials: int
    seed: int
    spread: float
    table: np.ndarray | None = None

    def plants(self, trial: np.ndarray) -> Plants:
        """The plants of trials (T,), on the host."""
        trial = np.asarray(trial)
        draws = np.zeros((trial.size, len(PARAMETERS)))
        uncertain = trial > 0
        if self.table is not None:
            draws[uncertain] = self.table[trial[uncertain] - 1]
        else:
            for block in np.unique(trial[uncertain] // BLOCK):
                drawn = draw_plants(BLOCK, self.seed, first=int(block) * BLOCK, spread=self.spread)
                mine = uncertain & (trial // BLOCK == block)
                draws[mine] = np.asarray(drawn.draws)[trial[mine] % BLOCK]
        return Plants(draws, trial, float(self.spread))

    @property
    def sha256(self) -> str | None:
        """Checksum of given draws; None where they are independent."""
        return None if self.table is None else hashlib.sha256(self.table.tobytes()).hexdigest()


def make_draws(config) -> Draws:
    """Plants of a ``StudyConfig``.

    Raises:
        InputError: a CSV file that cannot be used.
    """
    table, trials = None, config.trials
    if config.plants:
        table = read_plants(Path(config.plants), config.plants_as, config.spread)
        trials = len(table)
    elif config.draws != "independent":
        table = even_draws(config.draws, config.trials, config.seed)
    if table is not None and table.size:
        check_draws(table, spread=config.spread)
    return Draws(trials, config.seed, config.spread, table)


def even_draws(kind: str, trials: int, seed: int) -> np.ndarray:
    """(trials, 9) standard normal draws from a Latin hypercube or scrambled Sobol' sequence.

    Raises:
        InputError: more trials than there are points, or than fit into memory.
    """
    # Half a second that only even draws have to wait for.
    from scipy.stats import qmc

    most = int(min(available_memory() / EVEN_BYTES, MOST_SOBOL if kind == "sobol" else np.inf))
    if trials > most:
        raise argument_error(
            "trials", f"be at most {most} with {kind} draws, which are made all at once", trials,
            "Use independent draws.",
        )  # fmt: skip
    make = {"lhs": qmc.LatinHypercube, "sobol": qmc.Sobol}[kind]
    with warnings.catch_warnings():
        # Sobol' balance wants a power of two; any number is allowed here and documented.
        warnings.simplefilter("ignore", UserWarning)
        cube = make(len(PARAMETERS), rng=np.random.default_rng(seed)).random(trials)
    return standard_normal(cube)


def standard_normal(unit: np.ndarray) -> np.ndarray:
    """Standard normal draws of points in [0, 1], by the inverse distribution function.

    0 and 1, which would be infinite, count as the points nearest to them.
    """
    return ndtri(np.clip(unit, 2.0**-54, 1 - 2.0**-53))


def read_plants(path: Path, kind: str = "auto", spread: float = 1.0) -> np.ndarray:
    """(T, 9) standard normal draws from a CSV file with nine parameters a row.

    With a header the columns are found by name: ``zero1_col1_draw`` ... for draws (exact) or
    ``zero1_col1_hz`` ... for zeros and poles.  Without one there are nine columns in the order of
    ``plant.PARAMETERS``, and `kind` says what they are; the fifth is the factor on the frame's
    pole pair unless it is a draw.

    Args:
        path: CSV file.
        kind: ``draws``, ``hz``, ``rad/s``, or ``auto`` to go by the header.
        spread: factor on the standard deviations that the draws are counted in.

    Raises:
        InputError: with the line that cannot be used.
    """
    try:
        rows = [r for r in csv.reader(path.read_text("utf-8-sig").splitlines()) if any(r)]
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise InputError(f"Plants {path} cannot be read ({reason}).") from None
    header = None
    if rows and not _is_number(rows[0][0]):
        header = [cell.strip() for cell in rows.pop(0)]
    if not rows:
        raise InputError(f"Plants {path} holds no plant; give one row of nine numbers a plant.")
    columns, kind = _columns(path, header, kind)
    first = 1 + (header is not None)
    values = np.empty((len(rows), len(columns)))
    for i, row in enumerate(rows):
        try:
            values[i] = [float(row[c]) for c in columns]
        except (ValueError, IndexError):
            raise InputError(
                f"Plants {path}, line {i + first}: wanted {len(PARAMETERS)} numbers, "
                f"got {','.join(row)[:80]!r}."
            ) from None
    if kind == "draws":
        return values
    if spread == 0:
        raise InputError("Plants given as zeros and poles need a `spread` above zero.")
    if kind == "rad/s":
        values = values / np.where(NOMINAL_HZ == 1.0, 1.0, HZ)
    return (values / NOMINAL_HZ - 1) / (SIGMA * spread)


def _columns(path: Path, header: list[str] | None, kind: str) -> tuple[list[int], str]:
    if header is None:
        if kind == "auto":
            raise InputError(
                f"Plants {path} has no header that says what its numbers are; give `plants_as` "
                "(--plants-as) hz, rad/s or draws."
            )
        return list(range(len(PARAMETERS))), kind
    endings = {"draws": ["_draw", ""], "hz": ["_hz", ""], "rad/s": [""], "auto": ["_draw", "_hz"]}
    for ending in endings[kind]:
        wanted = [name + ending for name in PARAMETERS]
        if set(wanted) <= set(header):
            found = kind if kind != "auto" else {"_draw": "draws", "_hz": "hz"}[ending]
            return [header.index(name) for name in wanted], found
    raise InputError(
        f"Plants {path} must have the columns {', '.join(p + '_hz' for p in PARAMETERS)} (or "
        f"..._draw), but its header is {', '.join(header)[:200]}."
    )


def write_plants(plants: Plants, path: Path) -> None:
    """Draws and zeros and poles [Hz] of every trial as CSV, digits enough to read them back."""
    names = [p + ending for ending in ("_draw", "_hz") for p in PARAMETERS]
    values = np.hstack([np.asarray(plants.draws), np.asarray(plants.parameters_hz)])
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
