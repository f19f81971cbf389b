"""Units of length, force and mass, and the factors that bring any quantity made of them to SI.

Time is always in seconds and angles in radians, so that three units say all others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from martths_jax.errors import argument_error
from martths_jax.text import nearest, shortened

#: Metres in each unit of length.
LENGTHS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
#: Newtons in each unit of force.
FORCES = {"N": 1.0, "kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605, "kip": 4448.2216152605}
#: Kilograms in each unit of mass; those made of a force and a length stand behind.
MASSES = {"kg": 1.0, "t": 1e3, "lb": 0.45359237} | {
    f"{force} s^2/{length}": newton / metre
    for force, newton in FORCES.items()
    for length, metre in LENGTHS.items()
}
KNOWN = {"length": LENGTHS, "force": FORCES, "mass": MASSES}
#: Exponents of length, force and mass in each SI unit.
_EXPONENTS = {
    "1": (0, 0, 0), "s": (0, 0, 0), "Hz": (0, 0, 0), "rad": (0, 0, 0), "rad/s": (0, 0, 0),
    "1/s": (0, 0, 0),
    "m": (1, 0, 0), "m^2": (2, 0, 0), "m^4": (4, 0, 0), "m/s": (1, 0, 0), "m/s^2": (1, 0, 0),
    "N": (0, 1, 0), "N m": (1, 1, 0), "N/m": (-1, 1, 0), "N s/m": (-1, 1, 0), "Pa": (-2, 1, 0),
    "kg": (0, 0, 1), "kg/m": (-1, 0, 1), "kg/m^3": (-3, 0, 1), "kg m^2": (2, 0, 1),
}  # fmt: skip


@dataclass(frozen=True)
class Units:
    """Units that numbers are given in.

    Attributes:
        length, force, mass: names, keys of ``LENGTHS``, ``FORCES`` and ``MASSES``.
    """

    length: str = "m"
    force: str = "N"
    mass: str = "kg"

    def __post_init__(self):
        for name, known in KNOWN.items():
            given = getattr(self, name)
            if not isinstance(given, str) or given not in known:
                wanted = f"be a unit of {name}"
                raise argument_error(name, wanted, f"{shortened(given)}: {nearest(given, known)}")

    def factor(self, si: str) -> float:
        """What a number in these units is multiplied by to stand in an SI unit such as "Pa"."""
        length, force, mass = _EXPONENTS[si]
        return (
            LENGTHS[self.length] ** length * FORCES[self.force] ** force * MASSES[self.mass] ** mass
        )

    def matrix_factor(self, kind: str, turns) -> np.ndarray:
        """(n, n) factors of a stiffness "K", a damping "C" or a mass "M" to SI.

        Args:
            kind: "K", "C" or "M".
            turns: (n,) whether each degree of freedom is a rotation: its forces are moments.
        """
        arm = np.where(np.asarray(turns, bool), self.factor("m"), 1.0)
        return self.factor({"K": "N/m", "C": "N s/m", "M": "kg"}[kind]) * np.outer(arm, arm)
