"""What a reader hands back, before units and names are settled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Contents:
    """The numbers of one file.

    Attributes:
        values: (n,) acceleration in the file's own unit.
        dt: time step [s], or None where the file has none.
        unit: canonical unit where the file says it, else None.
        where: how an error names the place (``File x.mat, array `A```).
        lines: line number of each value in a text file, for errors.
        notices: sentences a user should read.
    """

    values: np.ndarray
    dt: float | None
    unit: str | None
    where: str
    lines: list[int] | None = None
    notices: tuple[str, ...] = ()
