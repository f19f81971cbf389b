"""Checks that every reader shares: finite numbers, memory, and what the file says of itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..errors import InputError
from ..resources import available_memory

#: Part of the memory now free that one motion may take, with the work arrays around it.
MEMORY_SHARE = 0.5
_WORK_COPIES = 6


def check_memory(samples: float, where: str, copies: float = _WORK_COPIES) -> None:
    """Refuse `samples` float64 values (and the copies made of them) that would not fit."""
    need = 8.0 * float(samples) * copies
    limit = MEMORY_SHARE * available_memory()
    if not need <= limit:
        raise InputError(
            f"{where} needs {samples:.3g} samples, about {need / 2**30:.3g} GiB, but only "
            f"{limit / 2**30:.3g} GiB may be used here; cut the motion, lower the sampling rate, "
            "or check the unit of its time column (s)."
        )


def check_file_size(path: Path, factor: float = 1.0) -> None:
    """Refuse a file whose `factor` samples a byte would not fit in memory."""
    check_memory(path.stat().st_size * factor, f"File {path}")


def finite_values(values: np.ndarray, where: str, lines: list[int] | None = None) -> np.ndarray:
    """`values` as float64 (n,), with at least two entries, all finite, not all zero."""
    values = np.asarray(values, dtype=np.float64).ravel()
    if values.size < 2:
        raise InputError(
            f"{where} holds {values.size} acceleration values, but a motion needs at least 2; "
            "check that this is the right file or array."
        )
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        first = int(bad[0])
        place = f"line {lines[first]}" if lines else f"sample {first + 1}"
        raise InputError(
            f"{where}, {place}: found {values[first]} ({bad.size} of {values.size} values are not "
            "finite), but every value must be a number; repair or cut those samples."
        )
    if not np.any(values):
        raise InputError(f"{where} holds only zeros, but a motion must move; check the file.")
    return values


def check_stated_peak(
    values: np.ndarray, stated: float, where: str, tolerance: float = 0.02
) -> None:
    """Refuse samples whose largest magnitude is not what the file's header says, in its unit."""
    peak = float(np.max(np.abs(values))) if np.size(values) else 0.0
    if abs(peak - abs(stated)) > tolerance * abs(stated) + 0.002:
        raise InputError(
            f"{where}: the header says that the peak is {abs(stated):.6g}, but the samples reach "
            f"{peak:.6g}; the file is damaged, or not in the unit it says: download it again."
        )


def check_stated_count(found: int, stated: int, where: str, name: str = "NPTS") -> None:
    """Refuse another number of samples than the file's header says."""
    if found != stated:
        fewer = found < stated
        remedy = "it is truncated: download it again" if fewer else f"correct {name} or the data"
        raise InputError(
            f"{where}: the header says {name} = {stated}, but {found} values follow; {remedy}."
        )


def file_bytes(path: Path) -> bytes:
    """The file's content, or `InputError` when it cannot be read or is empty."""
    try:
        check_file_size(path)
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"File {path} cannot be read: {error.strerror or error}.") from None
    if not content:
        raise InputError(f"File {path} is empty, but a ground motion was expected.")
    return content
