"""Files that say who holds something, and are known to be void once the holder has ended.

The holder keeps its file locked; the system gives the lock up when the process ends, however it
ends.  So a claim is void if and only if its lock can be had: no process numbers are compared, which
two containers or hosts may share.  Where a file system has no locks, or keeps them to one host, the
claim's text (host, boot, process and its start) and its age decide.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import secrets
import socket
import threading
import time
from functools import lru_cache
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None
    import msvcrt

#: A holder renews its claim this often [s], for hosts that do not see its lock.
RENEWED = 15.0
#: A claim of another host, whose lock says nothing here, is void when it is older than this [s].
STALE = 90.0
_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL}


def try_lock(descriptor: int) -> bool | None:
    """Whether the open file is now locked for this process alone; None where there are no locks."""
    try:
        if fcntl is not None:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        else:
            os.lseek(descriptor, 1 << 30, os.SEEK_SET)  # beyond the text, which stays readable
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
    except OSError as error:
        return None if error.errno in _NO_LOCKS else False
    return True


def is_open_at(descriptor: int, path: Path) -> bool:
    """Whether an open file is still the one under its name."""
    try:
        there, mine = os.stat(path), os.fstat(descriptor)
    except OSError:
        return False
    return (there.st_ino, there.st_dev) == (mine.st_ino, mine.st_dev)


@lru_cache(maxsize=1)
def _boot() -> str:
    """What tells this start of this machine from others, also from inside a container."""
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    except OSError:
        return socket.gethostname()


def _started(process: int) -> str | None:
    """When a process of this machine started, in the kernel's ticks; None if it is not there."""
    try:
        text = Path(f"/proc/{process}/stat").read_text()
    except FileNotFoundError:
        return None
    except OSError:
        return ""
    return text.rpartition(")")[2].split()[19]


def me() -> dict:
    """What identifies this process, as JSON can hold it."""
    number = os.getpid()
    return {
        "host": socket.gethostname(),
        "boot": _boot(),
        "process": number,
        "process_started": _started(number) or "",
    }


def unique_name() -> str:
    """A name no other process has: host, process and a random part."""
    host = "".join(c if c.isalnum() or c in "-_" else "_" for c in socket.gethostname())[:40]
    return f"{host}-{os.getpid()}-{secrets.token_hex(4)}"


class Claim:
    """A file this process holds.

    Args:
        path: the file, by a name that nobody else uses.
        about: what it says, beside who holds it.
        renew: keep it fresh in the background, for claims that other hosts look at.

    Raises:
        OSError: if it cannot be made.
    """

    def __init__(self, path: Path, about: dict | None = None, renew: bool = False):
        self.path = path
        self.about = me() | (about or {})
        # Whoever meets the file under its name meets it locked and whole.
        new = path if fcntl is None else path.with_name(f"{path.name}.new")
        self.descriptor = os.open(new, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666)
        try_lock(self.descriptor)
        os.lseek(self.descriptor, 0, os.SEEK_SET)
        os.write(self.descriptor, json.dumps(self.about).encode())
        if new != path:
            os.rename(new, path)
        self._ended = threading.Event()
        if renew:
            threading.Thread(target=self._renew, daemon=True).start()

    def _renew(self) -> None:
        while not self._ended.wait(RENEWED):
            with contextlib.suppress(OSError):
                os.utime(self.path)

    def stands(self) -> bool:
        """Whether the file is still there and still this process's own."""
        return is_open_at(self.descriptor, self.path)

    def release(self) -> None:
        """Give it up and delete the file, if it is still this process's own."""
        self._ended.set()
        if self.descriptor < 0:
            return
        own = self.stands()
        if own and fcntl is not None:
            self.path.unlink(missing_ok=True)
        os.close(self.descriptor)
        if own and fcntl is None:  # Windows deletes no open file
            self.path.unlink(missing_ok=True)
        self.descriptor = -1


def holder(path: Path) -> dict | None:
    """What the claim in a file says, or None if it is void.

    A claim that cannot be read has a holder as long as it is locked.
    """
    try:
        descriptor = os.open(path, os.O_RDWR)
    except FileNotFoundError:
        return None
    except OSError:
        descriptor = None
    if descriptor is None:
        locked = None
    else:
        try:
            got = try_lock(descriptor)
            locked = None if got is None else not got
        finally:
            os.close(descriptor)
    try:
        about = json.loads(path.read_text("utf-8"))
        age = time.time() - path.stat().st_mtime
        about = about if isinstance(about, dict) else {}
    except FileNotFoundError:
        return None
    except (OSError, ValueError):
        about, age = {}, 0.0
    return about if _is_held(locked, about, age) else None


def _is_held(locked: bool | None, about: dict, age: float) -> bool:
    """Whether a claim is held: `locked` here (None: no locks), its text, its age [s]."""
    here = about.get("boot") == _boot()
    if locked:
        return True
    if locked is False and (here or not about):
        return False
    if here and about.get("host") == socket.gethostname():
        started = _started(about.get("process", -1))
        return started is not None and started in ("", about.get("process_started"))
    return age < STALE
