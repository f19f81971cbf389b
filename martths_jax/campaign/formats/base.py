"""What an output format is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from martths_jax.campaign.assembly import Results


@dataclass(frozen=True)
class Format:
    """A file that results are written to for other tools.

    Attributes:
        name: of its option, without the dashes.
        help: what the option writes.
        write: writes finished results to a file; its last argument says whether stored signals are
            wanted too.  Raises ``InputError`` where the format does not hold these results.
    """

    name: str
    help: str
    write: Callable[[Results, Path, bool], None]
