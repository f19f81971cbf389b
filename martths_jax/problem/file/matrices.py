"""The matrices form of a structure: K, M and C of a file, with named degrees of freedom."""

from __future__ import annotations

import numpy as np

from martths_jax.errors import InputError
from martths_jax.problem.file.table import Table
from martths_jax.structure.readers.labelled import (
    MATRICES,
    LabelledMatrices,
    labelled,
    read_arrays,
)


def read_matrices(table: Table) -> LabelledMatrices | None:
    """Matrices of a table: one `file` with all, or a file each for `K`, `M` and `C`.

    Returns:
        None where something is wrong, which is then a fault.
    """
    keys = [key for key in ("file", *MATRICES) if key in table]
    dofs = table.texts("dofs", default=None)
    r = table.numbers("influence", default=None)
    if not keys or ("file" in keys and len(keys) > 1):
        table.fault(None, "Give `file` with all matrices, or a file each for `K`, `M` and `C`.")
        return None
    arrays: dict[str, np.ndarray] = {}
    named: dict[str, tuple[str, ...]] = {}
    for key in keys:
        name = table.text(key)
        if name is None:
            return None
        try:
            found, names = read_arrays(table.document.beside(name))
        except InputError as error:
            table.fault(key, str(error))
            return None
        if key == "file":
            arrays |= {n: a for n, a in found.items() if n in (*MATRICES, "r")}
        elif key in found or len(found) == 1:
            arrays[key] = found.get(key, next(iter(found.values())))
        else:
            table.fault(key, f"File {name} holds no matrix {key}.")
            return None
        if names is not None:
            named[key] = names
    if dofs is None:
        dofs = next(iter(named.values()), None)
        odd = [key for key, names in named.items() if names != dofs]
        if odd:
            table.fault(odd[0], f"Matrix {odd[0]} has other names than {next(iter(named))}.")
            return None
    if r:
        arrays["r"] = np.array(r)
    try:
        return labelled(arrays, dofs, table.document.units)
    except InputError as error:
        table.fault(keys[0], str(error))
        return None
