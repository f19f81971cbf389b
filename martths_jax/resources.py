"""Memory that this process may still take: the machine's, its containers' and its own limit."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

import psutil

#: Where Linux says which control groups this process is in, and where these are.
GROUPS_FILE, GROUPS = Path("/proc/self/cgroup"), Path("/sys/fs/cgroup")
#: Files of version 2 and of version 1: limits, use, and the line of `memory.stat` that counts the
#: cache of files, which gives way.
_FILES = {
    2: (("memory.max", "memory.high"), "memory.current", "inactive_file"),
    1: (("memory.limit_in_bytes",), "memory.usage_in_bytes", "total_inactive_file"),
}


def available_memory() -> float:
    """Memory that can be taken now [bytes].

    The least of what the machine has free, of what every control group (version 1 or 2) around this
    process leaves below its limit, as in containers and batch jobs, and of what the process's own
    bound on its address space (``ulimit -v``) leaves.
    """
    return max(0.0, min([psutil.virtual_memory().available, *_group_rooms(), *_own_rooms()]))


def _group_rooms() -> Iterator[float]:
    """What each control group with a limit leaves [bytes]."""
    try:
        lines = GROUPS_FILE.read_text().splitlines()
    except OSError:  # not on Linux
        return
    for line in lines:
        number, controllers, inside = (line.split(":", 2) + ["", ""])[:3]
        if number == "0" and not controllers:
            mounts, version = (GROUPS, GROUPS / "unified"), 2
        elif "memory" in controllers.split(","):
            mounts, version = dict.fromkeys((GROUPS / "memory", GROUPS / controllers)), 1
        else:
            continue
        for mount in mounts:
            # A limit of a group holds for all inside it.  A container may see its own group as the
            # root, whatever its path is outside.
            path = PurePosixPath("/", *(p for p in inside.split("/") if p not in ("", "..")))
            for folder in (path, *path.parents):
                yield from _room(mount / folder.relative_to("/"), version)


def _room(folder: Path, version: int) -> Iterator[float]:
    limits, use, cache = _FILES[version]
    used = _number(folder / use)
    if used is None:
        return
    found = [limit for name in limits if (limit := _number(folder / name)) is not None]
    if found:
        yield min(found) - used + min(used, _stat(folder / "memory.stat", cache))


def _number(path: Path) -> float | None:
    try:
        return float(int(path.read_text()))
    except (OSError, ValueError):  # not there, or "max"
        return None


def _stat(path: Path, name: str) -> float:
    try:
        found = dict(line.split(None, 1) for line in path.read_text().splitlines())
        return float(int(found[name]))
    except (OSError, ValueError, KeyError):
        return 0.0


def _own_rooms() -> Iterator[float]:
    """What this process's bound on its address space leaves [bytes]."""
    if sys.platform == "win32":
        return
    import resource

    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY:
        yield limit - psutil.Process().memory_info().vms
