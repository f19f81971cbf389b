"""One session of a campaign: what ``run.json`` says of the run, and what ``provenance.json`` of
when, where and how it was computed."""

from __future__ import annotations

import json
import os
import secrets
import socket
import time
from pathlib import Path

from martths_jax.campaign import provenance
from martths_jax.campaign.config import as_settings
from martths_jax.campaign.files import disk_errors, set_aside, write_text
from martths_jax.campaign.machine import machine_digest, machine_identity
from martths_jax.campaign.owner import Owner, door
from martths_jax.campaign.plan import Plan
from martths_jax.campaign.progress import compile_seconds
from martths_jax.motions import Motion

#: Where and how a run goes is in provenance.json: the results must not depend on it.
_NOT_IN_HEADER = ("out", "devices", "memory_gb", "max_failed", "keep", "signals")


def header(plan: Plan, command_line: str) -> dict:
    """What ``run.json`` says of a run."""
    config = plan.config
    settings = as_settings(config) | {
        "trials": plan.trials,
        "controllers": list(plan.controllers),
        "motions": [m.name for m in plan.motions] if config.motions is None
        else [m.name if isinstance(m, Motion) else m for m in config.motions],
        "controller": plan.tables,
        "indices": plan.index_names,
        "problem": plan.problem.place,
    }  # fmt: skip
    for name in _NOT_IN_HEADER:
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


class Session:
    """When, where and how one session ran, for ``provenance.json``.

    Args:
        folder: of the run; owner: this process's right to write there, if it needs one.
        command_line: that began it.
        about: what else is worth knowing, as JSON can hold it.
    """

    def __init__(self, folder: Path, owner: Owner | None, command_line: str, **about):
        self.folder, self.owner, self.began = folder, owner, time.monotonic()
        self.about = {
            "started": provenance.now(),
            "command_line": command_line,
            "host": socket.gethostname(),
            **about,
            "trials": 0,
            "process": os.getpid(),
            "session": secrets.token_hex(4),  # hosts may share process numbers
        }
        self.compiled = compile_seconds()

    def count(self, trials: int) -> None:
        """So many more runs were computed."""
        self.about["trials"] += trials

    def save(self) -> None:
        """Add or update this session in the file."""
        self.about |= {
            "ended": provenance.now(),
            "wall_seconds": round(time.monotonic() - self.began, 3),
            "compile_seconds": round(compile_seconds() - self.compiled, 3),
        }
        if self.owner is not None and not self.owner.claim.stands():
            return  # the folder is gone, or another run's
        path = self.folder / "provenance.json"
        with disk_errors(path), door(self.folder):  # processes of one study end at the same time
            sessions = read_provenance(self.folder, aside=True)["sessions"]
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
