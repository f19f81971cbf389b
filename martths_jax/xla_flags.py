"""Whether XLA still knows a flag: one in ``XLA_FLAGS`` that it does not know ends the process."""

from __future__ import annotations

import mmap
import re
from pathlib import Path

import jaxlib

#: Newest jaxlib that was tried with this package's flag; a newer one is searched for it.
TRIED = (0, 12)


def flag_is_known(name: str) -> bool:
    """Whether this jaxlib has a flag.

    The library cannot be asked without ending the process, but a flag's name is a text of its own
    in it, between zeros.  Only a jaxlib newer than ``TRIED`` is searched: it takes 30 ms where the
    flag is there, a second where it is not.
    """
    version = tuple(int(n) for n in re.findall(r"\d+", jaxlib.__version__)[:2])
    if version <= TRIED:
        return True
    endings = (".so", ".dylib", ".pyd", ".dll")
    libraries = [p for p in Path(jaxlib.__file__).parent.rglob("*") if p.suffix in endings]
    largest_first = sorted(libraries, key=lambda path: -path.stat().st_size)
    return any(_holds(path, b"\0" + name.encode() + b"\0") for path in largest_first)


def _holds(path: Path, text: bytes) -> bool:
    try:
        with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            return data.find(text) >= 0
    except (OSError, ValueError):  # not to be read, or empty
        return False
