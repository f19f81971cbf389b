"""Where the command line writes to, in whatever signs it can show, and its progress bar."""

from __future__ import annotations

import codecs
import sys
import unicodedata
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

console = Console()
error_console = Console(stderr=True)

#: Signs for those that a console's encoding lacks, as wide as these where tables hold them.
PLAIN = {"–": "-", "—": "-", "−": "-", "…": "...", "×": "x", "·": ".", "±": "+-", "°": "deg",
         "’": "'", "‘": "'", "“": '"', "”": '"', "µ": "u", "ß": "ss", "ø": "o",
         "λ": "l", "√": "sqrt"}  # fmt: skip


def _plain(error: UnicodeError) -> tuple[str, int]:
    """What an encoder writes for signs that it lacks: a like sign, the bare letter, or ``?``."""
    found = []
    for sign in error.object[error.start : error.end]:
        bare = unicodedata.normalize("NFKD", sign).encode("ascii", "ignore").decode()
        found.append(PLAIN.get(sign) or bare or "?")
    return "".join(found), error.end


codecs.register_error("martths_plain", _plain)


def accept_any_text() -> None:
    """Let standard output and errors take any text, whatever their encoding can show."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="martths_plain")


@contextmanager
def progress(title: str, total: int) -> Iterator[Callable[[int], None]]:
    """Progress over `total` steps: a bar on a terminal, one line a step elsewhere.

    Yields:
        function that is told how many steps are done.
    """
    if not error_console.is_terminal:

        def tell(done: int) -> None:
            error_console.print(
                f"{title}: {done} of {total}", highlight=False, soft_wrap=True, markup=False
            )

        yield tell
        return
    with Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=error_console,
        transient=True,
    ) as bar:
        task = bar.add_task(title, total=total)
        yield lambda done: bar.update(task, completed=done)
