"""Names and sizes of a problem: what the loop, its observers and what is stored go by."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import numpy as np


@dataclass(frozen=True)
class Valves:
    """The valves' commands, which are monitored: v = volt_per_mm u + volt_offset.

    Attributes:
        volt_per_mm: of each actuator [V/mm].
        volt_offset: of each actuator [V].
        limit: largest command |v| that a valve follows [V].
    """

    volt_per_mm: tuple[float, ...]
    volt_offset: tuple[float, ...]
    limit: float

    def volts(self, u: jax.Array) -> jax.Array:
        """Commands [V] of (n, ...) commands u [mm]."""
        shape = (len(self.volt_per_mm),) + (1,) * (u.ndim - 1)
        per_mm, offset = (np.array(x) for x in (self.volt_per_mm, self.volt_offset))
        return u * per_mm.reshape(shape) + offset.reshape(shape)


@dataclass(frozen=True)
class Layout:
    """Names and sizes of a problem.

    Attributes:
        actuators: names of the n actuators.
        interface: degrees of freedom that the actuators move, the first rows of `outputs`.
        outputs: rows of the numerical substructure's and of the reference's response.
        forces: where the specimen's force enters the numerical substructure.
        valves: of the actuators.
        runaway_mm: a command or stroke beyond this is a loop that has run away [mm].
        paper: where the problem, and with it its indices, is defined.
        table: name of the table of its indices, of ``indices.table.TABLES``.
        load_cells: whether the plant gives the specimen's force itself, in rows after the strokes.
        units: of the outputs; all m if there are none.
        force_units: of the forces; all N if there are none.
        force_labels: the forces in words; force and its name if there are none.
    """

    actuators: tuple[str, ...]
    interface: tuple[str, ...]
    outputs: tuple[str, ...]
    forces: tuple[str, ...]
    valves: Valves
    runaway_mm: float = 100.0
    load_cells: bool = False
    paper: str = ""
    table: str = ""
    units: tuple[str, ...] = ()
    force_units: tuple[str, ...] = ()
    force_labels: tuple[str, ...] = ()

    @property
    def output_units(self) -> tuple[str, ...]:
        """Unit of each output."""
        return self.units or ("m",) * len(self.outputs)

    @property
    def load_units(self) -> tuple[str, ...]:
        """Unit of each force."""
        return self.force_units or ("N",) * len(self.forces)

    @property
    def load_labels(self) -> tuple[str, ...]:
        """Each force in words."""
        return self.force_labels or tuple(f"force {name}" for name in self.forces)

    @property
    def inputs(self) -> int:
        """Inputs of the structures: ground acceleration, then the forces."""
        return 1 + len(self.forces)

    @property
    def plant_outputs(self) -> int:
        """Rows that the plant gives: strokes, and the forces where there are load cells."""
        return len(self.actuators) + (len(self.forces) if self.load_cells else 0)
