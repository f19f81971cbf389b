"""The 24 evaluation indices of the benchmark, in the order of Table 4.

J1, J4 are delays [ms]; J2, J5, J7, J8 root-mean-square errors and J3, J6, J9, J10 peak errors, in
percent of the target (Condori Uribe et al. 2023, section on evaluation criteria; the numbers behind
the underscore name the actuator or the degree of freedom).
"""

from __future__ import annotations

from martths_jax.indices.base import REFERENCE, Index, Pair
from martths_jax.indices.delay import Delay
from martths_jax.indices.peak import Peak
from martths_jax.indices.rms import Rms

SOURCE = "Condori Uribe et al. 2023"
#: Rows of ``num`` and of the reference's response by the degree of freedom.
DOFS = {"4": 0, "28": 1, "2": 2, "26": 3, "3": 4, "27": 5}
#: Rows of the strokes by the actuator.
ACTUATORS = {"1": 0, "2": 1}

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
NAMES = (
    "J1_1", "J1_2", "J2_1", "J2_2", "J3_1", "J3_2", "J4_1", "J4_2", "J5_4", "J5_28", "J6_4",
    "J6_28", "J7_4", "J7_28", "J8_2", "J8_26", "J8_3", "J8_27", "J9_4", "J9_28", "J10_2",
    "J10_26", "J10_3", "J10_27",
)  # fmt: skip


def _index(name: str) -> Index:
    group, place = name.split("_")
    unit, kind, value, target, label = _COMPARED[group]
    row = DOFS[place] if "stroke" not in label else ACTUATORS[place]
    return Index(name, unit, kind, Pair.of(value, target, row), label.format(place), SOURCE)


INDICES = tuple(map(_index, NAMES))
