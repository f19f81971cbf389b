"""Writing files so that a reader never meets half of one, and names that are safe in a path.

What is being written lies in a place of this package's own: under the folder of a run in
``.martths/tmp``, elsewhere beside its file under a name with host, process and a random part.
Leftovers of processes that were killed are deleted in that folder of a run and nowhere else.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import io
import os
import re
import shutil
import time
import unicodedata
from collections.abc import Iterator, Sequence
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
#: Longest name of a file or folder that `safe_name` gives, so that an ending has room beside it.
LONGEST_NAME = 200
#: Names that are devices on Windows, whatever ending they have.
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d) *(\.|$)", re.IGNORECASE)
#: What to do about what the system refuses, by its number.
REMEDIES = {
    errno.ENOSPC: "free some space and repeat the command: what is finished is kept",
    errno.EDQUOT: "your quota is full; free some space and repeat the command",
    errno.EFBIG: "the file system or a limit refuses files of this size",
    errno.EMFILE: "this process may open no more files; raise the limit (ulimit -n)",
    errno.ENFILE: "this machine may open no more files; close other programs",
    errno.EACCES: "give a folder you may write to",
    errno.EPERM: "give a folder you may write to",
    errno.EROFS: "give a folder on a disk that can be written to",
    errno.ENOTDIR: "a part of the path is a file; give another folder",
    errno.EEXIST: "a file stands where the folder should be; give another folder",
}
#: The system's words for no more room: disk, quota, size of a file, a disk that fails.
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
#: Kinds of characters that no name may have: controls, halves of characters, ends of lines.
_NO_TEXT = ("Cc", "Cs", "Zl", "Zp")


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
    except Exception as error:
        refused = refusal(error)
        if refused is None:
            raise
        remedy = REMEDIES.get(refused.errno or 0, "choose another place or free some space")
        raise InputError(
            f"Cannot write {path}: {refused.strerror or refused}; {remedy}, nothing that was there "
            "has been changed."
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
    make_folder(place)
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


def make_folder(folder: Path) -> None:
    """Make a private folder if it is missing, while others remove empty ones above it.

    Raises:
        OSError: if it cannot be made.
    """
    for _ in range(100):
        # Gone between two looks at it, one above it or itself: what stays in the way is told below.
        with contextlib.suppress(FileNotFoundError, FileExistsError):
            return folder.mkdir(parents=True, exist_ok=True)
    return folder.mkdir(parents=True, exist_ok=True)


def remove_empty(*folders: Path) -> None:
    """Delete folders that hold nothing, in this order."""
    for folder in folders:
        with contextlib.suppress(OSError):
            folder.rmdir()


def refusal(error: BaseException | None) -> OSError | None:
    """What the system refused, where that is behind an error that a writer raised; else None.

    A library that tidies up after a full disk may fail once more, with an error of another kind
    (``zlib.error`` from matplotlib's PDF): then the system's stands in its context.
    """
    if isinstance(error, OSError):
        return error
    while error is not None:
        if isinstance(error, OSError) and error.errno in _FULL:
            return error
        error = error.__cause__ or error.__context__
    return None


class _Forgiving(io.RawIOBase):
    """A file that keeps what the system refuses, and goes on as if it had been written."""

    def __init__(self, path: Path, mode: str):
        self.file, self.refused = open(path, mode, buffering=0), None

    def _attempt(self, do, *args):
        if self.refused is None:
            try:
                return do(*args)
            except OSError as error:
                self.refused = error
        return None

    def _write_all(self, data) -> None:
        left = memoryview(data).cast("B")
        while left:  # a file near its limit takes a part, and refuses the next
            left = left[self.file.write(left) :]

    def write(self, data) -> int:
        self._attempt(self._write_all, data)
        return memoryview(data).nbytes

    def truncate(self, size: int | None = None) -> int:
        self._attempt(self.file.truncate, size)
        return size or 0

    def seek(self, offset: int, whence: int = 0) -> int:
        return self.file.seek(offset, whence)

    def tell(self) -> int:
        return self.file.tell()

    def readinto(self, buffer) -> int:
        return self.file.readinto(buffer)

    def close(self) -> None:
        self._attempt(self.file.close)
        super().close()


@contextmanager
def forgiving(path: Path, mode: str) -> Iterator[io.RawIOBase]:
    """A file for a library that does not survive a write that fails; what failed is raised after.

    HDF5 is one: where a disk is full as it closes a file, it takes the process down soon after.

    Raises:
        OSError: what the system refused, whatever the library said of the file it then found.
    """
    file = _Forgiving(path, mode)
    try:
        yield file
    finally:
        file.close()
        if file.refused is not None:
            raise file.refused


def safe_name(name: str, space: bool = True) -> str:
    """Name of a file or folder for any text; no two texts share one.

    Letters, digits and ``_.-~`` stay (and spaces with `space`), all else becomes %XX of its UTF-8
    bytes.  So does what some system reads in its own way: a dot at the start (``..``, hidden files)
    or the end, a space at the end, and the names of devices (CON, NUL, ...).  A name beyond
    `LONGEST_NAME` keeps its beginning and gets a checksum.  Upper and lower case stay apart, which
    not every disk does: see `name_problems`.
    """
    found = quote(name, safe=" " if space else "", errors="surrogatepass")
    if not found:
        return "%"
    if len(found) > LONGEST_NAME:
        digest = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:32]
        found = f"{found[: LONGEST_NAME - 34]}%-{digest}"
    if found[-1] in ". ":
        found = f"{found[:-1]}%{ord(found[-1]):02X}"
    if found[0] == "." or _DEVICES.match(found):
        found = f"%{ord(found[0]):02X}{found[1:]}"
    return found


def name_problems(what: str, names: Sequence[str]) -> list[str]:
    """Sentences about names that cannot stand side by side in results, files and tables.

    Args:
        what: ``controller`` or ``motion``.
        names: all of a study.
    """
    problems, seen = [], {}
    for name in dict.fromkeys(names):
        if not isinstance(name, str) or not name.strip():
            problems.append(f"A {what} must have a name, but got {name!r}; give it one.")
        elif any(unicodedata.category(c) in _NO_TEXT for c in name):
            problems.append(
                f"The {what} {name!r} has control characters in its name (ends of lines, tabs or "
                "bytes that are no text); rename it."
            )
        elif seen.setdefault(safe_name(name).lower(), name) != name:
            other = seen[safe_name(name).lower()]
            problems.append(
                f"The {what}s {other!r} and {name!r} differ in capitals only, which are the same "
                "file on many disks; rename one of them."
            )
    return problems
