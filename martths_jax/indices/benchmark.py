"""The 24 evaluation indices of the benchmark, in the order of Table 4.

J1, J4 are delays [ms]; J2, J5, J7, J8 root-mean-square errors and J3, J6, J9, J10 peak errors, in
percent of the target (Condori Uribe et al. 2023, section on evaluation criteria; the numbers behind
the underscore name the actuator or the degree of freedom).
"""

from __future__ import annotations

from collections.abc import Sequence

from martths_jax.indices.base import REFERENCE, Index, Pair, plain
from martths_jax.indices.delay import Delay
from martths_jax.indices.peak import Peak
from martths_jax.indices.rms import Rms

SOURCE = "Condori Uribe et al. 2023"
#: Names of the actuators, the rows of the strokes; and of the degrees of freedom, the rows of
#: ``num`` and of the reference's response: those of the interface and the others.
ACTUATORS, INTERFACE, STOREYS = ("1", "2"), ("4", "28"), ("2", "26", "3", "27")

_RMS, _PEAK = "rms error", "peak error"
_COMPARED = {
    "J1": ("ms", Delay(), "x_m", "x_a", "delay of the measured stroke {}"),
    "J2": ("%", Rms(), "x_m", "x_a", f"{_RMS} of the measured stroke {{}}"),
    "J3": ("%", Peak(), "x_m", "x_a", f"{_PEAK} of the measured stroke {{}}"),
    "J4": ("ms", Delay(), "x_hat", "x_a", "delay of the estimated stroke {}"),
    "J5": ("%", Rms(), "est", "num", f"{_RMS} of the estimated interface motion, DOF {{}}"),
    "J6": ("%", Peak(), "est", "num", f"{_PEAK} of the estimated interface motion, DOF {{}}"),
    "J7": ("%", Rms(), "est", REFERENCE, f"{_RMS} against the reference, interface DOF {{}}"),
    "J8": ("%", Rms(), "num", REFERENCE, f"{_RMS} against the reference, storey DOF {{}}"),
    "J9": ("%", Peak(), "est", REFERENCE, f"{_PEAK} against the reference, interface DOF {{}}"),
    "J10": ("%", Peak(), "num", REFERENCE, f"{_PEAK} against the reference, storey DOF {{}}"),
}


def indices_for(
    actuators: Sequence[str], interface: Sequence[str], storeys: Sequence[str], source: str = ""
) -> tuple[Index, ...]:
    """J1 to J10 of any structure whose actuators and degrees of freedom have these names.

    Args:
        actuators: rows of the strokes.
        interface: degrees of freedom that they move, the first rows of ``num``.
        storeys: the rows after them.
        source: where the indices are defined.
    """
    places = {
        "stroke": {name: row for row, name in enumerate(actuators)},
        "interface": {name: row for row, name in enumerate(interface)},
        "storey": {name: row for row, name in enumerate(storeys, len(interface))},
    }
    found = []
    for group, (unit, kind, value, target, label) in _COMPARED.items():
        where = next(place for place in places if place in label)
        for name, row in places[where].items():
            pair = Pair.of(value, target, row)
            found.append(
                Index(f"{group}_{plain(name)}", unit, kind, pair, label.format(name), source)
            )
    return tuple(found)


INDICES = indices_for(ACTUATORS, INTERFACE, STOREYS, SOURCE)
NAMES = tuple(index.name for index in INDICES)
