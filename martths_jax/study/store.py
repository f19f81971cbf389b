"""The folder of a run: what it is, which trials are done, and their results, part by part.

    run.json        what decides the numbers, the configuration, the number of trials
    plants.csv      the plants, where they are not independent draws
    parts/C/M/      one file a chunk, controller C and motion M: 000000-000255.npz
    provenance.json when, where and how each session ran

A part appears whole or not at all, so whatever is there is right, whenever the run was killed.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from martths_jax.errors import InputError, raise_all
from martths_jax.files import safe_name
from martths_jax.study import provenance
from martths_jax.study.draws import Draws, read_plants, write_plants
from martths_jax.study.engine import Outcome
from martths_jax.study.files import disk_errors, remove_leftovers, write_text, writing
from martths_jax.text import counted

#: Version of the folder's and the result file's layout.
FORMAT = 1
#: What a run leaves in its folder; nothing else is ever deleted.
OWN = ("run.json", "parts", "provenance.json", "study.nc", "study.csv", "summary.md",
       "signals.nc", "config.toml", "plants.csv")  # fmt: skip
#: Plants that were given or spread evenly, so that the run stands on its own.
PLANTS = "plants.csv"
_PART = re.compile(r"(\d+)-(\d+)\.npz")


class RunFolder:
    """A run's folder, opened for one configuration.

    Attributes:
        path: the folder.
        header: what ``run.json`` holds: ``format``, ``trials``, ``identity``, ``config``,
                ``command_line``, ``commits``, ``platform``.
    """

    #: What a run of this kind leaves in its folder, and what it is called.
    own: tuple[str, ...] = OWN
    what: str = "study"

    def __init__(self, path: Path, header: dict):
        self.path, self.header = path, header

    @classmethod
    def open(cls, path: Path) -> RunFolder:
        """An existing run.

        Raises:
            InputError: if there is none, or it is damaged or of another version.
        """
        file = path / "run.json"
        try:
            header = json.loads(file.read_text("utf-8"))
        except FileNotFoundError:
            raise InputError(
                f"{path} holds no {cls.what} (no run.json); give its folder."
            ) from None
        except (OSError, ValueError) as error:
            raise InputError(
                f"{file} cannot be read ({error}); restore it, or start over with --fresh."
            ) from None
        if not isinstance(header, dict) or header.get("format") != FORMAT:
            found = header.get("format") if isinstance(header, dict) else None
            raise InputError(
                f"{path} holds a {cls.what} of format {found}, this version reads format {FORMAT}; "
                "use the version that wrote it, another --out, or --fresh to delete it."
            )
        return cls(path, header)

    @classmethod
    def start(cls, path: Path, header: dict, fresh: bool = False) -> RunFolder:
        """Open a run for more trials, or begin one.

        Args:
            path: the folder, created if missing.
            header: as it would be written (see the class).
            fresh: delete what is there first.

        Raises:
            InputError: the folder holds another run, or cannot be written.
        """
        header = json.loads(json.dumps(header | {"format": FORMAT}))
        if fresh:
            clear(path, cls.own)
        file = path / "run.json"
        if not file.exists():
            stray = [name for name in cls.own if (path / name).exists()]
            if stray:
                raise InputError(
                    f"{path} holds {', '.join(stray)} but no run.json, so what they are is "
                    "unknown; give another --out, or --fresh to delete them."
                )
            # Several processes may start at once: the first one's header stands.
            with disk_errors(path):
                path.mkdir(parents=True, exist_ok=True)
                mine = path / f".run.{os.getpid()}.part.json"
                mine.write_text(json.dumps(header, indent=1), encoding="utf-8")
                try:
                    os.link(mine, file)
                except FileExistsError:
                    pass
                except OSError:  # a file system without hard links
                    os.replace(mine, file)
                finally:
                    mine.unlink(missing_ok=True)
        run = cls.open(path)
        run._continue(header)
        return run

    def _continue(self, asked: dict) -> None:
        """Accept a further session, or refuse it."""
        differing = provenance.differences(self.header["identity"], asked["identity"])
        remedy = "Give the same configuration, another --out, or --fresh to start over."
        if differing:
            listed = "\n".join(f"  {text}" for text in differing)
            raise InputError(
                f"{self.path} holds results of another configuration.  These differ:\n{listed}\n"
                f"{remedy}"
            )
        if asked["trials"] < self.header["trials"]:
            raise InputError(
                f"{self.path} holds a {self.what} of {counted(self.header['trials'], 'trial')}, "
                f"but {asked['trials']} were asked for; a {self.what} can be extended, not "
                f"shortened.  {remedy}"
            )
        changed = dict(self.header)
        if asked["trials"] > self.header["trials"]:
            changed |= {k: asked[k] for k in ("trials", "config", "command_line")}
        commits = [*changed["commits"], *asked["commits"]]
        changed["commits"] = list(dict.fromkeys(commits))
        if changed != self.header:
            self.header = changed
            write_text(self.path / "run.json", json.dumps(changed, indent=1))

    def keep_draws(self, draws: Draws) -> None:
        """Store plants that do not follow from the seed."""
        if draws.table is not None and not (self.path / PLANTS).exists():
            write_plants(draws.plants(np.arange(1, draws.trials + 1)), self.path / PLANTS)

    def draws(self) -> Draws:
        """The plants by trial number."""
        identity, table = self.header["identity"], None
        if identity.get("plants_sha256"):
            table = read_plants(self.path / PLANTS)
        return Draws(self.trials, identity["seed"], identity["spread"], table)

    @property
    def trials(self) -> int:
        """Number of uncertain plants; trial 0 comes on top."""
        return self.header["trials"]

    @property
    def cells(self) -> list[tuple[str, str]]:
        """(controller, motion) in the order they run: controllers within a motion."""
        identity = self.header["identity"]
        return [(c, m) for m in identity["motions"] for c in identity["controllers"]]

    def folder(self, controller: str, motion: str) -> Path:
        """Where the parts of a controller and motion are."""
        return self.path / "parts" / safe_name(controller, space=False) / safe_name(motion)

    def parts(self, controller: str, motion: str) -> Iterator[tuple[int, int, Path]]:
        """(first trial, last trial, path) of every part, by first trial."""
        found = []
        folder = self.folder(controller, motion)
        for path in folder.iterdir() if folder.is_dir() else ():
            match = _PART.fullmatch(path.name)
            if match:
                found.append((int(match[1]), int(match[2]), path))
        return iter(sorted(found))

    def done(self, controller: str, motion: str) -> np.ndarray:
        """(trials + 1,) which trials are finished."""
        done = np.zeros(self.trials + 1, dtype=bool)
        for first, last, _ in self.parts(controller, motion):
            done[first : last + 1] = True
        return done

    def write(self, controller: str, motion: str, trial: np.ndarray, outcome: Outcome) -> None:
        """Store finished trials, run by run of consecutive numbers."""
        for span in np.split(np.arange(trial.size), np.flatnonzero(np.diff(trial) != 1) + 1):
            name = f"{trial[span[0]]:06d}-{trial[span[-1]]:06d}.npz"
            with writing(self.folder(controller, motion) / name) as temporary:
                with temporary.open("wb") as file:
                    np.savez(file, **outcome[span].arrays())

    def read(self, controller: str, motion: str) -> Outcome:
        """All trials 0 ... N of a controller and motion.

        Raises:
            InputError: a part is damaged (it is put aside, so that a rerun replaces it), or trials
                are missing.
        """
        columns: dict[str, np.ndarray] = {}
        seen = np.zeros(self.trials + 1, dtype=bool)
        for first, last, path in self.parts(controller, motion):
            arrays = _read_part(path, last - first + 1)
            for name, values in arrays.items():
                shape = (self.trials + 1, *values.shape[1:])
                columns.setdefault(name, np.empty(shape, values.dtype))[first : last + 1] = values
            seen[first : last + 1] = True
        raise_all(missing_spans(seen, f"{controller} on {motion}"), f"{self.path} is not complete")
        return Outcome(**columns)

    def missing(self) -> list[str]:
        """Sentences about trials that are not there yet."""
        return [
            text
            for controller, motion in self.cells
            for text in missing_spans(self.done(controller, motion), f"{controller} on {motion}")
        ]

    def tidy(self) -> None:
        """Delete the leftovers of killed processes."""
        remove_leftovers(self.path)


def missing_spans(done: np.ndarray, where: str) -> list[str]:
    """One sentence that names the trials which are not done, or none."""
    gaps = np.flatnonzero(~done)
    if not gaps.size:
        return []
    spans = np.split(gaps, np.flatnonzero(np.diff(gaps) != 1) + 1)
    text = ", ".join(f"{s[0]}-{s[-1]}" if s.size > 1 else f"{s[0]}" for s in spans[:5])
    return [f"{where}: trials {text}{' ...' if len(spans) > 5 else ''} are missing."]


def _read_part(path: Path, trials: int) -> dict[str, np.ndarray]:
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        if set(arrays) != set(Outcome.__dataclass_fields__) or any(
            x.shape[0] != trials for x in arrays.values()
        ):
            raise ValueError("not the arrays of its trials")
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        aside = path.with_suffix(".damaged")
        with disk_errors(path):
            os.replace(path, aside)
        raise InputError(
            f"{path} is damaged ({error}); it was renamed to {aside.name}.  Repeat the command to "
            "compute its trials again."
        ) from None
    return arrays


def clear(path: Path, own: tuple[str, ...] = OWN) -> None:
    """Delete what a run left in its folder, and nothing else.

    Raises:
        InputError: if it cannot be deleted.
    """
    with disk_errors(path):
        for name in own:
            target = path / name
            if target.is_dir():
                shutil.rmtree(target)
            else:
                target.unlink(missing_ok=True)
        if path.is_dir():
            remove_leftovers(path)
