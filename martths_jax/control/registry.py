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
import importlib.metadata
import sys
from dataclasses import dataclass
from types import ModuleType

from martths_jax.control.base import Controller
from martths_jax.control.controllers import ENTRIES
from martths_jax.control.entry import Entry, entry_of
from martths_jax.errors import InputError
from martths_jax.guests import Copy, absent, is_place, last_line, load

GROUP = "martths.controllers"
#: What can be named, to complete "give ...".
WAYS = "a name, package.module:Class or path/file.py:Class"


@dataclass(frozen=True)
class Guest:
    """An entry, and the file it came from if it came from one.

    Attributes:
        entry: of the controller.
        copy: how a run keeps the file; None for what was imported.
    """

    entry: Entry
    copy: Copy | None = None


def names() -> list[str]:
    """What can be named without a path: ours, then entry points of other packages."""
    own = [entry.name for entry in ENTRIES]
    return own + sorted(p.name for p in _points() if p.name not in own)


def find(text: str) -> Guest:
    """The controller that a text names (see the module).

    Raises:
        InputError: there is none such; or its file or package cannot be loaded.
    """
    if not is_place(text):
        return _named(text)
    place = load(text, "Controller", WAYS)
    return Guest(_entry_in(place.module, place.name, text), place.copy)


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
                    f"{last_line(error)}."
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
        raise absent(text, "Controller", name, own)
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
