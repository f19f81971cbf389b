"""The uniaxial benchmark's plant: one servo-hydraulic actuator that pushes the specimen.

    valve                 a1 b0 / (s^2 + b1 s + b2)
    actuator              1 / (s + a3), with a2 s fed back from the specimen's motion
    specimen              S(s) = 1 / (m s^2 + c s + k)
    stroke by command     G(s) = a1 b0 S / ((s^2 + b1 s + b2) (s + a3 + a2 s S) + a1 b0 S)

(Silva et al. 2020), where the command, times a gain that is one in the text, is compared with the
stroke.  Multiplied by the specimen's polynomial, G has five poles.  The force is that of the drawn
specimen, (m s^2 + c s + k) G, another output of the same states.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from martths_jax.rig.dynamics import Written
from martths_jax.rig.model import PlantModel
from martths_jax.rig.uncertainty import Uncertainty

MM = 1e3  # mm per m
OUTPUTS = ("stroke", "force")
UNITS = ("mm", "N")


@dataclass(frozen=True)
class Loop:
    """Fixed numbers of actuator and specimen, and what they make of the uncertain ones.

    Attributes:
        a1b0: a1 b0, gain of valve and actuator [N/(m s^3)].
        a2: feedback of the specimen's velocity [N/m].
        b2: nominal b2 of the valve [1/s^2].
        mass: m of the specimen [kg].
        damping: c of the specimen [N s/m].
        stiffness: nominal k of the specimen [N/m].
        gain: g on the command [-].
    """

    a1b0: float = 2.13e13
    a2: float = 4.23e6
    b2: float = 1e5
    mass: float = 29.1
    damping: float = 114.6
    stiffness: float = 1.19e6
    gain: float = 1.0

    def __call__(self, parameters: dict):
        """Numerators of stroke [mm/mm] and force [N/mm] by the command, and their denominator.

        Args:
            parameters: (T,) values of the uncertain numbers.
        """
        a3, b1, b2, k = (parameters[name] for name in ("a3", "b1", "b2", "k_e"))
        m, c = self.mass, self.damping
        # The actuator with its specimen: (s + a3) (m s^2 + c s + k) + a2 s.
        own = (m, c + m * a3, k + c * a3 + self.a2, k * a3)
        denominator = (
            own[0],
            own[1] + b1 * own[0],
            own[2] + b1 * own[1] + b2 * own[0],
            own[3] + b1 * own[2] + b2 * own[1],
            b1 * own[3] + b2 * own[2],
            b2 * own[3] + self.a1b0,
        )
        pushed = self.gain * self.a1b0
        per_mm = pushed / MM
        stroke, force = (pushed,), (per_mm * m, per_mm * c, per_mm * k)
        return [[stroke], [force]], [denominator]


#: Numbers of the benchmark's publication, and those of its code, which its table is printed by.
PUBLISHED = Loop()
PACKAGE = Loop(
    a1b0=2.1283e13, a2=4.2297e6, b2=9.9976e4, mass=29.13,
    damping=2 * 0.0097 * math.sqrt(29.13 * 1.19e6), gain=1.0261,
)  # fmt: skip


def uncertainty(loop: Loop) -> Uncertainty:
    """What differs from plant to plant, by its standard deviation in its own unit."""
    return Uncertainty(
        names=("a3", "b1", "b2", "k_e"),
        nominal=(3.3, 425.0, loop.b2, loop.stiffness),
        sigmas=(1.3, 3.3, 3.31e3, 5e4),
        units=("1/s", "1/s", "1/s^2", "N/m"),
        kinds="absolute",
    )


def plant_model(loop: Loop = PUBLISHED) -> PlantModel:
    """Model of the plant: command [mm] in, ``OUTPUTS`` out.

    Args:
        loop: fixed numbers and nominal values.
    """
    return PlantModel(Written(loop, outputs=2, inputs=1), uncertainty(loop))
