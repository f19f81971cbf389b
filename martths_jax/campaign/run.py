"""The run itself, of any campaign: what is missing is run and stored, then results are written."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from martths_jax.campaign.cells import Batch, Campaign
from martths_jax.campaign.distributed import Meeting
from martths_jax.campaign.engine import Engine, Outcome
from martths_jax.campaign.progress import Reporter, compile_seconds
from martths_jax.campaign.session import Session
from martths_jax.campaign.store import RunFolder
from martths_jax.errors import InputError
from martths_jax.watch import Status


def run_campaign(
    campaign: Campaign,
    *,
    reporter: Reporter,
    fresh: bool,
    allow_mixed: bool,
    command_line: str,
    share: tuple[int, int] | None = None,
    together: Meeting | None = None,
):
    """Run a campaign, or what is missing of it, and write its results.

    Args:
        campaign: what to run.
        reporter: is told about progress.
        fresh: start over, deleting the run in the folder.
        allow_mixed: go on with results of machines that compile in another way.
        command_line: kept with the results.
        share: (i, n): run only the i-th of n shares of the rows, i from 1.
        together: the processes that run the shares at the same time; the first one writes the
            results.

    Returns:
        what the campaign makes of its results, or None from a process that ran a share and does
        not write them.

    Raises:
        InputError: saying what is in the way of the folder's files; what was finished stays.
    """
    place = Path(campaign.plan.config.out)
    with campaign.folder.start(
        place, campaign.header(command_line), fresh, shared=share is not None,
        allow_mixed=allow_mixed, notice=reporter.notice,
    ) as run:  # fmt: skip
        run.keep_draws(campaign.plan.draws)
        run.keep_copies(campaign.plan.copies)
        engine = campaign.make_engine(reporter)
        devices = [str(d) for d in engine.devices]
        session = Session(run.path, run.owner, command_line, devices=devices, chunk=engine.chunk)
        try:
            Run(campaign, run, engine, reporter, session).cells(share)
        finally:
            reporter.end()
            session.save()
        if together is not None:
            together.finish(reporter)
        if share is not None and not (together is not None and share[0] == 1):
            return None
        done = campaign.finish(run, engine, reporter)
        session.save()
        return done


class Run:
    """What one session runs.

    Args:
        campaign: what there is to run.
        folder, engine: where results go and what runs.
        reporter: is told about progress.
        session: counts what was run.
    """

    def __init__(
        self,
        campaign: Campaign,
        folder: RunFolder,
        engine: Engine,
        reporter: Reporter,
        session: Session,
    ):
        self.campaign, self.folder, self.engine = campaign, folder, engine
        self.reporter, self.session = reporter, session

    def cells(self, share: tuple[int, int] | None = None) -> None:
        """Run all rows that are not stored yet: chunk by chunk, batch by batch of cells."""
        asked = share_of(self.folder.trials + 1, share)
        batches = self.campaign.batches()
        left = {
            cell: asked & ~self.folder.done(*cell, self.reporter.notice)
            for batch in batches
            for cell in batch.cells
        }
        self.reporter.begin(self.campaign.tallies(asked, left))
        self.campaign.warm(self.engine, left, self.reporter)
        seen: set = set()  # what has been compiled in this session
        for chunk in self.campaign.chunks(self.engine, left):
            for i, batch in enumerate(batches):
                waiting = [left[cell][chunk] for cell in batch.cells]
                if any(map(np.any, waiting)):
                    gathered = Gathered(self.folder, batch, chunk, waiting)
                    self._batch(gathered, i, seen)

    def _batch(self, gathered: Gathered, number: int, seen: set) -> None:
        """Run the blocks of a batch that hold something missing, store cells as they are whole."""
        for block in gathered.batch.blocks(self.engine, gathered.chunk):
            news = gathered.left[gathered.place(block.lanes)]
            if not news.any():
                gathered.add(block.lanes, None)
                continue
            began, compiled = time.monotonic(), compile_seconds()
            self.reporter.working(block.key, compiling=(number, block.key) not in seen)
            seen.add((number, block.key))
            outcome = block.run()
            gathered.add(block.lanes, outcome)
            ran, failed = int(news.sum()), int(np.sum(outcome.status[news] >= Status.DIVERGED))
            self.session.count(ran)
            spent, compiling = time.monotonic() - began, compile_seconds() - compiled
            self.reporter.advance(block.key, ran, failed, spent, compiling)


class Gathered:
    """Outcomes of a batch under a chunk of rows; a cell is stored when its last block is done.

    Args:
        folder: where they go.
        batch: the cells; chunk: (T,) the rows.
        left: for each cell, (T,) rows that are not stored yet.
    """

    def __init__(self, folder: RunFolder, batch: Batch, chunk: np.ndarray, left: list[np.ndarray]):
        self.folder, self.batch, self.chunk = folder, batch, chunk
        self.left = np.stack(left)
        self.passed = np.zeros(len(left), dtype=int)
        self.parts: list[list] = [[] for _ in left]

    def place(self, lanes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(L,) cell and (L,) position in the chunk of lanes."""
        return np.divmod(lanes, self.chunk.size)

    def add(self, lanes: np.ndarray, outcome: Outcome | None) -> None:
        """Take in the outcome of lanes, none where all of them are stored already."""
        cell, position = self.place(lanes)
        for c in np.unique(cell).tolist():
            mine = cell == c
            self.passed[c] += mine.sum()
            if outcome is not None:
                self.parts[c].append((position[mine], outcome[mine]))
            if self.passed[c] == self.chunk.size and self.left[c].any():
                self._store(c)

    def _store(self, c: int) -> None:
        position = np.concatenate([where for where, _ in self.parts[c]])
        outcome = Outcome.join([outcome for _, outcome in self.parts[c]])
        self.parts[c] = []  # free its memory
        order = np.argsort(position)
        order = order[self.left[c][position[order]]]
        self.folder.write(*self.batch.cells[c], self.chunk[position[order]], outcome[order])


def share_of(trials: int, share: tuple[int, int] | None) -> np.ndarray:
    """(trials,) whether a trial belongs to a share (i, n): consecutive numbers, alike in size.

    Raises:
        InputError: unless 1 <= i <= n.
    """
    mine = np.ones(trials, dtype=bool)
    if share is not None:
        i, n = share
        if not 1 <= i <= n:
            raise InputError(f"Argument `share` must be i of n with 1 <= i <= n, but got {i}/{n}.")
        number = np.arange(trials)
        mine = (number >= (i - 1) * trials // n) & (number < i * trials // n)
    return mine
