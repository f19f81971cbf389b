"""Files that appear whole or not at all, and disk errors a user can act on."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from martths_jax.errors import InputError
from martths_jax.files import REMEDIES, atomic, refusal


@contextmanager
def disk_errors(path: Path) -> Iterator[None]:
    """Turn an ``OSError`` into an ``InputError`` that names the path and says what to do.

    Raises:
        InputError: whatever the disk refused.
    """
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        refused = refusal(error)
        if refused is None:
            raise
        remedy = REMEDIES.get(refused.errno or 0, "see to it and repeat the command")
        reason = refused.strerror or str(refused)
        raise InputError(f"{path} cannot be written ({reason}); {remedy}.") from error


@contextmanager
def writing(path: Path) -> Iterator[Path]:
    """``files.atomic``, and the file is on the disk before it takes its name.

    Killed at any moment, or out of power, either the old file stands there or the whole new one.
    """
    with atomic(path) as part:
        yield part
        with part.open("rb+") as file:
            os.fsync(file.fileno())


def write_text(path: Path, text: str) -> None:
    """Write a text file whole (see ``writing``)."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file whole (see ``writing``)."""
    with writing(path) as temporary:
        temporary.write_bytes(content)


def set_aside(path: Path) -> Path:
    """Rename a file that is damaged, so that another can take its place; its new path.

    Raises:
        InputError: if the disk refuses.
    """
    taken = {p.name for p in damaged_files(path)}
    numbers = (f"-{i}" if i > 1 else "" for i in range(1, len(taken) + 2))
    name = next(n for i in numbers if (n := f"{path.name}.damaged{i}") not in taken)
    with disk_errors(path):
        os.replace(path, path.with_name(name))
    return path.with_name(name)


def damaged_files(path: Path) -> list[Path]:
    """What ``set_aside`` left of a file."""
    pattern = re.compile(re.escape(path.name) + r"\.damaged(-\d+)?")
    with contextlib.suppress(OSError):
        return [p for p in path.parent.iterdir() if pattern.fullmatch(p.name)]
    return []
