"""Code of a user's own: a file by its path, or a module that can be imported.

Loading a file runs its code, so that nothing is loaded but what the user named.
"""

from __future__ import annotations

import difflib
import hashlib
import importlib
import importlib.util
import sys
import traceback
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from martths_jax.errors import InputError

#: Folder in a run's that keeps the files that a user's code was loaded from.
FILES = "guests"


def kept(text: str, folder: Path) -> str:
    """A text that may name a copy in a run's folder, naming it from here."""
    return f"{folder / text}" if text.startswith(f"{FILES}/") else text


@dataclass(frozen=True)
class Copy:
    """A file of a user's that a run keeps, so that it can be loaded again later and elsewhere.

    Attributes:
        file: that was loaded.
        sha256: of its content then.
        at: where a run's folder has it, relative to the folder, if that is not by its own digest.
    """

    file: Path
    sha256: str
    at: str = ""

    @property
    def place(self) -> str:
        """Where a run's folder has it, relative to the folder."""
        return self.at or f"{FILES}/{self.file.stem}-{self.sha256[:12]}.py"

    def again(self, text: str) -> str:
        """A text that named something in the file, naming it in the copy."""
        name = "" if is_file(text) else text.rpartition(":")[2]
        return f"{self.place}:{name}" if name else self.place


@dataclass(frozen=True)
class Place:
    """Where a text says that something is.

    Attributes:
        module: that holds it.
        name: of it there; "" for what is alone in its file.
        file: that was loaded; sha256: of its content.  None and "" for what was imported.
    """

    module: ModuleType
    name: str
    file: Path | None = None
    sha256: str = ""

    @property
    def copy(self) -> Copy | None:
        """How a run keeps the file, if it is one."""
        return None if self.file is None else Copy(self.file, self.sha256)


def is_file(text: str) -> bool:
    """Whether a text names a file of Python."""
    return text.endswith(".py")


def is_place(text: str) -> bool:
    """Whether a text reads PLACE:NAME or names a file; not whether there is such a one."""
    place, _, name = text.rpartition(":")
    drive = len(place) == 1 and is_file(name)  # C:\\... is a drive, no module
    return is_file(text) or bool(place and not drive)


def load(text: str, what: str, ways: str) -> Place:
    """What ``package.module:NAME``, ``path/file.py:NAME`` or ``path/file.py`` stands for.

    Args:
        text: see ``is_place``.
        what: it should be, in one word with a capital, such as Controller.
        ways: what can be given instead, to complete "Give ...".

    Raises:
        InputError: the file or module is not there, or its code raises.
    """
    place, _, name = text.rpartition(":")
    if is_file(text):
        place, name = text, ""
    if is_file(place):
        path = Path(place)
        module, digest = _load_file(path, what)
        return Place(module, name, path, digest)
    try:
        return Place(importlib.import_module(place), name)
    except Exception as error:  # code of the user's may raise anything
        raise InputError(
            f"{what} {text!r} cannot be imported: {last_line(error)}.  Give {ways}."
        ) from error


def absent(text: str, what: str, name: str, known: list[str]) -> InputError:
    """The sentence about a name that a place does not hold.

    Args:
        text, what: as of ``load``.
        name: that it gives.
        known: what of the kind is there.
    """
    near = difflib.get_close_matches(name, known, n=1) or known
    hint = f"did you mean {near[0]!r}?" if near else f"it defines no {what.lower()}."
    return InputError(f"{what} {text!r} names {name!r}, which is not there; {hint}")


def _load_file(path: Path, what: str) -> tuple[ModuleType, str]:
    """The module of a file, loaded once for each content, and the SHA-256 of that."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(
            f"{what} file {path} cannot be read ({error.strerror or error})."
        ) from None
    digest = hashlib.sha256(content).hexdigest()
    # The same content has the same name wherever it lies, since code is identified by it.
    name = f"martths_guest_{digest[:12]}"
    known = sys.modules.get(name)
    if known is not None and Path(known.__file__ or "") == path.resolve():
        return known, digest
    spec = importlib.util.spec_from_file_location(name, path.resolve())
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up while they are made
    # What the file imports from its own folder is found, as if it were run.
    sys.path.insert(0, str(path.resolve().parent))
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # code of the user's may raise anything
        del sys.modules[name]
        raise InputError(
            f"{what} file {path} cannot be loaded: {last_line(error)}{_line_of(error, path)}."
        ) from error
    finally:
        sys.path.remove(str(path.resolve().parent))
    return module, digest


def last_line(error: Exception) -> str:
    """An error as the last line of its traceback says it."""
    return traceback.format_exception_only(error)[-1].strip().rstrip(".")


def _line_of(error: Exception, path: Path) -> str:
    """Where in a file an error came from, in words."""
    if isinstance(error, SyntaxError) and error.filename == str(path.resolve()):
        return f" (line {error.lineno})"
    frames = traceback.extract_tb(error.__traceback__)
    lines = [f.lineno for f in frames if f.filename == str(path.resolve())]
    return f" (line {lines[-1]})" if lines else ""
