"""Keeps built-in motions that were made once in the user's cache folder, and checks them.

A kept file begins with a digest of all that follows and of the recipe: the facts, the name and the
code that makes motions.  Beside the recipe lie facts of the motions as the package's authors made
them (``made.json``): another machine may round other samples up, so these hold with a tolerance.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from martths_jax.errors import InputError
from martths_jax.files import atomic
from martths_jax.runtime import cache_folder

from .. import measures, spectra
from ..measures import arias_intensity, ground_velocity
from .facts import FACTS_FILE, Facts

#: Facts of the built-in motions as made: by name, `made_facts` of each.
MADE_FILE = Path(__file__).with_name("made.json")

#: Relative tolerance on them: far above what rounding moves, far below any other motion.
TOLERANCE = 1e-4

_MAGIC = b"martths motion 1\n"


@cache
def recipe(name: str) -> bytes:
    """Digest of all that decides the samples of a built-in motion: facts, name, code."""
    here = Path(__file__).parent
    files = [FACTS_FILE, *sorted(here.glob("*.py")), measures.__file__, spectra.__file__]
    digest = hashlib.sha256(name.encode())
    for file in files:
        digest.update(hashlib.sha256(Path(file).read_bytes()).digest())
    return digest.digest()


def cached(
    name: str, facts: Facts, make: Callable[[], np.ndarray]
) -> tuple[np.ndarray, tuple[str, ...]]:
    """(n,) result of `make`, kept under `name`, and a notice where what was kept was damaged.

    A folder that cannot be used is passed over.
    """
    folder = cache_folder()
    if folder is None:
        return make(), ()
    path = folder / f"{name}-{recipe(name).hex()[:16]}.motion"
    try:
        content = path.read_bytes()
    except OSError:
        content = None
    kept = None if content is None else _unpacked(name, facts, content)
    if kept is not None:
        return kept, ()
    values = make()
    _keep(path, name, values)
    if content is None:
        return values, ()
    return values, (f"The kept copy of `{name}` ({path}) was damaged; the motion was made again.",)


def made_facts(values: np.ndarray, dt: float) -> dict[str, float]:
    """What `MADE_FILE` holds of a motion: its size, peaks, Arias intensity and two sums."""
    return {
        "samples": values.size,
        "pga": float(np.max(np.abs(values))),
        "pgv": float(np.max(np.abs(ground_velocity(values, dt)))),
        "arias": arias_intensity(values, dt),
        "mean_square_times_time": float(np.mean(np.arange(values.size) * dt * values**2)),
    }


def _packed(name: str, values: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, values, allow_pickle=False)
    body = buffer.getvalue()
    return _MAGIC + hashlib.sha256(recipe(name) + body).digest() + body


def _unpacked(name: str, facts: Facts, content: bytes) -> np.ndarray | None:
    """The samples of a kept file, None where they are not what was kept, or no such motion."""
    start = len(_MAGIC)
    digest, body = content[start : start + 32], content[start + 32 :]
    if content[:start] != _MAGIC or hashlib.sha256(recipe(name) + body).digest() != digest:
        return None
    try:
        values = np.load(io.BytesIO(body), allow_pickle=False)
    except (OSError, ValueError, EOFError):
        return None
    if (
        values.shape != (facts.samples,)
        or values.dtype != float
        or not _is_known(name, facts, values)
    ):
        return None
    return values


def _is_known(name: str, facts: Facts, values: np.ndarray) -> bool:
    """Whether the motion has the facts that the package knows of it."""
    known = json.loads(MADE_FILE.read_text(encoding="utf-8")).get(name, {})
    found = made_facts(values, facts.dt)
    return all(abs(found[key] - value) <= TOLERANCE * abs(value) for key, value in known.items())


def _keep(path: Path, name: str, values: np.ndarray) -> None:
    with contextlib.suppress(InputError), atomic(path) as part:
        part.write_bytes(_packed(name, values))
