"""Who runs in a folder: one process alone, or several that run shares of the same work.

.martths/door       locked for the moment in which owners come, go and change ``run.json``
.martths/owners/    a claim each
"""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from martths_jax.campaign.files import disk_errors
from martths_jax.claims import Claim, holder, is_open_at, try_lock, unique_name
from martths_jax.errors import InputError
from martths_jax.files import PRIVATE, make_folder, remove_empty, sweep

#: Longest time to wait at the door, which nobody holds longer than it takes to write a file [s].
PATIENCE = 30.0


@contextmanager
def door(folder: Path) -> Iterator[None]:
    """Keep all other processes out of the folder's door.

    Raises:
        InputError: if another process does not leave it.
        OSError: if the folder cannot be written.
    """
    path = folder / PRIVATE / "door"
    deadline = time.monotonic() + PATIENCE
    while True:
        make_folder(path.parent)
        try:
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        except FileNotFoundError:  # whoever left just now took the folder along
            continue
        if try_lock(descriptor) is not False and is_open_at(descriptor, path):
            break
        os.close(descriptor)
        if time.monotonic() > deadline:
            raise InputError(
                f"{folder} is being changed by another process, which has not ended within "
                f"{PATIENCE:g} s (is it stopped?); end it, or give another --out (`out`)."
            )
        time.sleep(0.01)
    try:
        yield
    finally:
        # The file may go only while it is locked: whoever waits for it looks whether it is there.
        if not any((folder / PRIVATE / name).is_dir() for name in ("owners", "tmp")):
            path.unlink(missing_ok=True)
        os.close(descriptor)
        remove_empty(path.parent)


class Owner:
    """A process's right to write into a run's folder; made inside its ``door``.

    Args:
        folder: of the run.
        shared: others may run shares of the same work beside this one.
        command: what runs, for whoever comes later.

    Raises:
        InputError: another process is there that does not share, or with which this one does not.
    """

    def __init__(self, folder: Path, shared: bool, command: str):
        self.folder = folder
        place = folder / PRIVATE / "owners"
        others = owners(folder)
        for other in others:
            if not (shared and other.get("shared")):
                raise InputError(_in_use(folder, other))
        #: Whether nobody else was there.
        self.alone = not others
        place.mkdir(parents=True, exist_ok=True)
        since = time.strftime("%Y-%m-%d %H:%M:%S %z")
        about = {"shared": shared, "command": command, "since": since}
        self.claim = Claim(place / unique_name(), about, renew=True)
        sweep(folder)

    def check(self) -> None:
        """Make sure that what is written now goes into the folder this run began in.

        Raises:
            InputError: it was removed or replaced meanwhile.
        """
        if not self.claim.stands():
            raise InputError(
                f"{self.folder} was removed, moved or taken over while this ran, so nothing more "
                "is written there; repeat the command, with another --out (`out`) if another run "
                "is in that folder now."
            )

    def leave(self) -> None:
        """Leave the folder, inside its ``door``."""
        self.claim.release()
        remove_empty(self.claim.path.parent)

    def release(self) -> None:
        """Leave the folder; what was removed with it is not made again."""
        if self.claim.stands():
            with contextlib.suppress(OSError, InputError), door(self.folder):
                self.leave()
        self.claim.release()


@contextmanager
def owned(folder: Path, command: str) -> Iterator[Owner]:
    """Own a folder alone, which is created if missing.

    Raises:
        InputError: somebody runs there, or it cannot be written.
    """
    with disk_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        with door(folder):
            owner = Owner(folder, False, command)
    try:
        yield owner
    finally:
        owner.release()


def owners(folder: Path) -> list[dict]:
    """Who runs in a folder; claims that are void are deleted.  Call it inside the ``door``."""
    found, place = [], folder / PRIVATE / "owners"
    for path in list(place.iterdir()) if place.is_dir() else ():
        about = holder(path)
        if about is not None:
            found.append(about)
        else:
            path.unlink(missing_ok=True)
    return found


def _in_use(folder: Path, other: dict) -> str:
    who = f"process {other.get('process', '?')} on {other.get('host', 'an unknown host')}"
    return (
        f"{folder} is in use: `{other.get('command', 'a run')}` has run there since "
        f"{other.get('since', 'an unknown time')} ({who}).  Wait until it ends, end it, or give "
        "another --out (`out`); several processes may run shares of one study (--shard I/N)."
    )
