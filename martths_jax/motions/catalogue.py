"""From a name or a path to a file: what ``--records DIR`` offers and under which names."""

from __future__ import annotations

import os
from pathlib import Path

from ..errors import InputError
from .builtin import BUILTIN_NAMES
from .readers import READERS
from .readers.columns import plain

#: Environment variable that stands in for ``--records``.
RECORDS_VARIABLE = "MARTHS_RECORDS"

#: Short names of the files of the v-maRTHS benchmark's companion package.
BENCHMARK_NAMES = {
    "elcentroaccelnoscaling": "elcentro",
    "kobeaccelnoscaling": "kobe",
    "morganaccelnoscaling": "morganhill",
}


def short_name(path: Path) -> str:
    """The name under which a file is listed and its motion appears in tables."""
    return BENCHMARK_NAMES.get(plain(path.stem), path.stem)


def records_folder(records: str | os.PathLike | None = None) -> Path | None:
    """The folder of records: the argument, else ``$MARTHS_RECORDS``, else None."""
    given = records if records is not None else os.environ.get(RECORDS_VARIABLE) or None
    if given is None:
        return None
    folder = at_home(given)
    if not folder.is_dir():
        origin = "Argument `records` (--records)" if records is not None else f"${RECORDS_VARIABLE}"
        raise InputError(f"{origin} must name a folder of ground motions, but {folder} is none.")
    return folder


def record_files(records: str | os.PathLike | None = None) -> dict[str, Path]:
    """Motion files directly in the folder of records, by short name, sorted."""
    folder = records_folder(records)
    if folder is None:
        return {}
    files = sorted(p for p in folder.iterdir() if p.suffix.lower() in READERS and p.is_file())
    return _by_name(files)


def _by_name(files: list[Path]) -> dict[str, Path]:
    stems = [short_name(p) for p in files]
    names = [s if stems.count(s) == 1 else p.name for s, p in zip(stems, files, strict=True)]
    return dict(sorted(zip(names, files, strict=True)))


def find_file(path_or_name: str, records: str | os.PathLike | None = None) -> Path:
    """The file that a path or a name (of a file under the folder of records) stands for."""
    path = at_home(path_or_name)
    if _is_file(path):
        return path
    available = record_files(records)
    for name, file in available.items():
        if path_or_name in (name, file.name):
            return file
    wanted = plain(path_or_name)
    matches = [f for n, f in available.items() if wanted in {plain(n), plain(f.name)}]
    matches = matches or [f for f in available.values() if wanted == plain(f.stem)]
    if len(matches) == 1:
        return matches[0]
    raise InputError(_not_found(path_or_name, path, available, matches, records))


def at_home(path: str | os.PathLike) -> Path:
    """A path with ~ replaced; left as it is where there is no such user or it cannot be a path."""
    try:
        return Path(os.path.expanduser(path))
    except ValueError:  # a null byte
        return Path(path)


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name too long, or with a null byte
        return False


def _not_found(asked: str, path: Path, available: dict, matches: list, records) -> str:
    asked = repr(asked[:200])
    if matches:
        return f"Motion {asked} could be {', '.join(p.name for p in matches)}; give the file name."
    choices = ", ".join([*BUILTIN_NAMES, *available])
    looked = records_folder(records)
    hint = f"the folder of records is {looked}" if looked else "no folder of records is set"
    return (
        f"Motion {asked} is neither a file nor a known name (known: {choices}; {hint}); give a "
        f"path, or the folder that holds it (`records`, --records DIR, or ${RECORDS_VARIABLE})."
    )
