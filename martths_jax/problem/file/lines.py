"""On which line of a TOML text each key, table and entry of a list stands.

The standard library's reader gives values without places.  This scan reads a text that is known to
be valid TOML once more and keeps the places only.
"""

from __future__ import annotations

import re
import tomllib

_SPACE = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_BLANK = re.compile(r"[ \t]*")
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_STRING = re.compile(
    r'"""(?:[^\\]|\\.)*?"{3,5}|\'\'\'.*?\'{3,5}|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'', re.DOTALL
)
_SCALAR = re.compile(r"[^,\]}#\n]+")


class _Scan:
    """One pass over a text."""

    def __init__(self, text: str):
        self.text, self.at = text, 0
        self.lines: dict[tuple, int] = {}
        self._lists: dict[tuple, int] = {}
        self._counted, self._line = 0, 1

    def line(self) -> int:
        self._line += self.text.count("\n", self._counted, self.at)
        self._counted = self.at
        return self._line

    def found(self, path: tuple) -> None:
        """Keep where a path stands; the tables above it stand there too if nowhere before."""
        for depth in range(1, len(path) + 1):
            self.lines.setdefault(path[:depth], self.line())

    def skip(self, pattern: re.Pattern) -> None:
        self.at = pattern.match(self.text, self.at).end()

    def next_is(self, sign: str) -> bool:
        """Whether the text goes on with a sign, which is then passed."""
        good = self.text.startswith(sign, self.at)
        self.at += len(sign) * good
        return good

    def key(self) -> tuple[str, ...]:
        """A key such as ``a."b c".d`` as its parts."""
        parts = []
        while True:
            self.skip(_BLANK)
            match = _STRING.match(self.text, self.at)
            if match:
                parts.append(tomllib.loads(f"k = {match[0]}")["k"])
            else:
                match = _BARE.match(self.text, self.at)
                parts.append(match[0])
            self.at = match.end()
            self.skip(_BLANK)
            if not self.next_is("."):
                return tuple(parts)

    def header(self) -> tuple:
        """Path of a table's header; ``[[...]]`` adds an entry to its list."""
        several = self.next_is("[[")
        self.at += not several
        path: tuple = ()
        parts = self.key()
        for part in parts[:-1]:
            path += (part,)
            if path in self._lists:
                path += (self._lists[path] - 1,)
        path += parts[-1:]
        if several:
            self.found(path)
            self._lists[path] = self._lists.get(path, 0) + 1
            path += (self._lists[path] - 1,)
        self.found(path)
        self.at += 1 + several
        return path

    def pair(self, table: tuple) -> None:
        self.skip(_BLANK)
        start = self.at
        path = table + self.key()
        end, self.at = self.at, start
        self.found(path)
        self.at = end + 1  # the equals sign
        self.value(path)

    def value(self, path: tuple) -> None:
        self.skip(_BLANK)
        if match := _STRING.match(self.text, self.at):
            self.at = match.end()
        elif self.next_is("["):
            self.entries(path)
        elif self.next_is("{"):
            self.skip(_SPACE)
            while not self.next_is("}"):
                self.pair(path)
                self.skip(_SPACE)
                self.next_is(",")
                self.skip(_SPACE)
        else:
            self.skip(_SCALAR)

    def entries(self, path: tuple) -> None:
        number = 0
        self.skip(_SPACE)
        while not self.next_is("]"):
            self.found((*path, number))
            self.value((*path, number))
            self.skip(_SPACE)
            self.next_is(",")
            self.skip(_SPACE)
            number += 1

    def run(self) -> dict[tuple, int]:
        table: tuple = ()
        self.skip(_SPACE)
        while self.at < len(self.text):
            if self.text[self.at] == "[":
                table = self.header()
            else:
                self.pair(table)
            self.skip(_SPACE)
        return self.lines


def key_lines(text: str) -> dict[tuple, int]:
    """Line, counted from 1, of every path: keys as text, places in lists as numbers from 0.

    Args:
        text: valid TOML.
    """
    return _Scan(text).run()
