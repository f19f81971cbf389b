"""Keeps built-in motions that were made once in the user's cache folder."""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from .facts import FACTS_FILE

#: Raise it with every change of the method, so that motions of older versions are not taken.
RECIPE = 1


def cache_folder() -> Path:
    """Folder for made motions: ``$MARTHS_CACHE``, else the platform's place for caches."""
    if given := os.environ.get("MARTHS_CACHE"):
        return Path(given).expanduser()
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "martths_jax"


def cached(name: str, samples: int, make: Callable[[], np.ndarray]) -> np.ndarray:
    """(n,) result of `make`, kept under `name`; a folder that cannot be used is passed over."""
    recipe = hashlib.sha256(FACTS_FILE.read_bytes() + f"{name} {RECIPE}".encode()).hexdigest()
    if os.environ.get("MARTHS_CACHE", "on").lower() in ("", "0", "off", "no"):
        return make()
    try:
        path = cache_folder() / f"{name}-{recipe[:16]}.npy"
    except RuntimeError:  # no home folder
        return make()
    try:
        values = np.load(path, allow_pickle=False)
        if values.shape == (samples,) and values.dtype == float and np.all(np.isfinite(values)):
            return values
    except (OSError, ValueError, EOFError):
        pass
    values = make()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False) as file:
            np.save(file, values)
        os.replace(file.name, path)
    except OSError:
        pass
    return values
