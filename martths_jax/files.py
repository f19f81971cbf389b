"""Writing files so that a reader never meets half of one, and names that are safe in a path."""

from __future__ import annotations

import hashlib
import os
import re
import unicodedata
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import quote

from martths_jax.errors import InputError

#: Longest name of a file or folder that `safe_name` gives, so that an ending has room beside it.
LONGEST_NAME = 200
#: Names that are devices on Windows, whatever ending they have.
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d) *(\.|$)", re.IGNORECASE)
#: Kinds of characters that no name may have: controls, halves of characters, ends of lines.
_NO_TEXT = ("Cc", "Cs", "Zl", "Zp")
_ERRNO = re.compile(r"errno = (\d+)")


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
    except (OSError, RuntimeError) as error:
        refused = system_error(error)
        if refused is None:
            raise
        raise InputError(
            f"Cannot write {path}: {refused.strerror or refused}; choose another place or free "
            "some space, nothing that was there has been changed."
        ) from error
    finally:
        part.unlink(missing_ok=True)


def system_error(error: BaseException) -> OSError | None:
    """What the system refused, of an error that a writer raised; None for any other error.

    HDF5 raises ``RuntimeError`` where a full disk shows only as a file is closed, and keeps the
    system's number in its text.
    """
    if isinstance(error, OSError) and error.errno is not None and error.strerror:
        found = _ERRNO.search(error.strerror)
        return OSError(int(found[1]), os.strerror(int(found[1]))) if found else error
    if isinstance(error, (OSError, RuntimeError)) and (found := _ERRNO.search(str(error))):
        return OSError(int(found[1]), os.strerror(int(found[1])))
    return error if isinstance(error, OSError) else None


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
