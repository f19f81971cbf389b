"""What a running study tells: bars on a terminal, lines elsewhere, or nothing."""

from __future__ import annotations

import time
from dataclasses import dataclass

import jax.monitoring
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
from rich.table import Column

from martths_jax.text import counted

_COMPILE_PREFIX = "/jax/core/compile/"
#: Terminals from this width on have room for bars beside the words.
WIDE = 110
_compile_seconds = 0.0


def _listen(event: str, duration: float, **_) -> None:
    global _compile_seconds
    if event.startswith(_COMPILE_PREFIX):
        _compile_seconds += duration


jax.monitoring.register_event_duration_secs_listener(_listen)


def compile_seconds() -> float:
    """Time JAX spent on tracing and compiling since this package was imported [s]."""
    return _compile_seconds


@dataclass
class Tally:
    """How far one controller and motion is.

    Attributes:
        total, done: trials in all and finished, with those of earlier sessions.
        failed: trials that diverged.
        ran: trials of this session; seconds: their time without compiling; compiling: the rest.
    """

    total: int
    done: int
    failed: int = 0
    ran: int = 0
    seconds: float = 0.0
    compiling: float = 0.0

    @property
    def rate(self) -> float:
        """Trials a second of this session."""
        return self.ran / self.seconds if self.seconds else 0.0


class Reporter:
    """Told about a study as it runs; this one says nothing."""

    def begin(self, cells: dict[tuple[str, str], Tally]) -> None:
        """A session starts with these cells, some of them perhaps already done."""
        self.cells = cells
        self.started = time.monotonic()

    def notice(self, text: str) -> None:
        """A sentence for the user."""

    def working(self, cell: tuple[str, str], compiling: bool) -> None:
        """A chunk of this cell starts; `compiling` if its program is not there yet."""

    def advance(self, cell, trials: int, failed: int, seconds: float, compiling: float) -> None:
        """A chunk of this cell is stored."""
        tally = self.cells[cell]
        tally.done += trials
        tally.ran += trials
        tally.failed += failed
        tally.seconds += seconds - compiling
        tally.compiling += compiling
        self.advanced(cell, tally)

    def advanced(self, cell, tally: Tally) -> None:
        """Show the new state of a cell."""

    def end(self) -> None:
        """The session is over, one way or another."""

    def eta(self, tally: Tally) -> float:
        """Seconds until a cell is done: chunks take turns among the cells, so all cells' time."""
        unfinished = [t for t in self.cells.values() if t.rate]
        pace = sum(1 / t.rate for t in unfinished)
        return (tally.total - tally.done) * pace


class Lines(Reporter):
    """Plain lines: a cell's first chunk, its last, and at most one in `every` seconds between."""

    def __init__(self, console: Console, every: float = 10.0):
        self.console, self.every, self.last = console, every, {}

    def notice(self, text):
        self.console.print(text, highlight=False, soft_wrap=True, markup=False)

    def advanced(self, cell, tally):
        now = time.monotonic()
        if tally.done < tally.total and now - self.last.get(cell, -1e9) < self.every:
            return
        self.last[cell] = now
        self.notice(
            f"{cell[0]} on {cell[1]}: {tally.done} of {counted(tally.total, 'trial')}, "
            f"{tally.rate:.0f} trials/s, {_clock(self.eta(tally))} to go, {tally.failed} failed, "
            f"compiled in {tally.compiling:.1f} s"
        )


class Bars(Reporter):
    """One bar a controller and motion."""

    def __init__(self, console: Console):
        self.console = console
        self.progress = Progress(
            TextColumn("{task.description}", table_column=Column(overflow="fold")),
            *([BarColumn(bar_width=24)] if console.width >= WIDE else []),
            MofNCompleteColumn(),
            TextColumn("{task.fields[state]}", table_column=Column(overflow="fold")),
            console=console,
        )

    def notice(self, text):
        self.console.print(escape(text), highlight=False, soft_wrap=True)

    def begin(self, cells):
        super().begin(cells)
        self.tasks = {
            cell: self.progress.add_task(
                escape(f"{cell[0]} on {cell[1]}"),
                total=tally.total,
                completed=tally.done,
                state="done before" if tally.done == tally.total else "",
            )
            for cell, tally in cells.items()
        }
        self.progress.start()

    def working(self, cell, compiling):
        if compiling:
            self.progress.update(self.tasks[cell], state="[yellow]compiling …")

    def advanced(self, cell, tally):
        failed = f"[red]{tally.failed} failed[/]" if tally.failed else "0 failed"
        state = (
            f"{tally.rate:.0f} trials/s  {_clock(self.eta(tally))} to go  {failed}  "
            f"[dim]compiled in {tally.compiling:.1f} s"
        )
        self.progress.update(self.tasks[cell], completed=tally.done, state=state)

    def end(self):
        self.progress.stop()


def _clock(seconds: float) -> str:
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{seconds:02d}" if hours else f"{minutes}:{seconds:02d}"
