"""What code decides a number: the source of a controller and of everything of its user's it uses.

A controller's results belong to its code as much as to its gains.  ``code_of`` goes from an object
to its classes, their methods, what these call and refer to, their defaults and closures, and stops
at installed packages, of which it takes the version.  Comments and blank lines do not count.
"""

from __future__ import annotations

import ast
import dataclasses
import functools
import hashlib
import inspect
import io
import linecache
import sys
import sysconfig
import textwrap
import tokenize
import types
import uuid
from enum import Enum
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, packages_distributions, version
from pathlib import Path

import jax
import numpy as np

import martths_jax
from martths_jax.campaign.engine_modules import ENGINE_MODULES

#: What stands for code whose source cannot be found; never the same twice.
UNKNOWN = "source not found"
_PACKAGE = martths_jax.__name__
#: Names of a class that say nothing about what it computes, or are made from what does.
_MADE = {"__dict__", "__weakref__", "__doc__", "__module__", "__annotations__", "__qualname__",
         "__dataclass_fields__", "__dataclass_params__", "__match_args__", "__slots__",
         "__abstractmethods__", "_abc_impl", "__firstlineno__", "__static_attributes__",
         "__annotate__", "__annotate_func__", "__annotations_cache__", "__orig_bases__",
         "__parameters__"}  # fmt: skip


def code_of(thing) -> dict[str, str]:
    """Digests of all the code and constants behind an object, by name.

    Args:
        thing: a controller, or anything else with code of its user's in it.

    Returns:
        names to SHA-256, to versions of packages, or to ``UNKNOWN`` with a number of its own
        where the source of a function cannot be found, or cannot be told from others (a lambda).
    """
    walk = _Walk()
    walk.value(type(thing).__name__, thing)
    return dict(sorted(walk.found.items()))


def without_source(code: dict[str, str]) -> list[str]:
    """Names of the functions in ``code_of``'s answer whose source was not found."""
    return [name for name, text in code.items() if text.startswith(UNKNOWN)]


@lru_cache(maxsize=4)
def engine_code(more: tuple[str, ...] = ()) -> str:
    """SHA-256 of the source of all modules of this package that decide a number.

    Args:
        more: patterns of modules below the package's folder that do so too.
    """
    folder = Path(martths_jax.__file__).parent
    digest = hashlib.sha256()
    for name in ENGINE_MODULES + more:
        for path in sorted(folder.glob(name)):
            digest.update(f"{path.relative_to(folder).as_posix()}\n".encode())
            digest.update(plain_source(path.read_text("utf-8"), quick=True).encode())
    return digest.hexdigest()


def plain_source(text: str, quick: bool = False) -> str:
    """Source without comments, documentation strings, blank lines and trailing blanks.

    Args:
        text: of a module or a function.
        quick: take every line that begins with # for a comment, and leave comments behind code;
            right for source without such lines inside strings, and three times as fast.
    """
    cut = _docstring_lines(ast.parse(text))
    lines = ["" if i in cut else x for i, x in enumerate(text.splitlines(), 1)]
    if quick:
        lines = ["" if x.lstrip().startswith("#") else x for x in lines]
    else:
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type == tokenize.COMMENT:
                row, column = token.start
                lines[row - 1] = lines[row - 1][:column]
    return "\n".join(x.rstrip() for x in lines if x.strip())


def _docstring_lines(tree) -> set[int]:
    """Numbers of the lines that hold nothing but documentation strings."""
    cut: set[int] = set()
    for node in getattr(tree, "body", []):
        if isinstance(node, (ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
            cut |= _docstring_lines(node)
    if isinstance(tree, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
        first = tree.body[0] if tree.body else None
        if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
            cut |= set(range(first.lineno, first.end_lineno + 1))
    return cut


def _text_of(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


@lru_cache(maxsize=4096)
def _distribution(top: str) -> str | None:
    """Distribution and version behind a top-level package; None for code that is not installed."""
    if top in sys.stdlib_module_names or top == "builtins":
        return "python"
    if top == _PACKAGE:
        return f"{_PACKAGE} {martths_jax.__version__}"
    module = sys.modules.get(top)
    places = {Path(sysconfig.get_path(k)).resolve() for k in ("purelib", "platlib")}
    file = getattr(module, "__file__", None) or next(iter(getattr(module, "__path__", [])), None)
    if file is None or not any(p in Path(file).resolve().parents for p in places):
        return None
    names = _distributions().get(top, [])
    try:
        return f"{names[0]} {version(names[0])}" if names else top
    except PackageNotFoundError:
        return top


@lru_cache(maxsize=1)
def _distributions():
    return packages_distributions()


class _Walk:
    """Goes through what an object refers to, each thing once."""

    def __init__(self):
        self.found: dict[str, str] = {}
        self._seen: dict[int, object] = {}

    def _new(self, thing) -> bool:
        """Whether a thing is met for the first time; keeps it, so that its identity stays its."""
        new = id(thing) not in self._seen
        self._seen[id(thing)] = thing
        return new

    def _put(self, name: str, text: str) -> None:
        while self.found.get(name, text) != text:
            name += "'"
        self.found[name] = text

    def value(self, name: str, value) -> None:
        """Any value: what it holds and, where it has some, its code."""
        if value is None or isinstance(value, (bool, int, float, complex, str, bytes)):
            self._put(name, repr(value))
        elif isinstance(value, (np.ndarray, np.generic, jax.Array)):
            array = np.asarray(value)
            self._put(name, _text_of(f"{array.dtype}{array.shape}{array.tobytes().hex()}"))
        elif isinstance(value, Enum):
            self._put(name, str(value))
        elif isinstance(value, type):
            self.a_class(value)
        elif isinstance(value, types.ModuleType):
            self._installed(value.__name__)
        elif isinstance(value, functools.partial):
            self.value(f"{name}.func", value.func)
            self.value(f"{name}.args", (value.args, value.keywords))
        elif isinstance(value, types.MethodType):
            self.value(name, value.__func__)
            self.value(f"{name}.__self__", value.__self__)
        elif callable(getattr(value, "__wrapped__", None)):
            self.value(name, value.__wrapped__)  # jit and its kind: what is inside decides
        elif isinstance(value, types.FunctionType):
            self.function(value)
        elif isinstance(value, (types.BuiltinFunctionType, np.ufunc)):
            self._put(f"{getattr(value, '__module__', '')}.{value.__name__}", "built in")
        elif self._new(value):
            self._members(name, value)

    def _members(self, name: str, value) -> None:
        """What a container or an object of any class holds."""
        if isinstance(value, dict):
            self._put(f"{name}.keys", repr(list(map(str, value))))
            for key, item in value.items():
                self.value(f"{name}[{key!r}]", item)
        elif isinstance(value, (list, tuple)):
            self._put(f"{name}.len", str(len(value)))
            for i, item in enumerate(value):
                self.value(f"{name}[{i}]", item)
        elif isinstance(value, (set, frozenset)):
            self._put(name, repr(sorted(map(repr, value))))
        else:
            self.a_class(type(value))
            if dataclasses.is_dataclass(value):
                held = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
            else:
                held = getattr(value, "__dict__", None)
            if held is None and not self._installed(type(value).__module__):
                self._put(name, f"{UNKNOWN} ({uuid.uuid4().hex[:12]})")
            for key, item in (held or {}).items():
                self.value(f"{name}.{key}", item)

    def a_class(self, given: type) -> None:
        """A class: what it and its bases define."""
        for cls in given.__mro__:
            if self._installed(cls.__module__) or not self._new(cls):
                continue
            self._put(f"{cls.__module__}.{cls.__qualname__}", _header(cls))
            for name, item in vars(cls).items():
                if name in _MADE or _is_made(item):
                    continue
                for part in _parts(item):
                    self.value(f"{cls.__qualname__}.{name}", part)
            for field in getattr(cls, "__dataclass_fields__", {}).values():
                for what in ("default", "default_factory"):
                    item = getattr(field, what)
                    if item is not dataclasses.MISSING:
                        self.value(f"{cls.__qualname__}.{field.name}", item)

    def function(self, function) -> None:
        """A function: its source, defaults, closure, and what it refers to by name."""
        if self._installed(function.__module__) or not self._new(function):
            return
        name = f"{function.__module__}.{function.__qualname__}"
        source = _source(function)
        self._put(name, source or f"{UNKNOWN} ({uuid.uuid4().hex[:12]})")
        for i, item in enumerate(function.__defaults__ or ()):
            self.value(f"{name} default {i}", item)
        for key, item in (function.__kwdefaults__ or {}).items():
            self.value(f"{name} default {key}", item)
        free, cells = function.__code__.co_freevars, function.__closure__ or ()
        for key, cell in zip(free, cells, strict=True):
            try:
                inside = cell.cell_contents
            except ValueError:  # not filled yet
                continue
            if key != "__class__":
                self.value(f"{name} closure {key}", inside)
        for key in _names(function.__code__):
            if key in function.__globals__:
                self._referred(name, key, function.__globals__[key], function.__code__)

    def _referred(self, name: str, key: str, value, code) -> None:
        """Something that a function refers to by name; of the user's modules what it uses."""
        if isinstance(value, types.ModuleType) and not self._installed(value.__name__):
            for attribute in _names(code):
                if attribute in vars(value):
                    self._referred(value.__name__, attribute, vars(value)[attribute], code)
        elif not isinstance(value, types.ModuleType):
            self.value(f"{name} uses {key}", value)

    def _installed(self, module: str | None) -> bool:
        """Whether a module is of an installed package, whose version is noted then."""
        top = (module or "builtins").partition(".")[0]
        what = _distribution(top)
        if what is not None and what != "python" and top != _PACKAGE:
            self.found[f"package {top}"] = what
        return what is not None


def _header(cls: type) -> str:
    return " ".join(f"{base.__module__}.{base.__qualname__}" for base in cls.__bases__)


def _is_made(item) -> bool:
    """Whether an attribute was generated, as by ``dataclass``: its class decides it."""
    code = getattr(inspect.unwrap(item) if callable(item) else item, "__code__", None)
    return code is not None and code.co_filename == "<string>" and item.__name__.startswith("__")


def _parts(item) -> list:
    """The functions inside a property or another descriptor; else the item itself."""
    if isinstance(item, property):
        return [f for f in (item.fget, item.fset) if f is not None]
    if isinstance(item, (staticmethod, classmethod)):
        return [item.__func__]
    if isinstance(item, functools.cached_property):
        return [item.func]
    if isinstance(item, (types.MemberDescriptorType, types.GetSetDescriptorType)):
        return []
    return [item]


def _source(function) -> str | None:
    """SHA-256 of a function's source, None where it cannot be found or told from others."""
    if function.__name__ == "<lambda>" or not _runs_as_written(function.__code__):
        return None
    try:
        text = textwrap.dedent(inspect.getsource(function))
        return _text_of(plain_source(text))
    except (OSError, TypeError, SyntaxError, tokenize.TokenError, IndexError):
        return None


def _runs_as_written(code) -> bool:
    """Whether what runs is what its file says now: it may have been edited since the import."""
    linecache.checkcache(code.co_filename)
    text = "".join(linecache.getlines(code.co_filename))
    return _essence(code) in _written(code.co_filename, text)


@lru_cache(maxsize=64)
def _written(file: str, text: str) -> frozenset:
    """The essence of every function in a source."""
    try:
        todo, found = [compile(text, file, "exec", dont_inherit=True)], set()
    except (SyntaxError, ValueError):
        return frozenset()
    while todo:
        code = todo.pop()
        found.add(_essence(code))
        todo += [c for c in code.co_consts if isinstance(c, types.CodeType)]
    return frozenset(found)


def _essence(code) -> tuple:
    constants = [c.co_name if isinstance(c, types.CodeType) else repr(c) for c in code.co_consts]
    return code.co_name, code.co_firstlineno, code.co_code, code.co_names, tuple(constants)


def _names(code) -> list[str]:
    """Names that a function and the functions inside it refer to."""
    found = dict.fromkeys(code.co_names)
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            found |= dict.fromkeys(_names(constant))
    return list(found)
