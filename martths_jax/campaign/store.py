"""The folder of a run: what it is, which trials are done, and their results, part by part.

    run.json        what decides the numbers, the configuration, the number of trials
    plants.csv      the plants, where they are not independent draws
    guests/         copies of the files that a user's controllers and indices were loaded from
    parts/C/M/      one file a chunk, controller C and motion M: 000000-000255.npz
    provenance.json when, where and how each session ran
    .martths/       who runs there now, and what is being written (``owner``, ``files``)

A part appears whole or not at all and says whose it is (``parts``), so whatever is read is right,
whenever the run was killed, whatever happened to the disk, and whoever copied what where.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import shutil
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from martths_jax.campaign import provenance
from martths_jax.campaign.draws import Draws, read_plants, write_plants
from martths_jax.campaign.files import (
    damaged_files,
    disk_errors,
    set_aside,
    write_bytes,
    write_text,
)
from martths_jax.campaign.header import FOLDER_FORMAT, read_header, sealed
from martths_jax.campaign.machine import MIXED_NOTE
from martths_jax.campaign.owner import Owner, door
from martths_jax.campaign.parts import Damaged, read_part
from martths_jax.campaign.stored import Stored
from martths_jax.errors import InputError
from martths_jax.guests import FILES, Copy, kept
from martths_jax.problem import Problem, find_problem
from martths_jax.text import counted

#: Version of the layout of the result files.
FORMAT = 1
#: What a run leaves in its folder; nothing else is ever deleted.
OWN = ("run.json", "parts", "provenance.json", "study.nc", "study.csv", "summary.md",
       "signals.nc", "config.toml", "plants.csv", FILES)  # fmt: skip
#: Plants that were given or spread evenly, so that the run stands on its own.
PLANTS = "plants.csv"
_AGAIN = (
    "Give the same configuration, another --out (`out`), or --fresh (`fresh=True`) to start over."
)


class RunFolder(Stored):
    """A run's folder, opened for one configuration.

    Attributes:
        path: the folder.
        header: what ``run.json`` holds: ``format``, ``trials``, ``identity``, ``machines``,
                ``config``, ``command_line``, ``commits``, ``platform``, and ``sha256`` of the rest.
        owner: this process's right to write there; None for a folder that is only read.
    """

    #: What a run of this kind leaves in its folder, and what it is called.
    own: tuple[str, ...] = OWN
    what: str = "study"

    @classmethod
    def open(cls, path: Path) -> RunFolder:
        """An existing run, to read.

        Raises:
            InputError: if there is none, or it is damaged or of another version.
        """
        try:
            return cls(path, read_header(path / "run.json", cls.what))
        except FileNotFoundError:
            raise InputError(
                f"{path} holds no {cls.what} (no run.json); give its folder."
            ) from None
        except Damaged as error:
            raise InputError(
                f"{path / 'run.json'} is damaged ({error}); repeat the command that ran this "
                f"{cls.what}, which writes it again."
            ) from None

    @classmethod
    def start(
        cls,
        path: Path,
        header: dict,
        fresh: bool = False,
        *,
        shared: bool = False,
        allow_mixed: bool = False,
        notice: Callable[[str], None] = lambda text: None,
    ) -> RunFolder:
        """Open a run for more trials, or begin one; this process owns the folder then (``close``).

        Args:
            path: the folder, created if missing.
            header: as it would be written (see the class).
            fresh: delete what is there first.
            shared: other processes may run shares of the same work there.
            allow_mixed: go on with results of machines that compile in another way.
            notice: is told what was damaged and set aside.

        Raises:
            InputError: the folder holds another run, somebody runs there, or it cannot be written.
        """
        header = json.loads(json.dumps(header | {"format": FOLDER_FORMAT}))
        with disk_errors(path):
            path.mkdir(parents=True, exist_ok=True)
            with door(path):
                owner = Owner(path, shared, header["command_line"])
                try:
                    if fresh:
                        clear(path, cls.own)
                    found = cls._present(path, header, notice)
                    run = cls(path, found, owner)
                    run._continue(header, allow_mixed, notice)
                except BaseException:
                    owner.leave()
                    raise
        return run

    @classmethod
    def _present(cls, path: Path, header: dict, notice) -> dict:
        """The header in the folder, which is written where there is none yet or it is damaged."""
        file = path / "run.json"
        try:
            return read_header(file, cls.what)
        except FileNotFoundError:
            reason = "no run.json"
        except Damaged as error:
            reason = f"a damaged run.json ({error})"
        run = cls(path, sealed(header))
        stray = [name for name in cls.own if (path / name).exists()]
        if stray and not run._is_ours():
            raise InputError(
                f"{path} holds {', '.join(stray)} but {reason}, so what they are is unknown; give "
                "another --out (`out`), or --fresh (`fresh=True`) to delete them."
            )
        if stray:
            if file.exists():
                set_aside(file)
            notice(f"{path} holds {reason}; all parts there are of this {cls.what}, which goes on.")
        write_text(file, json.dumps(run.header, indent=1))
        return run.header

    def _is_ours(self) -> bool:
        """Whether every part in a folder without a header is of this run, and there is one."""
        found = list((self.path / "parts").rglob("*.npz"))
        digest = self.digest
        try:
            return bool(found) and all(read_part(p)[0].get("identity") == digest for p in found)
        except (Damaged, OSError):
            return False

    def _continue(self, asked: dict, allow_mixed: bool, notice) -> None:
        """Accept a further session, or refuse it."""
        differing = provenance.differences(self.header["identity"], asked["identity"])
        if differing:
            listed = "\n".join(f"  {text}" for text in differing)
            raise InputError(
                f"{self.path} holds results of another configuration.  These differ:\n{listed}\n"
                f"{_AGAIN}"
            )
        if asked["trials"] < self.header["trials"]:
            raise InputError(
                f"{self.path} holds a {self.what} of {counted(self.header['trials'], 'trial')}, "
                f"but {asked['trials']} were asked for; a {self.what} can be extended, not "
                f"shortened.  {_AGAIN}"
            )
        changed = dict(self.header)
        changed["machines"] = self._machines(asked["machines"], allow_mixed, notice)
        if asked["trials"] > self.header["trials"]:
            if not self.owner.alone:
                raise InputError(
                    f"{self.path} cannot be extended to {asked['trials']} trials while other "
                    f"processes run shares of {self.header['trials']} there; wait until they end."
                )
            changed |= {k: asked[k] for k in ("trials", "config", "command_line")}
        commits = [*changed["commits"], *asked["commits"]]
        changed["commits"] = list(dict.fromkeys(commits))
        changed = sealed(changed)
        if changed != self.header:
            self.header = changed
            write_text(self.path / "run.json", json.dumps(changed, indent=1))

    def _machines(self, asked: dict, allow_mixed: bool, notice) -> dict:
        """Machines whose results stand in this folder, with the asked ones."""
        there = self.header["machines"]
        new = {k: v for k, v in asked.items() if k not in there}
        if not new or not there:
            return there | new
        stored, here = next(iter(there.values())), next(iter(new.values()))
        listed = "; ".join(provenance.differences(stored, here, "machine."))
        if not allow_mixed:
            raise InputError(
                f"{self.path} holds results of a machine that compiles in another way, so their "
                f"last bits would be of two kinds: {listed}.  Go on there, give another --out "
                "(`out`), or accept it with --allow-mixed (`allow_mixed=True`)."
            )
        notice(
            f"Results of two kinds of machines are mixed in {self.path}: {listed}.  " + MIXED_NOTE
        )
        return there | new

    def close(self) -> None:
        """Leave the folder to others."""
        if self.owner is not None:
            self.owner.release()
            self.owner = None

    def __enter__(self) -> RunFolder:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def keep_draws(self, draws: Draws) -> None:
        """Store plants that do not follow from the seed."""
        file = self.path / PLANTS
        if draws.table is None:
            return
        with contextlib.suppress(InputError):
            table = read_plants(file, problem=draws.problem)
            if replace(draws, table=table).sha256 == draws.sha256:
                return
        if file.exists():
            set_aside(file)
        write_plants(draws.plants(np.arange(1, draws.trials + 1)), file, draws.problem)

    def keep_copies(self, copies: Iterable[Copy]) -> None:
        """Store the files that a user's code was loaded from, so that it can be loaded again."""
        for one in copies:
            content = one.file.read_bytes()
            if hashlib.sha256(content).hexdigest() != one.sha256:
                raise InputError(f"{one.file} was changed while it ran; repeat the command.")
            path = self.path / one.place
            if not (path.is_file() and path.read_bytes() == content):
                with disk_errors(path):
                    path.parent.mkdir(parents=True, exist_ok=True)
                write_bytes(path, content)

    @property
    def problem(self) -> Problem:
        """What was tested."""
        identity = self.header["identity"]
        return find_problem(kept(identity["problem"], self.path), identity["case"])

    def draws(self) -> Draws:
        """The plants by trial number.

        Raises:
            InputError: the stored ones are not those of the run.
        """
        identity, table = self.header["identity"], None
        if identity.get("plants_sha256"):
            table = read_plants(self.path / PLANTS, problem=self.problem)
        found = Draws(self.trials, identity["seed"], identity["spread"], table, self.problem)
        if found.sha256 != identity.get("plants_sha256"):
            raise InputError(
                f"{self.path / PLANTS} is damaged: it does not hold the plants of this "
                f"{self.what}; repeat the command that ran it, which writes it again."
            )
        return found


def clear(path: Path, own: tuple[str, ...] = OWN) -> None:
    """Delete what a run left in its folder, and nothing else.

    Raises:
        InputError: if it cannot be deleted.
    """
    with disk_errors(path):
        for name in own:
            target = path / name
            if target.is_dir() and not target.is_symlink():
                shutil.rmtree(target)
            else:
                target.unlink(missing_ok=True)
            for aside in damaged_files(target):
                aside.unlink()
