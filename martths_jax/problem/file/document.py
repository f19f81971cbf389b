"""A TOML document that is read key by key, with every fault found at once, each with its line.

Whoever reads a part of a problem takes the tables it knows; ``finish`` refuses whatever nobody
asked for.  All numbers come out in SI: the document says its units at the top.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from martths_jax.errors import InputError, raise_all
from martths_jax.problem.file.lines import key_lines
from martths_jax.problem.file.table import Table, place
from martths_jax.structure.units import KNOWN, Units
from martths_jax.text import nearest


class Document:
    """A TOML file, what was asked of it, and its faults.

    Attributes:
        path: of the file; other files that it names are looked for beside it.
        root: its top table.
        units: what its numbers are in.
        faults: (line, sentence) of all that is wrong so far.
    """

    def __init__(self, text: str, path: Path | str = "problem.toml"):
        """Read a text.

        Raises:
            InputError: if it is no TOML.
        """
        self.path = Path(path)
        self.faults: list[tuple[int, str]] = []
        self._asked: dict[tuple, set[str]] = {}
        try:
            data = tomllib.loads(text)
        except RecursionError:
            raise InputError(f"{self.path} nests its brackets too deeply.") from None
        except ValueError as error:
            raise InputError(f"{self.path} is not valid TOML: {error}.") from None
        self._lines = key_lines(text)
        self.root = Table(self, (), data)
        self.units = _read_units(self.root)

    @property
    def good(self) -> bool:
        """Whether no fault was found so far."""
        return not self.faults

    def line(self, path: tuple) -> int:
        """Line of a key, or of the nearest table around it."""
        while path and path not in self._lines:
            path = path[:-1]
        return self._lines.get(path, 1)

    def fault(self, path: tuple, sentence: str) -> None:
        """Note what is wrong at a key, in one sentence."""
        found = (self.line(path), sentence)
        if found not in self.faults:
            self.faults.append(found)

    @contextmanager
    def blame(self, path: tuple) -> Iterator[None]:
        """Take an ``InputError`` of the block as a fault at a key."""
        try:
            yield
        except InputError as error:
            self.fault(path, str(error))
        except np.linalg.LinAlgError:
            sentence = (
                "Equations of the structure are singular here: something is loose, or has no "
            )
            self.fault(path, f"{sentence}size to speak of; check supports and units.")
        except (ArithmeticError, ValueError):  # SciPy's on numbers that are none
            self.fault(path, "Numbers of the structure are out of range here: check their units.")

    def beside(self, name: str) -> Path:
        """Path of a file that the document names."""
        return self.path.parent / Path(name).expanduser()

    def asked(self, path: tuple, key: str) -> None:
        self._asked.setdefault(path, set()).add(key)

    def finish(self) -> None:
        """Refuse what is wrong, and every key that no reader asked for.

        Raises:
            InputError: one that lists all faults by line.
        """
        self._unknown((), self.root.data)
        sentences = [f"{self.path}, line {n}: {text}" for n, text in sorted(self.faults)]
        raise_all(sentences, f"{self.path} cannot be used")

    def _unknown(self, path: tuple, data) -> None:
        if isinstance(data, list):
            for number, entry in enumerate(data):
                if (*path, number) in self._asked:
                    self._unknown((*path, number), entry)
            return
        if not isinstance(data, dict):
            return
        known = self._asked.get(path, set())
        for key, value in data.items():
            inside = (*path, key)
            if key in known:
                if inside in self._asked or isinstance(value, list):
                    self._unknown(inside, value)
                continue
            several = isinstance(value, list) and value and isinstance(value[0], dict)
            what = "Table" if isinstance(value, dict) or several else "Key"
            where = f" in {place(path)}" if path else ""
            self.fault(inside, f"{what} `{key}`{where} is unknown: {nearest(key, sorted(known))}.")


def _read_units(root: Table) -> Units:
    """Units that the top of a file says; SI where they are wrong, which is then a fault."""
    given = {kind: root.data[kind] for kind in KNOWN if kind in root}
    if "units" in root:
        if root.text("units", ["SI"]) is not None and given:
            kind = next(iter(given))
            root.fault(kind, f'`{kind}` says a unit beside units = "SI": leave one of them out.')
        return Units()
    if not given:
        root.fault(None, 'The units are missing: write units = "SI", or length, force and mass.')
        return Units()
    for kind, known in KNOWN.items():
        if kind not in given:
            root.fault(
                None, f'The unit of {kind} is missing: write {kind} = "{next(iter(known))}".'
            )
    found = {kind: root.text(kind, list(KNOWN[kind])) for kind in given}
    return Units(**{kind: name for kind, name in found.items() if name is not None})


def read_document(path: Path | str) -> Document:
    """Read a TOML file.

    Raises:
        InputError: if it cannot be read or is no TOML.
    """
    path = Path(path)
    try:
        text = path.read_bytes().decode("utf-8")
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}).") from None
    except UnicodeDecodeError:
        raise InputError(f"{path} is no text in UTF-8; save it as such.") from None
    return Document(text.replace("\r\n", "\n"), path)
