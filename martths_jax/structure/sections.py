"""Sections, geometry and masses of the benchmark's three-storey, three-bay steel frame.

Source: Condori Uribe et al. 2023 (Front. Built Environ. 9:1270996) and its public companion
package.  Only the published section properties are stored; every matrix is assembled from them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from martths_jax.errors import argument_error, as_numbers

INCH = 0.0254  # m
KSI = 6.894757293168361e6  # Pa


def check_positive(name: str, given, unit: str, shape: tuple = (), zero: bool = False) -> None:
    """Refuse numbers that are not finite and positive (or zero, where `zero` allows it).

    Raises:
        InputError: naming the argument.
    """
    values = as_numbers(given)
    good = values.shape == shape and np.all(np.isfinite(values) & (values >= 0))
    if not good or not (zero or np.all(values > 0)):
        counted = f"{' x '.join(map(str, shape))} numbers" if shape else "a number"
        wanted = f"be {counted} of at least zero" if zero else f"be {counted} above zero"
        unit = "" if unit == "1" else f" ({unit})"
        raise argument_error(name, wanted + unit, repr(given)[:80])


@dataclass(frozen=True)
class Section:
    """Cross-section of a Timoshenko member.

    Attributes:
        A: area [m^2]; zero for beams, whose axial force the rigid diaphragm carries.
        I: second moment of area [m^4].
        A_s: shear area [m^2]; infinite, the default, for a member that does not shear.
    """

    A: float
    I: float
    A_s: float = np.inf

    def __post_init__(self):
        check_positive("A", self.A, "m^2", zero=True)
        check_positive("I", self.I, "m^4")
        if not (isinstance(self.A_s, float) and self.A_s == np.inf):
            check_positive("A_s", self.A_s, "m^2")

    @classmethod
    def from_inches(cls, A: float, I: float, A_s: float) -> Section:
        """Section from in^2, in^4 and in^2, as steel tables print them."""
        return cls(A * INCH**2, I * INCH**4, A_s * INCH**2)


W5X16 = Section.from_inches(4.71, 21.4, 1.2024)
S3X5_7 = Section.from_inches(1.66, 2.5, 0.51)
# The built-up beams' plates are cut to fractions of an inch, so their second moments of area are
# whole multiples of 2^-11 in^4; in print they are rounded to 1.107422 and 0.27588.
BU_1 = Section.from_inches(0.0, 2268 / 2048, 0.84375)
BU_2 = Section.from_inches(0.0, 565 / 2048, 0.25)


@dataclass(frozen=True)
class FrameGeometry:
    """Geometry, sections and lumped masses of the reference frame.

    Nodes are numbered column line by column line from the ground floor up: line 1 has nodes
    1, 2, 3 (floors 1, 2, 3), line 2 has 4, 5, 6, and so on.  Node 4 is the interface node that
    the actuators move, node 7 the one they do not.

    Attributes:
        storey: storey height [m].
        bay: bay width [m].
        E: Young's modulus [Pa].
        G: shear modulus [Pa].
        column, interior_ground_column: column sections; the second stands under nodes 4 and 7.
        beam, interior_ground_beam: beam sections; the second spans from node 4 to node 7.
        pin_offset: rigid length between the moment release of the column under node 7 and that
            node [m].
        storey_mass: (3,) mass of each floor's horizontal translation [kg].
        vertical_mass: [line][floor] lumped vertical mass of each node [kg].
    """

    storey: float = 0.635
    bay: float = 0.762
    E: float = 29000 * KSI
    G: float = 29000 * KSI / 2.6
    column: Section = W5X16
    interior_ground_column: Section = S3X5_7
    beam: Section = BU_2
    interior_ground_beam: Section = BU_1
    pin_offset: float = 0.028575
    storey_mass: tuple[float, ...] = (7680.902917, 11496.007637, 11465.716956)
    vertical_mass: tuple[tuple[float, ...], ...] = field(
        default=(
            (1921.049719, 1921.049719, 1913.477049),
            (1919.401739, 3826.954099, 3819.381429),
            (1919.401739, 3826.954099, 3819.381429),
            (1921.049719, 1921.049719, 1913.477049),
        )
    )

    def __post_init__(self):
        for name, unit in (("storey", "m"), ("bay", "m"), ("E", "Pa"), ("G", "Pa")):
            check_positive(name, getattr(self, name), unit)
        for name in ("column", "interior_ground_column", "beam", "interior_ground_beam"):
            if not isinstance(getattr(self, name), Section):
                got = type(getattr(self, name)).__name__
                raise argument_error(name, "be a Section", got, "Use Section(A, I, A_s).")
        check_positive("pin_offset", self.pin_offset, "m", zero=True)
        if self.pin_offset >= self.storey:
            wanted = f"be less than a storey, {self.storey:g} m"
            raise argument_error("pin_offset", wanted, self.pin_offset)
        check_positive("storey_mass", self.storey_mass, "kg", (3,))
        check_positive("vertical_mass", self.vertical_mass, "kg", (4, 3))
