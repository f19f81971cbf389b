"""The plants of a problem file: transfer functions or a state space, and what of them is uncertain.

A number of a plant is a number, the name of an uncertain parameter, or "NAME * number"; a root may
also be {re = ..., im = ...} for a conjugate pair.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from martths_jax.errors import InputError
from martths_jax.problem.file.document import Document
from martths_jax.problem.file.table import Table, is_number
from martths_jax.rig.dynamics import Dynamics, TransferMatrix
from martths_jax.rig.entries import GAINS, UNITS, Coefficients, ZerosPoles
from martths_jax.rig.model import PlantModel
from martths_jax.rig.numbers import Scaled
from martths_jax.rig.statespace import StateSpace
from martths_jax.rig.uncertainty import DISTRIBUTIONS, KINDS, Uncertainty

_SCALED = re.compile(r"([A-Za-z_]\w*)\s*\*\s*([-+0-9.eE]+)")


def read_plant(document: Document, actuators: tuple[str, ...]) -> PlantModel | None:
    """Read [[plant]], [state_space] and [uncertain].

    Args:
        document: the file.
        actuators: their names, inputs and outputs of the plant.

    Returns:
        None where something is wrong: ``document.finish`` then says what.
    """
    root = document.root
    entries, space = root.entries("plant"), root.table("state_space")
    uncertainty = _read_uncertainty(root)
    if bool(entries) == bool(space):
        told = "is missing: write a [[plant]] for each transfer function, or [state_space]"
        twice = "is given twice: by [[plant]] and by [state_space]"
        root.fault("plant" if entries else None, f"The plant {twice if entries else told}.")
        return None
    dynamics = _read_entries(entries, actuators) if entries else _read_space(space, actuators)
    if dynamics is None or uncertainty is None or not document.good:
        return None
    with document.blame(("plant", 0) if entries else ("state_space",)):
        return PlantModel(dynamics, uncertainty)
    return None


def _read_entries(tables: list[Table], actuators: tuple[str, ...]) -> Dynamics | None:
    n = len(actuators)
    found: list[list] = [[None] * n for _ in range(n)]
    for table in tables:
        output, inward = (table.text(key, known=actuators) for key in ("output", "input"))
        entry = _read_entry(table)
        if None in (output, inward, entry):
            continue
        i, j = actuators.index(output), actuators.index(inward)
        if found[i][j] is not None:
            table.fault(None, f"A second plant leads from {inward} to {output}.")
        found[i][j] = entry
    if not tables[0].document.good:
        return None
    with tables[0].document.blame(tables[0].path):
        return TransferMatrix(tuple(map(tuple, found)))
    return None


def _read_entry(table: Table) -> ZerosPoles | Coefficients | None:
    if "numerator" in table or "denominator" in table:
        sides = [_numbers(table, key) for key in ("numerator", "denominator")]
        if None in sides:
            return None
        with table.document.blame(table.path):
            return Coefficients(*sides)
        return None
    zeros, poles = _numbers(table, "zeros", ()), _numbers(table, "poles")
    gain = _number(table, "gain", table.data.get("gain")) if "gain" in table else None
    if gain is None:
        table.wrong("gain", "be a number or the name of an uncertain parameter")
    unit, kind = table.text("unit", tuple(UNITS), "Hz"), table.text("gain_as", GAINS, "dc")
    if None in (zeros, poles, gain, unit, kind):
        return None
    with table.document.blame(table.path):
        return ZerosPoles(zeros, poles, gain, gain_as=kind, unit=unit)
    return None


_NEEDED = object()


def _numbers(table: Table, key: str, default=_NEEDED) -> tuple | None:
    """A list of plant's numbers; None where it is wrong."""
    if key not in table and default is not _NEEDED:
        return default
    given = table.data.get(key)
    if key not in table or not isinstance(given, list):
        table.wrong(key, "be a list of numbers and names of uncertain parameters")
        return None
    found = [_number(table, key, one) for one in given]
    return None if None in found else tuple(found)


def _number(table: Table, key: str, given):
    """A plant's number; None where it is wrong."""
    if is_number(given):
        return float(given)
    if isinstance(given, str) and (scaled := _SCALED.fullmatch(given.strip())):
        return Scaled(scaled[1], float(scaled[2]))
    if isinstance(given, str) and given:
        return given
    if isinstance(given, dict) and set(given) <= {"re", "im", "by"} and "im" in given:
        value = complex(given.get("re", 0.0), given["im"])
        return Scaled(given["by"], value) if "by" in given else value
    table.fault(key, f"`{key}` holds {given!r:.60}, which is no number and no name.")
    return None


def _read_space(table: Table, actuators: tuple[str, ...]) -> Dynamics | None:
    """A state space, from lists or a file of arrays; strokes [mm] of commands [mm]."""
    n = len(actuators)
    if "file" in table:
        name = table.text("file")
        matrices = None if name is None else _arrays(table, name)
    else:
        matrices = [_matrix(table, key) for key in "ABC"]
    if matrices is None or any(one is None for one in matrices):
        return None
    with table.document.blame(table.path):
        found = StateSpace(*matrices)
        if found.shape != (n, n):
            raise InputError(f"The state space is {found.shape[0]} x {found.shape[1]}, but there "
                             f"are {n} actuators.")  # fmt: skip
        return found
    return None


def _matrix(table: Table, key: str):
    rows = table.data.get(key)
    if key not in table or not isinstance(rows, list) or not all(isinstance(r, list) for r in rows):
        table.wrong(key, "be a list of rows of numbers")
        return None
    found = [[_number(table, key, one) for one in row] for row in rows]
    return None if any(None in row for row in found) else found


def _arrays(table: Table, name: str):
    """A, B and C of a .npz or .mat file."""
    path = table.document.beside(name)
    try:
        held = _load(path)
    except Exception as error:  # a damaged file makes its readers raise nearly anything
        table.fault("file", f"{path} cannot be read: {str(error).splitlines()[0][:80]}.")
        return None
    missing = [key for key in "ABC" if key not in held]
    if missing:
        table.fault("file", f"{path} does not hold {', '.join(missing)}.")
        return None
    return [np.atleast_2d(np.asarray(held[key], dtype=float)).tolist() for key in "ABC"]


def _load(path: Path) -> dict:
    if path.suffix == ".npz":
        with np.load(path, allow_pickle=False) as file:
            return {key: file[key] for key in file.files}
    from scipy.io import loadmat

    return loadmat(path)


def _read_uncertainty(root: Table) -> Uncertainty | None:
    table = root.table("uncertain")
    if table is None:
        return Uncertainty()
    names = table.keys()
    rows = [table.table(name) for name in names]
    if any(row is None for row in rows):
        return None
    numbers = [(row.number("nominal"), row.number("sigma", least=0.0)) for row in rows]
    words = [
        (row.text("unit", default="1"), row.text("kind", KINDS, "relative"),
         row.text("distribution", DISTRIBUTIONS, "normal"))
        for row in rows
    ]  # fmt: skip
    correlation = _read_correlation(root, names)
    if not root.document.good or not names:
        return None if not root.document.good else Uncertainty()
    nominal, sigmas = zip(*numbers, strict=True)
    units, kinds, distributions = zip(*words, strict=True)
    with root.document.blame(("correlation",) if correlation else ("uncertain",)):
        return Uncertainty(names, nominal, sigmas, units, kinds, distributions, correlation)
    return None


def _read_correlation(root: Table, names: tuple[str, ...]):
    """Rows of the correlation matrix from [[correlation]] between = [a, b], value = r."""
    matrix = np.eye(len(names))
    tables = root.entries("correlation")
    for table in tables:
        pair = table.texts("between", known=names)
        value = table.number("value")
        if not pair or len(pair) != 2:
            table.wrong("between", "name two uncertain parameters")
            continue
        i, j = (names.index(one) for one in pair)
        matrix[i, j] = matrix[j, i] = value
    return tuple(map(tuple, matrix.tolist())) if tables else None
