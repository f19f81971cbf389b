"""Writing files so that a reader never meets half of one.

What is being written lies in a place of this package's own: under the folder of a run in
``.martths/tmp``, elsewhere beside its file under a name with host, process and a random part.
Leftovers of processes that were killed are deleted in that folder of a run and nowhere else.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import quote

from martths_jax.claims import Claim, holder, unique_name
from martths_jax.errors import InputError

#: Folder, inside that of a run, which nobody else uses.
PRIVATE = ".martths"
#: What marks the folder of a run while none of its processes is there.
MARKS = ("run.json", "state.json")
#: How far above a file its run's folder may be: parts/CONTROLLER/MOTION/file.
_DEPTH = 4
#: Files being written that have no holder yet are left alone so long [s].
_YOUNG = 3600.0


@contextmanager
def atomic(path: Path | str) -> Iterator[Path]:
    """A temporary path, renamed to `path` if the block ends well and deleted if not.

    Raises:
        InputError: if the folder or the file cannot be written.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with scratch(path) as part:
            yield part
            os.replace(part, path)
    except OSError as error:
        raise InputError(
            f"Cannot write {path}: {error.strerror or error}; choose another place or free some "
            "space, nothing that was there has been changed."
        ) from error


@contextmanager
def scratch(path: Path) -> Iterator[Path]:
    """A path with the ending of `path`, on its disk, where a file may lie until it is whole."""
    run = run_folder(path)
    if run is None:
        part = path.with_name(f".{path.stem}.{unique_name()}.part{path.suffix}")
        try:
            yield part
        finally:
            part.unlink(missing_ok=True)
        return
    place = run / PRIVATE / "tmp" / unique_name()
    sweep(run)
    place.mkdir(parents=True)
    claim = Claim(place / "claim")
    try:
        yield place / f"part{path.suffix}"
    finally:
        claim.release()
        shutil.rmtree(place, ignore_errors=True)
        remove_empty(place.parent, place.parent.parent)


def run_folder(path: Path) -> Path | None:
    """The folder of a run that `path` lies in, on the same disk; None if it lies in none."""
    with contextlib.suppress(OSError):
        device = path.parent.stat().st_dev
        for folder in path.absolute().parents[:_DEPTH]:
            marked = (folder / PRIVATE).is_dir() or any((folder / m).is_file() for m in MARKS)
            if marked and folder.stat().st_dev == device:
                return folder
    return None


def sweep(run: Path) -> None:
    """Delete what killed processes were writing in the private folder of a run."""
    place = run / PRIVATE / "tmp"
    with contextlib.suppress(OSError):
        for left in list(place.iterdir()):
            if (left / "claim").exists():
                held = holder(left / "claim") is not None
            else:
                held = time.time() - left.stat().st_mtime < _YOUNG
            if not held:
                shutil.rmtree(left, ignore_errors=True)
        remove_empty(place)


def remove_empty(*folders: Path) -> None:
    """Delete folders that hold nothing, in this order."""
    for folder in folders:
        with contextlib.suppress(OSError):
            folder.rmdir()


def safe_name(name: str) -> str:
    """A name as the name of a file or folder."""
    return quote(name, safe=" ")
