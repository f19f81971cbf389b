"""The study itself: chunks of trials, each under every motion and controller, then stored."""

from __future__ import annotations

import json
import os
import secrets
import socket
import time
from pathlib import Path

import numpy as np
import xarray as xr

from martths_jax.campaign import provenance
from martths_jax.campaign.config import StudyConfig, as_settings, make_config
from martths_jax.campaign.dataset import assemble, save_dataset
from martths_jax.campaign.distributed import Meeting
from martths_jax.campaign.engine import Engine, choose_devices
from martths_jax.campaign.export import write_csv
from martths_jax.campaign.files import disk_errors, set_aside, write_text
from martths_jax.campaign.machine import machine_digest, machine_identity
from martths_jax.campaign.memory import GB, check_results, choose_chunk, lane_bytes
from martths_jax.campaign.owner import door
from martths_jax.campaign.plan import Plan, build_plan
from martths_jax.campaign.progress import Reporter, Tally, compile_seconds
from martths_jax.campaign.store import RunFolder
from martths_jax.campaign.template import write_config
from martths_jax.errors import InputError
from martths_jax.motions import Motion
from martths_jax.runtime import check_runtime
from martths_jax.simulation import LANES
from martths_jax.study.results import Study
from martths_jax.study.signals import store_signals
from martths_jax.study.summary import summarise
from martths_jax.text import counted
from martths_jax.watch import Status


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
    reporter = reporter or Reporter()
    with RunFolder.start(
        Path(config.out), header(plan, command_line), fresh, shared=share is not None,
        allow_mixed=allow_mixed, notice=reporter.notice,
    ) as run:  # fmt: skip
        run.keep_draws(plan.draws)
        run.keep_controllers(plan.chosen.values())
        engine = make_engine(plan, reporter)
        session = Session(run, engine, command_line)
        try:
            run_chunks(run, engine, reporter, session, share_of(plan.trials + 1, share))
        finally:
            reporter.end()
            session.save()
        if together is not None:
            together.finish(reporter)
        if share is not None and not (together is not None and share[0] == 1):
            return None
        return finish(run, engine, reporter, session)


def header(plan: Plan, command_line: str) -> dict:
    """What ``run.json`` says of a run."""
    config = plan.config
    settings = as_settings(config) | {
        "trials": plan.trials,
        "controllers": list(plan.controllers),
        "motions": [m.name for m in plan.motions] if config.motions is None
        else [m.name if isinstance(m, Motion) else m for m in config.motions],
        "controller": plan.tables,
    }  # fmt: skip
    # Where and how it runs is in provenance.json: the results must not depend on it.
    for name in ("out", "devices", "memory_gb", "max_failed", "keep", "signals"):
        settings.pop(name)
    return {
        "trials": plan.trials,
        "identity": provenance.identity(plan),
        "controllers": {name: one.about for name, one in plan.chosen.items()},
        "machines": {machine_digest(): machine_identity()},
        "config": settings,
        "command_line": command_line,
        "commits": [provenance.git_commit()],
        "platform": provenance.machine(),
    }


def make_engine(plan: Plan, reporter: Reporter) -> Engine:
    """Engine on as many devices as memory allows, with its chunk size."""
    devices = choose_devices(plan.config.devices)
    samples = max(m.acceleration.size for m in plan.motions)
    count, chunk = choose_chunk(
        samples, plan.noise.channels, LANES, len(devices), plan.config.memory_gb
    )
    engine = Engine(plan, devices[:count], chunk)
    size = chunk * lane_bytes(samples, plan.noise.channels)
    reporter.notice(
        f"Seed {plan.config.seed}; {counted(plan.trials, 'trial')} and the nominal plant on "
        f"{counted(count, f'{devices[0].platform} device')}, in chunks of {chunk} trials "
        f"(about {size / GB:.2g} GB)."
    )
    for text in plan.notices:
        reporter.notice(text)
    return engine


class Session:
    """When, where and how one session ran, for ``provenance.json``."""

    def __init__(self, run: RunFolder, engine: Engine, command_line: str):
        self.run, self.started = run, time.monotonic()
        self.about = {
            "started": provenance.now(),
            "command_line": command_line,
            "host": socket.gethostname(),
            "devices": [str(d) for d in engine.devices],
            "chunk": engine.chunk,
            "trials": 0,
        }
        self.about["process"] = os.getpid()
        self.about["session"] = secrets.token_hex(4)  # hosts may share process numbers
        self.compiled = compile_seconds()

    def save(self) -> None:
        """Add or update this session in the file."""
        self.about |= {
            "ended": provenance.now(),
            "wall_seconds": round(time.monotonic() - self.started, 3),
            "compile_seconds": round(compile_seconds() - self.compiled, 3),
        }
        if self.run.owner is not None and not self.run.owner.claim.stands():
            return  # the folder is gone, or another run's
        path = self.run.path / "provenance.json"
        with disk_errors(path), door(self.run.path):  # processes of one study end at the same time
            sessions = read_provenance(self.run.path, aside=True)["sessions"]
            mine = self.about["session"]
            sessions = [s for s in sessions if s.get("session") != mine] + [self.about]
            write_text(path, json.dumps({"sessions": sessions}, indent=1))


def read_provenance(folder: Path, aside: bool = False) -> dict:
    """Sessions of a run so far; none if the file is not there or damaged (then it is set `aside`,
    so that what can still be read of it is not overwritten)."""
    file = folder / "provenance.json"
    try:
        found = json.loads(file.read_text("utf-8"))
        sessions = list(found["sessions"])
        if not all(isinstance(s, dict) for s in sessions):
            raise ValueError("no list of sessions")
        return {"sessions": sessions}
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        if aside and file.is_file():
            set_aside(file)
        return {"sessions": []}


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


def run_chunks(run: RunFolder, engine: Engine, reporter, session, mine: np.ndarray) -> None:
    """Run whatever of the trials `mine` is not stored yet, chunk by chunk."""
    mine = np.append(mine, np.zeros(max(0, run.trials + 1 - mine.size), dtype=bool))
    todo = {cell: mine & ~run.done(*cell, reporter.notice) for cell in run.cells}
    reporter.begin({
        cell: Tally(int(mine.sum()), int(mine.sum() - left.sum())) for cell, left in todo.items()
    })  # fmt: skip
    waiting = np.flatnonzero(np.any(list(todo.values()), axis=0))
    if waiting.size:
        began = time.monotonic()
        busy = (c for (c, _), left in todo.items() if left.any())
        engine.warm(busy, waiting[: engine.chunk])
        reporter.notice(f"Programs ready after {time.monotonic() - began:.1f} s.")
    warm = set()
    for i in range(0, waiting.size, engine.chunk):
        chunk = waiting[i : i + engine.chunk]
        for cell, left in todo.items():
            trial = chunk[left[chunk]]
            if not trial.size:
                continue
            began, compiled = time.monotonic(), compile_seconds()
            reporter.working(cell, cell not in warm)
            warm.add(cell)
            if trial.size < chunk.size:  # a session was killed within this chunk
                outcome = engine.run(*cell, chunk)[left[chunk]]
            else:
                outcome = engine.run(*cell, chunk)
            run.write(*cell, trial, outcome)
            session.about["trials"] += int(trial.size)
            failed = int(np.sum(outcome.status >= Status.DIVERGED))
            reporter.advance(
                cell, trial.size, failed, time.monotonic() - began, compile_seconds() - compiled
            )


def finish(
    run: RunFolder, engine: Engine | None, reporter: Reporter, session: Session | None = None
) -> Study:
    """Write the result files of a complete run; without an engine, no signals."""
    dataset = write_results(run)
    if engine is not None and engine.plan.config.signals:
        reporter.notice("Running the chosen trials again for their signals.")
        keep = engine.plan.config.keep
        store_signals(engine, dataset, run.path / "signals.nc", keep, run.digest)
    if session is not None:
        session.save()
    return Study(dataset, run.path)


def write_results(run: RunFolder) -> xr.Dataset:
    """``study.nc``, the tidy CSV, the summary and the effective configuration."""
    dataset = assemble(run, run.draws().plants(np.arange(run.trials + 1)))
    save_dataset(dataset, run.path / "study.nc")
    write_csv(dataset, run.path / "study.csv")
    write_text(run.path / "summary.md", summarise(dataset).markdown())
    write_config(run.header["config"], run.path / "config.toml")
    return dataset
