"""What the structural half of a problem file gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from martths_jax.structure.partition import SystemMatrices


@dataclass(frozen=True)
class DrawnMember:
    """A member as pictures need it.

    Attributes:
        name: of it.
        start, end: places (x, y) of its nodes [m].
        laboratory: whether it stands in the laboratory.
    """

    name: str
    start: tuple[float, float]
    end: tuple[float, float]
    laboratory: bool


@dataclass(frozen=True)
class StructureData:
    """A structure and its partition.

    The equation of motion of the reference is M a + C v + K x = -M r a_g with r its influence
    vector.  The numerical substructure has the same load; the laboratory part answers with
    f = M_L a + C_L v + K_L x on the interface, which counts on the left side.

    Attributes:
        reference: the whole structure.
        numerical: without the laboratory part, on the same degrees of freedom.
        laboratory: the laboratory part on the interface alone.
        interface: names of the degrees of freedom that actuators move.
        at: (b,) where they stand among the reference's.
        outputs: names of what is looked at.
        output_rows: (k, n) outputs per degree of freedom of the reference.
        nodes: name -> place (x, y) [m]; empty for matrices.
        members: for pictures; empty for matrices.
        supports: node -> directions that are held.
        notes: sentences about what was condensed or decided on the way.
    """

    reference: SystemMatrices
    numerical: SystemMatrices
    laboratory: SystemMatrices
    interface: tuple[str, ...]
    at: np.ndarray
    outputs: tuple[str, ...]
    output_rows: np.ndarray
    nodes: Mapping[str, tuple[float, float]]
    members: tuple[DrawnMember, ...]
    supports: Mapping[str, tuple[str, ...]]
    notes: tuple[str, ...]
