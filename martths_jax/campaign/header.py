"""``run.json``: what a run is, with the checksum of all it says."""

from __future__ import annotations

import json
from pathlib import Path

from martths_jax.campaign.checksum import json_digest
from martths_jax.campaign.parts import Damaged
from martths_jax.errors import InputError

#: Version of the layout of a run's folder.
FOLDER_FORMAT = 2


def sealed(header: dict) -> dict:
    """A header with the checksum of everything else in it."""
    plain = {k: v for k, v in header.items() if k != "sha256"}
    return plain | {"sha256": json_digest(plain)}


def read_header(file: Path, what: str) -> dict:
    """What ``run.json`` holds.

    Raises:
        FileNotFoundError: there is none.
        Damaged: it is not what was written.
        InputError: it is of another version, or cannot be read.
    """
    try:
        header = json.loads(file.read_text("utf-8"))
    except FileNotFoundError:
        raise
    except OSError as error:
        raise InputError(f"{file} cannot be read ({error.strerror or error}).") from None
    except (ValueError, RecursionError) as error:
        raise Damaged(f"it is no JSON: {error}") from None
    if not isinstance(header, dict):
        raise Damaged("it holds no table")
    if header.get("sha256") == sealed(header)["sha256"]:
        return header
    if header.get("format", FOLDER_FORMAT) != FOLDER_FORMAT:
        raise InputError(
            f"{file.parent} holds a {what} of format {header['format']}, this version reads format "
            f"{FOLDER_FORMAT}; use the version that wrote it, another --out (`out`), or --fresh "
            "(`fresh=True`) to delete it."
        )
    raise Damaged("its checksum is another")
