"""NumPy's ``.npy`` files."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..checks import check_memory
from .arrays import from_array, real_numbers
from .contents import Contents

_MAGIC = b"\x93NUMPY"


def is_numpy(content: bytes) -> bool:
    """Whether a file begins as the format says."""
    return content[:6] == _MAGIC


def read_numpy(path: Path, content: bytes, *, variable=None, dt=None) -> Contents:
    """Acceleration of a ``.npy`` file: a vector, 2 x N, N x 2, or the column of `variable`."""
    where = f"File {path}"
    try:
        array = np.load(io.BytesIO(content), allow_pickle=False)
    except Exception as error:  # damaged headers make NumPy raise nearly anything
        reason = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        raise InputError(
            f"{where} cannot be read as a NumPy array ({reason}); save it again with np.save."
        ) from None
    check_memory(array.size, where)
    return from_array(real_numbers(array, where), where, variable=variable, dt=dt)
