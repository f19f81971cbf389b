"""One file of results: a chunk of trials of one controller and motion, which says whose it is.

    martths-part 2 SHA-256 of the rest
    an .npz archive: the columns, and `about`, JSON: identity, machine, controller, motion, trials,
    names, types and shapes of the columns

Whoever reads one gets the columns that were written for what is asked, or ``Damaged``, ``Foreign``.
"""

from __future__ import annotations

import hashlib
import io
import json
from pathlib import Path

import numpy as np

_MAGIC = b"martths-part 2 "
_HEAD = len(_MAGIC) + 64 + 1


class Damaged(ValueError):
    """A file whose bytes are not those that were written."""


class Foreign(ValueError):
    """A whole file of something else than what was asked for."""


def part_bytes(about: dict, columns: dict[str, np.ndarray]) -> bytes:
    """A part's content.

    Args:
        about: whose it is, see ``RunFolder``; the columns' names, types and shapes are added.
        columns: arrays with the trials on their first axis.
    """
    about = about | {"columns": {k: [x.dtype.str, list(x.shape)] for k, x in columns.items()}}
    archive = io.BytesIO()
    np.savez(archive, about=np.frombuffer(json.dumps(about).encode(), np.uint8), **columns)
    content = archive.getvalue()
    return _MAGIC + hashlib.sha256(content).hexdigest().encode() + b"\n" + content


def read_part(path: Path) -> tuple[dict, dict[str, np.ndarray]]:
    """What a part says of itself, and its columns.

    Raises:
        Damaged: if any bit of it has changed, or it is no part.
        OSError: if it cannot be read.
    """
    content = path.read_bytes()
    rest = content[_HEAD:]
    if content[: len(_MAGIC)] != _MAGIC:
        raise Damaged("it does not begin as one")
    if content[len(_MAGIC) : _HEAD] != hashlib.sha256(rest).hexdigest().encode() + b"\n":
        raise Damaged("its checksum is another")
    try:
        with np.load(io.BytesIO(rest), allow_pickle=False) as file:
            columns = {name: file[name] for name in file.files}
        about = json.loads(columns.pop("about").tobytes())
        shapes = {k: [x.dtype.str, list(x.shape)] for k, x in columns.items()}
        if about["columns"] != shapes:
            raise ValueError("its columns are others than it says")
    except Exception as error:  # an archive of another hand makes NumPy raise nearly anything
        raise Damaged(str(error)) from None
    return about, columns


def check_part(about: dict, asked: dict, machines) -> None:
    """Make sure that a part is what was asked for.

    Args:
        about: what it says.
        asked: what it must say.
        machines: digests of the machines whose results may stand here.

    Raises:
        Foreign: naming what is different.
    """
    for key, value in asked.items():
        if about.get(key) != value:
            what = "of another study" if key == "identity" else f"of {key} {about.get(key)}"
            raise Foreign(f"it is {what}")
    if about.get("machine") not in machines:
        raise Foreign("it was computed on another kind of machine")
