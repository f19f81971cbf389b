"""Where controllers come from: a built-in name, a package, a file, an entry point.

    adfc                        one of ours
    package.module:Class        a class that can be imported
    path/file.py:Class          a class of a file, whose code is run to load it
    path/file.py                the one entry of a file
    NAME                        an entry point NAME of the group ``martths.controllers``

A class may be named or the ``Entry`` that speaks for it; one without an entry gets one from its
fields (``entry.entry_of``).
"""

from __future__ import annotations

import difflib
import hashlib
import importlib
import importlib.metadata
import importlib.util
import sys
import traceback
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from martths_jax.control.base import Controller
from martths_jax.control.controllers import ENTRIES
from martths_jax.control.entry import Entry, entry_of
from martths_jax.errors import InputError

GROUP = "martths.controllers"
#: What can be named, to complete "give ...".
WAYS = "a name, package.module:Class or path/file.py:Class"


@dataclass(frozen=True)
class Guest:
    """An entry, and the file it came from if it came from one.

    Attributes:
        entry: of the controller.
        file: that was loaded; sha256: of its content.  None and "" for what was imported.
    """

    entry: Entry
    file: Path | None = None
    sha256: str = ""


def names() -> list[str]:
    """What can be named without a path: ours, then entry points of other packages."""
    own = [entry.name for entry in ENTRIES]
    return own + sorted(p.name for p in _points() if p.name not in own)


def find(text: str) -> Guest:
    """The controller that a text names (see the module).

    Raises:
        InputError: there is none such; or its file or package cannot be loaded.
    """
    place, _, name = text.rpartition(":")
    if _is_file(text):
        place, name = text, ""
    elif not place or (len(place) == 1 and _is_file(name)):  # C:\... is a drive, no module
        return _named(text)
    if _is_file(place):
        path = Path(place)
        module, digest = _load_file(path)
        return Guest(_entry_in(module, name, text), path, digest)
    try:
        module = importlib.import_module(place)
    except Exception as error:  # code of the user's may raise anything
        raise InputError(
            f"Controller {text!r} cannot be imported: {_last_line(error)}.  Give {WAYS}."
        ) from error
    return Guest(_entry_in(module, name, text))


def find_class(kind: type[Controller]) -> Entry:
    """The entry of a class: that of its own file if it carries one."""
    module = sys.modules.get(kind.__module__)
    return _speaking_for(module, kind) or entry_of(kind)


def _named(text: str) -> Guest:
    for entry in ENTRIES:
        if entry.name == text:
            return Guest(entry)
    for point in _points():
        if point.name == text:
            try:
                given = point.load()
            except Exception as error:  # another package's code may raise anything
                raise InputError(
                    f"Controller {text!r}, an entry point of {point.dist.name}, cannot be loaded: "
                    f"{_last_line(error)}."
                ) from error
            return Guest(_as_entry(given, f"entry point {text!r}"))
    near = difflib.get_close_matches(text, names(), n=3)
    hint = f"the nearest are {', '.join(near)}" if near else f"known are {', '.join(names())}"
    raise InputError(
        f"Controller {text!r} is unknown; {hint}.  One of your own is "
        "package.module:Class or path/file.py:Class."
    )


def _points():
    return importlib.metadata.entry_points(group=GROUP)


def _is_file(text: str) -> bool:
    return text.endswith(".py")


def _load_file(path: Path) -> tuple[ModuleType, str]:
    """The module of a file, loaded once for each content, and the SHA-256 of that."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(
            f"Controller file {path} cannot be read ({error.strerror or error})."
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
            f"Controller file {path} cannot be loaded: {_last_line(error)}{_line_of(error, path)}."
        ) from error
    finally:
        sys.path.remove(str(path.resolve().parent))
    return module, digest


def _entry_in(module: ModuleType, name: str, text: str) -> Entry:
    """The entry that a name in a module stands for; without a name the module's only one."""
    if not name:
        found = {id(x): x for x in vars(module).values() if isinstance(x, Entry)}
        if len(found) == 1:
            return next(iter(found.values()))
        classes = [x for x in vars(module).values() if _is_own_class(x, module)]
        if not found and len(classes) == 1:
            return entry_of(classes[0])
        raise InputError(
            f"File {text} must hold one Entry or one Controller, but holds "
            f"{len(found) or len(classes)}; name one as {text}:Class."
        )
    given = getattr(module, name, None)
    if given is None:
        own = [n for n, x in vars(module).items() if _is_own_class(x, module)]
        near = difflib.get_close_matches(name, own, n=1) or own
        hint = f"did you mean {near[0]!r}?" if near else "it defines no controller."
        raise InputError(f"Controller {text!r} names {name!r}, which is not there; {hint}")
    if isinstance(given, type) and issubclass(given, Controller):
        return _speaking_for(module, given) or entry_of(given)
    return _as_entry(given, repr(text))


def _as_entry(given, what: str) -> Entry:
    if isinstance(given, Entry):
        return given
    if isinstance(given, type) and issubclass(given, Controller):
        return find_class(given)
    raise InputError(
        f"Controller {what} must be a Controller class or an Entry, but is {type(given).__name__}."
    )


def _speaking_for(module: ModuleType | None, kind: type) -> Entry | None:
    """The entry of a module that is of a class.

    Raises:
        InputError: two are.
    """
    values = vars(module).values() if module is not None else ()
    found = {id(x): x for x in values if isinstance(x, Entry) and x.controller is kind}
    if len(found) > 1:
        listed = " and ".join(repr(e.name) for e in found.values())
        raise InputError(
            f"Class {kind.__name__} has two entries, {listed}; name the one that is meant instead."
        )
    return next(iter(found.values()), None)


def _is_own_class(thing, module: ModuleType) -> bool:
    own = isinstance(thing, type) and issubclass(thing, Controller)
    return own and thing.__module__ == module.__name__


def _last_line(error: Exception) -> str:
    return traceback.format_exception_only(error)[-1].strip().rstrip(".")


def _line_of(error: Exception, path: Path) -> str:
    """Where in a file an error came from, in words."""
    if isinstance(error, SyntaxError) and error.filename == str(path.resolve()):
        return f" (line {error.lineno})"
    frames = traceback.extract_tb(error.__traceback__)
    lines = [f.lineno for f in frames if f.filename == str(path.resolve())]
    return f" (line {lines[-1]})" if lines else ""
