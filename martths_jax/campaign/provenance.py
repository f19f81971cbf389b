"""Where results come from: versions, commit, machine, and what identifies a run."""

from __future__ import annotations

import datetime
import platform
import shlex
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import jax.numpy as jnp
import numpy as np

import martths_jax
from martths_jax.campaign.config import as_settings
from martths_jax.campaign.fields import RUN_ONLY
from martths_jax.campaign.plan import Plan, motion_identity
from martths_jax.campaign.sources import UNKNOWN, code_of, engine_code
from martths_jax.indices import Index

#: Packages whose version can change the last bits of a result.
PACKAGES = ("jax", "jaxlib", "numpy", "scipy")


def versions() -> dict[str, str]:
    """Versions of this package and of those it computes with."""
    found = {"martths_jax": martths_jax.__version__}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "unknown"
    return found


def git_commit() -> str:
    """Commit this package is a checkout of, with ``-dirty`` if tracked files differ; else ""."""
    here = Path(martths_jax.__file__).parent

    def git(*arguments: str) -> str:
        done = subprocess.run(
            ["git", "-C", str(here), *arguments], capture_output=True, text=True, timeout=30
        )
        return done.stdout.strip() if done.returncode == 0 else ""

    try:
        # An installed copy may lie inside some other project's checkout: that commit says nothing.
        if not git("ls-files", "--error-unmatch", Path(martths_jax.__file__).name):
            return ""
        commit = git("rev-parse", "HEAD")
        changed = git("status", "--porcelain", "--untracked-files=no")
    except (OSError, subprocess.SubprocessError):
        return ""
    return f"{commit}-dirty" if commit and changed else commit


def machine() -> str:
    """Operating system and processor architecture."""
    return f"{platform.platform()} {platform.machine()}, Python {platform.python_version()}"


#: Options that say where and how a study runs, not what it computes: name -> takes a value.
_NOT_IN_COMMAND = {
    "--out": True, "--fresh": False, "--quiet": False, "--devices": True, "--shard": True,
    "--coordinator": True, "--process-id": True, "--num-processes": True, "--distributed": False,
    "--memory": True, "--max-failed": True, "--allow-mixed": False,
    "--join-timeout": True, "--lost-timeout": True,
}  # fmt: skip


def command_line() -> str:
    """The command that computes these numbers: as typed, without where and how it was run."""
    words, skip = ["martths"], False
    for word in sys.argv[1:]:
        name, _, value = word.partition("=")
        if skip:
            skip = False
        elif name in _NOT_IN_COMMAND:
            skip = _NOT_IN_COMMAND[name] and not value
        else:
            words.append(word)
    return shlex.join(words)


def now() -> str:
    """Time of day with its zone, to the second."""
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")


def identity(plan: Plan) -> dict:
    """What decides the numbers of a run, as JSON can hold it.

    Two runs may share a folder if and only if this is the same.  The number of trials is not in
    it, unless the plants depend on it (Latin hypercube, Sobol', CSV).
    """
    settings = as_settings(plan.config)
    loaded = {"records", "motions", "scale", "pga", "sa", "units", "dt", "variable", "resample",
              "trials", "plants", "plants_as", "controller", "controllers", "indices"}  # fmt: skip
    found = {k: v for k, v in settings.items() if k not in loaded | RUN_ONLY}
    if plan.draws.table is not None:
        found |= {"trials": plan.trials, "plants_sha256": plan.draws.sha256}
    found["problem"] = plan.problem.place
    found["controllers"] = list(plan.controllers)
    found["controller"] = plan.controller_settings
    found["indices"] = [index.name for index in plan.indices]
    found["index"] = {index.name: index_identity(index) for index in plan.indices}
    found["counts"] = plan.counts
    found["motions"] = [m.name for m in plan.motions]
    found["motion"] = {m.name: motion_identity(m) for m in plan.motions}
    found["versions"] = versions()
    found["precision"] = str(np.dtype(jnp.zeros(()).dtype))
    found["code"] = engine_code()
    return found


def index_identity(index: Index) -> dict:
    """What identifies an index: its row of the table, and the code of a kind of the user's."""
    found = {
        "unit": index.unit,
        "kind": f"{index.kind}{f': {index.of}' if index.of else ''}",
        "pair": " against ".join(f"{row.signal}[{row.row}]" for row in index.pair),
        "label": index.label,
        "source": index.source,
    }
    own = type(index.kind).__module__.split(".")[0] == martths_jax.__name__
    return found if own else found | {"code": code_of(index.kind)}


def differences(stored: dict, asked: dict, prefix: str = "") -> list[str]:
    """Sentences "key: stored there, asked here" for everything that is not the same."""
    found = []
    for key in [*stored, *(k for k in asked if k not in stored)]:
        there, here = stored.get(key), asked.get(key)
        if isinstance(there, dict) and isinstance(here, dict):
            found += differences(there, here, f"{prefix}{key}.")
        elif there != here and not (_is_nan(there) and _is_nan(here)):
            found.append(f"{prefix}{key}: {_difference(there, here)}")
    return found


def _difference(there, here) -> str:
    """What two values of a key are, short where they are long lists of words."""
    if any(isinstance(x, str) and x.startswith(UNKNOWN) for x in (there, here)):
        return "its source cannot be found, so it may have changed since"
    if isinstance(there, str) and isinstance(here, str) and len(there) + len(here) > 200:
        one, other = there.split(), here.split()
        there = " ".join(w for w in one if w not in other)
        here = " ".join(w for w in other if w not in one)
    return f"{there!r} in the folder, {here!r} asked for"


def _is_nan(value) -> bool:
    return isinstance(value, float) and np.isnan(value)
