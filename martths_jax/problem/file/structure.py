"""The structure of a problem file: reference, numerical and laboratory part, by names."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from martths_jax.errors import InputError
from martths_jax.problem.file.building import Building
from martths_jax.problem.file.damping import read_damping
from martths_jax.problem.file.data import StructureData
from martths_jax.problem.file.document import Document, read_document
from martths_jax.problem.file.sources import Whole, read_frame_form, read_matrices_form
from martths_jax.structure.assembly import check_definite
from martths_jax.structure.modes import massive, natural_modes
from martths_jax.structure.partition import negative_directions, separate


def read_structure(document: Document) -> StructureData | None:
    """Read the structural tables of a document.

    Returns:
        None where something is wrong: ``document.finish`` then says what.
    """
    root = document.root
    condensing = root.flag("condense", True)
    rules = {}
    for key in ("damping", "laboratory_damping"):
        table = root.table(key)
        rules[key] = read_damping(table) if table else None
    matrices = root.table("matrices")
    whole = read_matrices_form(document, matrices) if matrices else read_frame_form(document)
    known = whole is not None or matrices is None
    if known and "damping" not in root.data and (whole is None or whole.C is None):
        root.fault(None, 'The damping is missing: write [damping] with kind = "rayleigh", say.')
    elif rules["damping"] and whole and whole.C is not None:
        root.fault("damping", "Damping is given twice: by the matrix C and by [damping].")
    if whole is None or not document.good:
        return None
    with document.blame(whole.place):
        check_definite(whole.K, whole.dofs)
        _check_mass(whole)
    if not document.good:
        return None
    with document.blame(("laboratory",) if matrices is None else ("laboratory_matrices",)):
        separation = separate(whole.dofs, whole.M, whole.K, whole.part, whole.interface, whole.held)
    if not document.good:
        return None
    return Building(document, whole, separation, condensing).data(**rules)


def load_structure(path: Path | str) -> StructureData:
    """The structure of a file that holds nothing else.

    Raises:
        InputError: one that lists all faults by line.
    """
    document = read_document(path)
    data = read_structure(document)
    document.finish()
    assert data is not None
    return data


def _check_mass(whole: Whole) -> None:
    """Refuse a mass that is negative in some motion, or none at all."""
    size = np.diag(np.abs(np.diag(whole.M)))
    negative = negative_directions(whole.M, size, whole.dofs)
    if negative:
        raise InputError(f"The mass is negative in the motion of {', '.join(negative)}.")
    if not massive(whole.M).size:
        raise InputError("Nothing has mass: M is zero.")
    with np.errstate(invalid="ignore"):
        omega = natural_modes(whole.M, whole.K)[0]
    if not np.all(omega > 0):
        raise InputError(
            "The natural frequencies cannot be found: stiffnesses or masses are too far apart; "
            "check their units."
        )
