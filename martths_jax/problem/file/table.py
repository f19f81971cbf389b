"""A table of a problem file: typed getters that note what is wrong and go on."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from martths_jax.text import nearest, shortened

if TYPE_CHECKING:
    from martths_jax.problem.file.document import Document

#: Stands for a default where there is none: the key must be there.
NEEDED: Any = object()


def place(path: tuple) -> str:
    """A table in words: ``[sections.column]``, ``entry 2 of [members]``, the top of the file."""
    if not path:
        return "the file"
    if isinstance(path[-1], int):
        return f"entry {path[-1] + 1} of {place(path[:-1])}"
    return f"[{'.'.join(map(str, path))}]"


def is_number(value) -> bool:
    """Whether a value is a finite number (no bool)."""
    good = isinstance(value, (int, float)) and not isinstance(value, bool)
    return good and abs(value) <= sys.float_info.max


def as_name(value) -> str | None:
    """A name, which may be written as a whole number; None where it is neither."""
    if isinstance(value, int) and not isinstance(value, bool):
        return str(value)
    return value if isinstance(value, str) and value.strip() else None


class Table:
    """A table of a document.  Getters note faults and give a stand-in for what is wrong.

    Attributes:
        document: that it is part of.
        path: of keys from the top.
        data: as TOML gives it.
    """

    def __init__(self, document: Document, path: tuple, data: dict):
        self.document, self.path, self.data = document, path, data
        document._asked.setdefault(path, set())

    def __contains__(self, key: str) -> bool:
        self.document.asked(self.path, key)
        return key in self.data

    def fault(self, key: str | None, sentence: str) -> None:
        """Note what is wrong at a key, or at the table itself."""
        self.document.fault(self.path if key is None else (*self.path, key), sentence)

    def wrong(self, key: str, wanted: str) -> None:
        """Note that a key must be something else than it is."""
        where = f" in {place(self.path)}" if self.path else ""
        if key in self.data:
            got = shortened(self.data[key])
            self.fault(key, f"`{key}`{where} must {wanted}, but got {got}.")
        else:
            self.fault(None, f"`{key}`{where} is missing; it must {wanted}.")

    def _get(self, key: str, good, wanted: str, default):
        """A value, the default where it is missing, or None where it is wrong."""
        if key not in self:
            if default is NEEDED:
                self.wrong(key, wanted)
                return None
            return default
        if not good(self.data[key]):
            self.wrong(key, wanted)
            return None
        return self.data[key]

    def number(
        self,
        key: str,
        unit: str = "1",
        default: Any = NEEDED,
        *,
        above: float = -math.inf,
        least: float = -math.inf,
    ) -> float:
        """A number in SI; NaN where it is wrong, the default (in SI) where it is missing.

        Args:
            key: its name.
            unit: SI unit, see ``structure.units``; the file's own are read as it says.
            default: in place of a missing one.
            above, least: it must be larger than the first, at least the second.
        """
        bound = "" if above == -math.inf else f" above {above:g}" if above else " above zero"
        if least > -math.inf:
            bound = f" of at least {least:g}" if least else " of at least zero"
        wanted = f"be a {'finite ' if not bound else ''}number{bound}"
        wanted += "" if unit == "1" else f" ({unit})"
        missing = object()
        found = self._get(
            key,
            lambda v: is_number(v) and v > above and v >= least,
            wanted,
            default if default is NEEDED else missing,
        )
        if found is missing:
            return default
        return math.nan if found is None else found * self.document.units.factor(unit)

    def numbers(self, key: str, unit: str = "1", count: int | None = None, default: Any = NEEDED):
        """A list of numbers in SI as a tuple; empty where it is wrong."""
        wanted = f"be a list of {count or 'finite'} numbers"
        wanted += "" if unit == "1" else f" ({unit})"

        def good(value):
            listed = isinstance(value, list) and value and all(map(is_number, value))
            return listed and (count is None or len(value) == count)

        found = self._get(key, good, wanted, default)
        if found is None or found is default:
            return found if found is not None or default is None else ()
        return tuple(v * self.document.units.factor(unit) for v in found)

    def whole(self, key: str, default: Any = NEEDED, *, least: int = 0) -> int | None:
        """A whole number; None where it is wrong."""

        def good(value):
            return isinstance(value, int) and not isinstance(value, bool) and value >= least

        return self._get(key, good, f"be a whole number of at least {least}", default)

    def flag(self, key: str, default: bool = False) -> bool:
        """True or false."""
        return bool(self._get(key, lambda v: isinstance(v, bool), "be true or false", default))

    def text(self, key: str, known: Sequence[str] | None = None, default: Any = NEEDED):
        """A name, one of the known ones where there are some; None where it is wrong."""
        found = self._get(key, lambda v: as_name(v) is not None, "be a name", default)
        if found is None or found is default:
            return found
        return as_name(found) if self.is_known(key, as_name(found), known) else None

    def texts(self, key: str, known: Sequence[str] | None = None, default: Any = NEEDED):
        """A list of names, those that are known; each that is not is a fault of its own.

        Returns:
            A tuple, the default where the list is missing.
        """

        def good(value):
            return isinstance(value, list) and all(as_name(v) is not None for v in value)

        if key not in self and default is not NEEDED:
            return default
        found = self._get(key, good, "be a list of names", default) or ()
        names = list(map(as_name, found))
        for name in sorted({n for n in names if names.count(n) > 1}):
            where = f" in {place(self.path)}" if self.path else ""
            self.fault(key, f"`{key}`{where} names {name!r} twice.")
        return tuple(n for n in dict.fromkeys(names) if self.is_known(key, n, known))

    def is_known(self, key: str, name: str, known: Sequence[str] | None) -> bool:
        """Whether a name is among the known ones; noted as a fault where it is not."""
        if known is None or name in known:
            return True
        where = f" in {place(self.path)}" if self.path else ""
        self.fault(key, f"`{key}`{where} names {name!r}, which is unknown: {nearest(name, known)}.")
        return False

    def one_or_more(self, key: str, unit: str = "1", default: Any = NEEDED, *, least=0.0):
        """A number of at least `least` or a list of such, in SI; None where it is wrong."""

        def good(value):
            values = value if isinstance(value, list) and value else [value]
            return all(is_number(v) and v >= least for v in values)

        wanted = f"be a number of at least {least:g}, or a list of such numbers"
        found = self._get(key, good, wanted, default)
        if found is None or found is default:
            return found
        factor = self.document.units.factor(unit)
        return [v * factor for v in found] if isinstance(found, list) else found * factor

    def keys(self) -> tuple[str, ...]:
        """All keys, where they are names of something."""
        return tuple(key for key in self.data if key in self)

    def table(self, key: str) -> Table | None:
        """The table of a key; None where there is none."""
        found = self._get(key, lambda v: isinstance(v, dict), f"be a table, [{key}]", None)
        return None if found is None else Table(self.document, (*self.path, key), found)

    def entries(self, key: str) -> list[Table]:
        """The tables of a list, [[key]]; none where there is no such list."""

        def good(value):
            return isinstance(value, list) and all(isinstance(entry, dict) for entry in value)

        found = self._get(key, good, f"be a list of tables, [[{key}]]", None) or []
        return [Table(self.document, (*self.path, key, i), v) for i, v in enumerate(found)]

    def named(
        self, key: str, label: str = "name", once: bool = True, needed: bool = True
    ) -> list[tuple[str | None, Table]]:
        """Tables with names: those in the table of a key, or the entries of its list.

        Args:
            key: ``nodes``, say.
            label: key by which the entries of a list say their names; a table's key is its name.
            once: a name may stand but once.
            needed: an entry of a list must have a name; otherwise it may be None.
        """
        wanted = f"hold tables: [{key}] with NAME = {{...}}, or a list of {{{label} = NAME, ...}}"

        def good(value):
            inside = value.values() if isinstance(value, dict) else value
            return isinstance(value, (dict, list)) and all(isinstance(v, dict) for v in inside)

        found = self._get(key, good, wanted, None)
        if found is None:
            return []
        path = (*self.path, key)
        if isinstance(found, dict):
            for name in found:
                self.document.asked(path, name)
            return [(n, Table(self.document, (*path, n), v)) for n, v in found.items()]
        tables = [Table(self.document, (*path, i), v) for i, v in enumerate(found)]
        named = [(table.text(label, default=NEEDED if needed else None), table) for table in tables]
        first: dict[str, Table] = {}
        for name, table in named:
            if name is not None and once and first.setdefault(name, table) is not table:
                before = self.document.line(first[name].path)
                table.fault(label, f"{name!r} stands twice in [{key}], first on line {before}.")
        return [(name, table) for name, table in named if name is not None or not needed]
