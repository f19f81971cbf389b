"""Writing files so that a reader never meets half of one."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from martths_jax.errors import InputError


@contextmanager
def atomic(path: Path | str) -> Iterator[Path]:
    """A temporary path beside `path`, renamed to it if the block ends well and deleted if not.

    Raises:
        InputError: if the folder or the file cannot be written.
    """
    path = Path(path)
    part = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield part
        os.replace(part, path)
    except OSError as error:
        raise InputError(
            f"Cannot write {path}: {error.strerror or error}; choose another place or free some "
            "space, nothing that was there has been changed."
        ) from error
    finally:
        part.unlink(missing_ok=True)
