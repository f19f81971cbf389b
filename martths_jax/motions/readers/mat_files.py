"""The arrays of MATLAB files, version 5 (SciPy) and 7.3 (HDF5, h5py), within bounds of memory."""

from __future__ import annotations

import io
import struct
import zlib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..checks import check_memory

_HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"
_NUMERIC = {
    b"double",
    b"single",
    *(f"{u}int{n}".encode() for u in ("", "u") for n in (8, 16, 32, 64)),
}
_DEPTH, _ITEMS = 6, 64
_COMPRESSED = 15
_PIECE = 1 << 24

#: Float64 values that a stored byte may become, beside the copies of the array that is chosen.
_LOADED = 2


@dataclass
class Variables:
    """What a MATLAB file holds, by dotted name.

    Attributes:
        arrays: real numeric arrays, float64.
        texts: character arrays.
        objects: names of objects that only MATLAB can open (``timeseries``, tables ...).
    """

    arrays: dict[str, np.ndarray] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)
    objects: list[str] = field(default_factory=list)


def is_hdf5(content: bytes) -> bool:
    """Whether a file is HDF5, with or without MATLAB's block in front."""
    return content[:8] == _HDF5_MAGIC or content[512:520] == _HDF5_MAGIC


def read_variables(path: Path, content: bytes) -> Variables:
    """Every real numeric array of the file by its (dotted) name."""
    try:
        return _read_hdf5(path, content) if is_hdf5(content) else _read_version5(path, content)
    except InputError:
        raise
    except MemoryError:
        raise InputError(f"File {path} holds an array that does not fit in memory.") from None
    except Exception as error:  # damaged files make SciPy and h5py raise nearly anything
        reason = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        raise InputError(
            f"File {path} cannot be read as a MATLAB file ({reason}); save it again from MATLAB, "
            "or export it as CSV."
        ) from None


def _as_numbers(value: object) -> np.ndarray | None:
    array = np.asarray(value)
    if array.dtype.kind not in "fiu" or array.ndim > 2:
        return None
    return array.astype(np.float64)


def _check_expanded(path: Path, content: bytes) -> None:
    """Refuse a version-5 file whose elements, cells and structs included, would not fit.

    Compressed elements are expanded piece by piece and counted, never kept.
    """
    if content[:19] != b"MATLAB 5.0 MAT-file" or len(content) < 128:
        return
    order = ">" if content[126:128] == b"MI" else "<"
    stored, place = 0, 128
    while place + 8 <= len(content):
        kind, size = struct.unpack(f"{order}II", content[place : place + 8])
        element = content[place + 8 : place + 8 + size]
        place += 8 + size + (0 if kind == _COMPRESSED else -size % 8)
        if kind != _COMPRESSED:
            stored += len(element)
            continue
        expander = zlib.decompressobj()
        while element and not expander.eof:
            stored += len(expander.decompress(element, _PIECE))
            element = expander.unconsumed_tail
            check_memory(stored, f"File {path}, with all that it holds,", _LOADED)
    check_memory(stored, f"File {path}, with all that it holds,", _LOADED)


def _read_version5(path: Path, content: bytes) -> Variables:
    from scipy.io import loadmat, whosmat

    _check_expanded(path, content)
    sizes = [np.prod(np.asarray(shape, np.float64)) for _, shape, _ in whosmat(io.BytesIO(content))]
    check_memory(sum(sizes), f"File {path}, with all that it holds,")
    loaded = loadmat(io.BytesIO(content), struct_as_record=False, squeeze_me=False)
    found = Variables()

    def collect(name: str, value: object, depth: int = 0) -> None:
        if depth > _DEPTH:
            return
        if type(value).__name__ in ("MatlabOpaque", "MatlabObject", "MatlabFunction"):
            found.objects.append(name)
        elif isinstance(value, np.ndarray) and value.dtype == object:
            items = list(value.ravel()[:_ITEMS])
            for k, item in enumerate(items, 1):
                collect(name if len(items) == 1 else f"{name}({k})", item, depth + 1)
        elif hasattr(value, "_fieldnames"):
            for one in value._fieldnames:
                collect(f"{name}.{one}", getattr(value, one), depth + 1)
        elif isinstance(value, np.ndarray) and value.dtype.kind == "U":
            found.texts[name] = " ".join(value.ravel()[:4])[:200]
        elif (numbers := _as_numbers(value)) is not None:
            found.arrays[name] = numbers

    for name, value in loaded.items():
        if name == "None" or (not name.startswith("__") and _is_opaque(value)):
            found.objects.append(_opaque_name(value) or name)
        elif not name.startswith("__"):
            collect(name, value)
    return found


def _is_opaque(value: object) -> bool:
    return type(value).__name__ == "MatlabOpaque"


def _opaque_name(value: object) -> str:
    """Name and class that SciPy keeps of an object it cannot open."""
    try:
        record = np.asarray(value).ravel()[0]
        return f"{bytes(record['s0']).decode()} ({bytes(record['s2']).decode()})"
    except (LookupError, TypeError, ValueError, UnicodeDecodeError):
        return ""


def _read_hdf5(path: Path, content: bytes) -> Variables:
    import h5py

    found = Variables()
    with h5py.File(io.BytesIO(content), "r") as file:
        chosen: dict[str, h5py.Dataset] = {}

        def collect(name: str, item: object) -> None:
            if not isinstance(item, h5py.Dataset):
                return
            dotted = name.replace("/", ".")
            if item.external or item.is_virtual:
                raise InputError(
                    f"File {path}, array `{dotted}`, keeps its numbers in another file, which is "
                    "not opened; save them in the file itself."
                )
            if name.startswith("#"):
                return
            kind = item.attrs.get("MATLAB_class", b"double")
            kind = kind.encode() if isinstance(kind, str) else bytes(kind)
            if "MATLAB_object_decode" in item.attrs:
                found.objects.append(f"{dotted} ({kind.decode(errors='replace')})")
            elif kind == b"char" and item.size <= 200 and item.dtype.kind == "u":
                found.texts[dotted] = "".join(map(chr, item[()].ravel()))
            elif item.attrs.get("MATLAB_empty", 0):
                found.arrays[dotted] = np.empty((0, 0))
            elif kind in _NUMERIC and item.dtype.kind in "fiu" and item.ndim <= 2:
                chosen[dotted] = item

        file.visititems(collect)
        total = float(sum(float(item.size) for item in chosen.values()))
        check_memory(total, f"File {path}, with all that it holds,")
        for dotted, item in chosen.items():
            found.arrays[dotted] = np.asarray(item[()], dtype=np.float64)
    return found
