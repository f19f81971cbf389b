"""A study: chunks of trials, each under every motion and controller."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from martths_jax.campaign.assembly import write_results as write_files
from martths_jax.campaign.cells import Batch, Block, Campaign, Cell
from martths_jax.campaign.config import StudyConfig, make_config
from martths_jax.campaign.dataset import assemble
from martths_jax.campaign.distributed import Meeting
from martths_jax.campaign.engine import Engine
from martths_jax.campaign.memory import check_results
from martths_jax.campaign.plan import build_plan
from martths_jax.campaign.progress import Reporter
from martths_jax.campaign.run import run_campaign
from martths_jax.campaign.store import RunFolder
from martths_jax.errors import InputError
from martths_jax.runtime import check_runtime
from martths_jax.study.results import Study
from martths_jax.study.signals import store_signals
from martths_jax.text import counted


def run_study(
    config: StudyConfig | dict | str | Path | None = None,
    *,
    reporter: Reporter | None = None,
    fresh: bool = False,
    share: tuple[int, int] | None = None,
    together: Meeting | None = None,
    allow_mixed: bool = False,
    command_line: str = "run_study(...)",
    **changes,
) -> Study | None:
    """Run a study, or what is missing of it, and write its results.

    Args:
        config: a ``StudyConfig``, settings by name, or the path of a TOML file.
        reporter: is told about progress; nothing is said by default.
        fresh: start over, deleting the run in the folder.
        share: (i, n): run only the i-th of n shares, i from 1; ``merge_runs`` makes the results
            once all shares are there.
        together: the processes that run the shares at the same time (``distributed.join``) and see
            the same folder; the first one writes the results.
        allow_mixed: go on with results of machines that compile in another way, whose last digits
            are others.
        command_line: kept with the results.
        changes: settings that replace those of `config`.

    Returns:
        ``Study``, or None from a process that ran a share and does not write the results.

    Raises:
        InputError: listing every setting that cannot be used, or saying what is in the way of
            the folder's files; what was finished stays.
    """
    check_runtime()
    config = make_config(config, **changes)
    if fresh and share is not None:
        raise InputError(
            "Several processes and --fresh (`fresh=True`) exclude each other, since one would "
            "delete what another has just stored; remove the folder first, or choose another "
            "--out (`out`)."
        )
    plan = build_plan(config)
    if share is None:
        check_results(plan.trials + 1, len(plan.controllers) * len(plan.motions))
    return run_campaign(
        MonteCarlo(plan), reporter=reporter or Reporter(), fresh=fresh, share=share,
        together=together, allow_mixed=allow_mixed, command_line=command_line,
    )  # fmt: skip


class OneCell(Batch):
    """A controller under a motion: a chunk of its trials at a time."""

    def __init__(self, controller: str, motion: str):
        self.cells = ((controller, motion),)

    def blocks(self, engine: Engine, chunk: np.ndarray) -> Iterator[Block]:
        (cell,) = self.cells
        # The engine draws a chunk's noise once for all cells, and runs it block by block.
        yield Block(cell, np.arange(chunk.size), lambda: engine.run(*cell, chunk))


class MonteCarlo(Campaign):
    """Controllers x motions x trials."""

    @property
    def extent(self):
        return f"{counted(self.plan.trials, 'trial')} and the nominal plant"

    def pace(self, engine):
        return f"in chunks of {engine.chunk} trials"

    def batches(self):
        return [OneCell(*cell) for cell in self.keys]

    def warm(self, engine, left, reporter):
        waiting = _waiting(left)
        if waiting.size:
            began = time.monotonic()
            busy = (controller for (controller, _), rows in left.items() if rows.any())
            engine.warm(busy, waiting[: engine.chunk])
            reporter.notice(f"Programs ready after {time.monotonic() - began:.1f} s.")

    def chunks(self, engine, left):
        waiting = _waiting(left)
        for i in range(0, waiting.size, engine.chunk):
            yield waiting[i : i + engine.chunk]

    def finish(self, run, engine, reporter):
        return finish(run, engine, reporter)


def _waiting(left: dict[Cell, np.ndarray]) -> np.ndarray:
    """Trials that some cell lacks."""
    return np.flatnonzero(np.any(list(left.values()), axis=0))


def finish(run: RunFolder, engine: Engine | None, reporter: Reporter) -> Study:
    """Write the result files of a complete run; without an engine, no signals."""
    done = write_results(run)
    if engine is not None and engine.plan.config.signals:
        reporter.notice("Running the chosen trials again for their signals.")
        keep = engine.plan.config.keep
        store_signals(engine, done.dataset, run.path / "signals.nc", keep, run.digest)
    return done


def write_results(run: RunFolder) -> Study:
    """``study.nc``, the tidy CSV, the summary and the effective configuration."""
    dataset = assemble(run, run.draws().plants(np.arange(run.trials + 1)))
    done = Study(dataset, run.path)
    write_files(run, "study", done, done.summary())
    return done
