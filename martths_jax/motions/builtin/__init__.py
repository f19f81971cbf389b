"""Ground motions that come with the package, and ensembles made the same way.

They are artificial: random phases, fitted to facts measured on a record (`facts`).  The steps are
`start` (a random accelerogram with the record's energy by frequency and time) and `matching`
(spectrum, peaks and energies at once); `fit` says how near the result is.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from ...errors import argument_error
from ..record import Record
from .facts import Facts, measure, stored_facts, stored_seeds
from .fit import Fit, fit_of
from .store import cached

__all__ = [
    "BUILTIN_NAMES",
    "Facts",
    "Fit",
    "builtin_facts",
    "builtin_record",
    "ensemble",
    "fit_of",
    "generate",
    "measure",
]

#: Built-in motions, by name, and the record whose facts each was made from.
BUILTIN_NAMES = {
    "elcentro-like": "elcentro",
    "kobe-like": "kobe",
    "morganhill-like": "morganhill",
}

#: Decimals of a made motion [m/s^2]: far below any meaning and far above rounding, so that samples
#: and checksum hardly ever differ between machines.
DECIMALS = 6

#: Trials an ensemble may need for one member before it gives up.
ATTEMPTS = 12


def generate(facts: Facts, seed: int | tuple[int, ...]) -> np.ndarray:
    """(n,) accelerogram [m/s^2] with the given facts; the same for the same seed."""
    # Only who makes a motion waits for what that needs.
    from .matching import match
    from .start import random_start

    return np.round(match(random_start(facts, seed), facts), DECIMALS)


def builtin_facts(name: str) -> Facts:
    """Facts behind a built-in motion, by its name or by that of its record."""
    key = BUILTIN_NAMES.get(name, name)
    if key not in stored_facts():
        raise argument_error("name", f"be one of {', '.join(BUILTIN_NAMES)}", repr(name))
    return stored_facts()[key]


@lru_cache(maxsize=8)
def builtin_record(name: str) -> Record:
    """The unscaled built-in motion of that name."""
    facts = builtin_facts(name)
    seed = stored_seeds()[BUILTIN_NAMES[name]]
    samples, notices = cached(name, facts, lambda: generate(facts, seed))
    samples.setflags(write=False)
    return _record(name, samples, facts.dt, notices)


def _record(name: str, samples: np.ndarray, dt: float, notices: tuple[str, ...] = ()) -> Record:
    checksum = hashlib.sha256(np.ascontiguousarray(samples, dtype="<f8").tobytes()).hexdigest()
    return Record(name, samples, dt, source="built-in", sha256=checksum, notices=notices)


def ensemble(
    facts: Facts, count: int, seed: int = 0, prefix: str = "motion"
) -> Iterator[tuple[Record, Fit]]:
    """Different motions with the same facts, one at a time, each with its `Fit`.

    Member i depends on (seed, i) alone.  A member that misses the limits of `fit` is made again
    from other phases; after `ATTEMPTS` trials the best of them is handed out, not accepted.

    Raises:
        InputError: count below 1, or a negative seed.
    """
    if count < 1:
        raise argument_error("count", "be at least 1", count)
    if seed < 0:
        raise argument_error("seed", "be zero or positive", seed)
    width = max(3, len(str(count)))
    for member in range(1, count + 1):
        best: tuple[float, np.ndarray, Fit] | None = None
        for attempt in range(ATTEMPTS):
            samples = generate(facts, (seed, member, attempt))
            fit = fit_of(samples, facts)
            if best is None or fit.spectrum_max < best[0] or fit.accepted:
                best = (fit.spectrum_max, samples, fit)
            if fit.accepted:
                break
        yield _record(f"{prefix}-{member:0{width}d}", best[1], facts.dt), best[2]
