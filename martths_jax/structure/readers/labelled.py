"""Matrices with named degrees of freedom, from NumPy, MATLAB and CSV files."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from martths_jax.errors import InputError
from martths_jax.structure.planar import dof_name
from martths_jax.structure.units import Units
from martths_jax.text import nearest

MATRICES = ("K", "M", "C")
#: Share of its largest entries that a symmetric matrix may be unsymmetric by.
UNSYMMETRIC = 1e-9


@dataclass(frozen=True)
class LabelledMatrices:
    """Matrices of a model on named degrees of freedom [SI].

    Attributes:
        dofs: names of the n degrees of freedom.
        K, M: (n, n) stiffness and mass.
        C: (n, n) damping, None where none is given.
        influence: (n,) motion as the ground moves by one, None where none is given.
    """

    dofs: tuple[str, ...]
    K: np.ndarray
    M: np.ndarray
    C: np.ndarray | None = None
    influence: np.ndarray | None = None


def read_arrays(path: Path) -> tuple[dict[str, np.ndarray], tuple[str, ...] | None]:
    """Numeric arrays of a file by name, and the names of degrees of freedom (``dofs``) if any.

    Args:
        path: a ``.npz`` or ``.mat`` file, or a ``.csv`` file with one matrix, called after the
            file's name up to its ending.

    Raises:
        InputError: if it cannot be read.
    """
    readers = {".npz": _read_npz, ".mat": _read_mat, ".csv": _read_csv}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise InputError(
            f"File {path} has an unknown ending: known are {', '.join(readers)}; save it as one of "
            "them."
        )
    try:
        return reader(path)
    except InputError:
        raise
    except OSError as error:
        raise InputError(
            f"File {path} cannot be read ({error.strerror or error}); check its name."
        ) from None
    except Exception as error:  # damaged files make the libraries raise nearly anything
        reason = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        raise InputError(f"File {path} cannot be read ({reason}); save it again.") from None


def _read_npz(path: Path):
    with np.load(path, allow_pickle=False) as file:
        found = {name: file[name] for name in file.files}
    return _sorted_out(found)


def _sorted_out(found: Mapping[str, np.ndarray]):
    """Numbers apart from the names."""
    numbers = {
        n: np.asarray(a, float) for n, a in found.items() if np.asarray(a).dtype.kind in "fiub"
    }
    names = found.get("dofs")
    if names is None:
        return numbers, None
    names = np.atleast_1d(names).ravel()
    texts = [str(n.item() if isinstance(n, np.ndarray) and n.size == 1 else n) for n in names]
    return numbers, tuple(text.strip() for text in texts)


def _read_mat(path: Path):
    with path.open("rb") as file:
        head = file.read(520)
    if head[:4] == b"\x89HDF" or head[512:516] == b"\x89HDF":
        return _read_mat_hdf5(path)
    from scipy.io import loadmat

    found = {n: v for n, v in loadmat(path).items() if not n.startswith("__")}
    return _sorted_out({n: v.toarray() if hasattr(v, "toarray") else v for n, v in found.items()})


def _read_mat_hdf5(path: Path):
    """MATLAB's format 7.3 holds arrays the other way round, and texts as numbers."""
    import h5py

    with h5py.File(path, "r") as file:

        def value(item):
            kind = item.attrs.get("MATLAB_class", b"double")
            if kind == b"cell":
                return np.array([value(file[ref]).item() for ref in item[()].ravel()])
            if kind == b"char":
                return np.array(["".join(map(chr, row)) for row in item[()].T])
            return item[()].T

        sets = {n: v for n, v in file.items() if isinstance(v, h5py.Dataset)}
        return _sorted_out({name: value(item) for name, item in sets.items()})


def _read_csv(path: Path):
    """A matrix in rows of numbers; the first row, and the first column, may hold names."""
    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = [[c.strip() for c in row] for row in csv.reader(file) if any(c.strip() for c in row)]
    names = None
    if rows and not all(map(_is_float, filter(None, rows[0]))):
        names, rows = rows[0], rows[1:]
    labelled = bool(rows) and not all(_is_float(row[0]) for row in rows)
    if names and len(names) == (len(rows[0]) if rows else 0) and labelled:
        names = names[1:]
    left = [row[0] for row in rows] if labelled else None
    rows = [row[1:] for row in rows] if labelled else rows
    for number, row in enumerate(rows, 1):
        for cell in row:
            if not _is_float(cell):
                raise InputError(
                    f"File {path}, row {number} of numbers, holds {cell!r}: no number."
                )
        if len(row) != len(rows[0]):
            raise InputError(
                f"File {path}, row {number} of numbers, has {len(row)} entries, the first row "
                f"{len(rows[0])}: complete it."
            )
    if names is not None and left is not None and names != left:
        raise InputError(f"File {path} names its rows in another way than its columns.")
    names = names or left
    return {path.stem: np.array(rows, float)}, None if names is None else tuple(names)


def _is_float(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def check_matrix(matrix: np.ndarray, name: str, dofs: Sequence[str]) -> None:
    """Refuse a matrix that is not square, of the size of its names, finite and symmetric.

    Raises:
        InputError: naming it.
    """
    n = len(dofs)
    if matrix.shape != (n, n):
        got = " x ".join(map(str, matrix.shape)) or "1"
        raise InputError(
            f"Matrix {name} must be {n} x {n}, one row and column a name of `dofs`, but is {got}."
        )
    if not np.all(np.isfinite(matrix)):
        i, j = np.argwhere(~np.isfinite(matrix))[0]
        raise InputError(f"Matrix {name} holds no number at {dofs[i]}, {dofs[j]}.")
    diagonal = np.sqrt(np.abs(np.outer(np.diag(matrix), np.diag(matrix))))
    apart = np.abs(matrix - matrix.T)
    bound = UNSYMMETRIC * np.maximum(diagonal, np.maximum(np.abs(matrix), np.abs(matrix.T)))
    if np.any(apart > bound):
        i, j = np.unravel_index(np.argmax(apart - bound), apart.shape)
        raise InputError(
            f"Matrix {name} is not symmetric: {matrix[i, j]:g} at {dofs[i]}, {dofs[j]}, but "
            f"{matrix[j, i]:g} at {dofs[j]}, {dofs[i]}."
        )


def labelled(
    arrays: Mapping[str, np.ndarray], dofs: Sequence[str] | None, units: Units
) -> LabelledMatrices:
    """Checked matrices in SI.

    Args:
        arrays: K and M, maybe C and the influence vector r, by name.
        dofs: their names; those that end with ``.r`` or ``.rotation`` turn.
        units: of the numbers.

    Raises:
        InputError: naming what is missing or cannot be used.
    """
    if dofs is None:
        raise InputError("The names of the degrees of freedom are missing: give `dofs`.")
    dofs = tuple(map(dof_name, dofs))
    twice = sorted({name for name in dofs if dofs.count(name) > 1})
    if twice:
        raise InputError(f"`dofs` names {twice[0]!r} twice.")
    for name in ("K", "M"):
        if name not in arrays:
            raise InputError(f"Matrix {name} is missing: {nearest(name, arrays)}.")
    turns = [name.endswith(".rotation") for name in dofs]
    found = {}
    for name in MATRICES:
        if name in arrays:
            check_matrix(arrays[name], name, dofs)
            symmetric = (arrays[name] + arrays[name].T) / 2
            found[name] = symmetric * units.matrix_factor(name, turns)
    r = arrays.get("r")
    if r is not None:
        if r.size != len(dofs) or not np.all(np.isfinite(r)):
            raise InputError(
                f"The influence vector r must be {len(dofs)} numbers, but is {r.size}."
            )
        # Rotations per ground motion are 1/length.
        r = r.ravel() / np.where(turns, units.factor("m"), 1.0)
    return LabelledMatrices(dofs, found["K"], found["M"], found.get("C"), r)
