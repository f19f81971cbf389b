"""Which reader a file needs: told by what it holds, then by its ending."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ...errors import InputError
from .afad import is_afad, read_afad
from .contents import Contents
from .cosmos import is_cosmos, read_cosmos
from .csmip import is_csmip, read_csmip
from .esm import is_esm, read_esm
from .knet import is_knet, read_knet
from .matlab import is_matlab, read_matlab
from .numpy_file import is_numpy, read_numpy
from .peer import is_peer, read_at2
from .smc import is_smc, read_smc
from .table import read_table
from .text import text_lines

Reader = Callable[..., Contents]

#: File name endings that are taken for a ground motion, and who reads them where the content does
#: not say another format.
READERS: dict[str, Reader] = {
    ".mat": read_matlab,
    ".npy": read_numpy,
    ".at2": read_at2,
    ".csv": read_table,
    ".txt": read_table,
    ".dat": read_table,
    ".asc": read_table,
    ".smc": read_smc,
    ".v1": read_csmip,
    ".v2": read_csmip,
    ".v1c": read_cosmos,
    ".v2c": read_cosmos,
    **{f".{way}{depth}": read_knet for way in ("ns", "ew", "ud") for depth in ("", "1", "2")},
}

_TEXTS: tuple[tuple[Callable[[list[str]], bool], Reader, str], ...] = (
    (is_knet, read_knet, "K-NET"),
    (is_smc, read_smc, "SMC"),
    (is_cosmos, read_cosmos, "COSMOS"),
    (is_csmip, read_csmip, "CSMIP"),
    (is_afad, read_afad, "AFAD"),
    (is_esm, read_esm, "ESM"),
    (is_peer, read_at2, "PEER"),
)
_HEAD = 16384


def reader_of(path: Path, content: bytes) -> Reader:
    """The reader for a file's content.

    Raises:
        InputError: an ending that is not known, or content that is not what its ending says.
    """
    by_ending = READERS.get(path.suffix.lower())
    if is_matlab(content):
        return read_matlab
    if is_numpy(content):
        return read_numpy
    if by_ending in (read_matlab, read_numpy) and b"\x00" in content[:_HEAD]:
        return by_ending
    try:
        lines = text_lines(path, content[:_HEAD])
    except InputError:
        lines = []
    for told, reader, _ in _TEXTS:
        if lines and told(lines):
            return reader
    if by_ending is None:
        known = ", ".join(READERS)
        raise InputError(
            f"File {path} ends in {path.suffix or 'nothing'!r}, but a ground motion must be one "
            f"of {known}; rename or convert it."
        )
    if by_ending is read_matlab:
        return read_table  # as MATLAB's `save -ascii` writes it
    for _, reader, name in _TEXTS:
        if reader is by_ending and reader is not read_at2:
            raise InputError(
                f"File {path} ends in {path.suffix!r}, but its first lines are not those of a "
                f"{name} file; download it again, or name it .csv if it is a table."
            )
    return by_ending
