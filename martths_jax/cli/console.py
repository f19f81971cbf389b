"""Where the command line writes to, and its progress bar."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

console = Console()
error_console = Console(stderr=True)


@contextmanager
def progress(title: str, total: int) -> Iterator[Callable[[int], None]]:
    """Progress over `total` steps: a bar on a terminal, one line a step elsewhere.

    Yields:
        function that is told how many steps are done.
    """
    if not error_console.is_terminal:

        def tell(done: int) -> None:
            error_console.print(f"{title}: {done} of {total}", highlight=False)

        yield tell
        return
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=error_console,
        transient=True,
    ) as bar:
        task = bar.add_task(title, total=total)
        yield lambda done: bar.update(task, completed=done)
