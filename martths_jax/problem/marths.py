"""The multi-axial RTHS benchmark: a three-storey frame, two actuators, nine uncertain parameters.

Condori Uribe et al. 2023; uncertainty of Calayir, Tao & Mercan 2025, Table 2.
"""

from __future__ import annotations

import numpy as np

from martths_jax import published
from martths_jax.benchmark import LAYOUT, PARTITIONS, build_benchmark
from martths_jax.plant import PARAMETERS, SIGMA, Plants, check_plants, draw_plants
from martths_jax.problem.base import Problem, Reading
from martths_jax.transfer import HZ, NOMINAL_HZ


def _from_hz(values: np.ndarray, spread: float) -> np.ndarray:
    return (values / NOMINAL_HZ - 1) / (SIGMA * spread)


def _from_rad(values: np.ndarray, spread: float) -> np.ndarray:
    # The fifth is the factor on the frame's pole pair, which has no unit.
    return _from_hz(values / np.where(NOMINAL_HZ == 1.0, 1.0, HZ), spread)


MARTHS = Problem(
    name="marths",
    title="multi-axial real-time hybrid simulation benchmark",
    paper="Condori Uribe et al. 2023",
    layout=LAYOUT,
    parameters=PARAMETERS,
    build=build_benchmark,
    plants=Plants,
    draw=draw_plants,
    check=check_plants,
    readings={"hz": Reading("_hz", _from_hz), "rad/s": Reading("", _from_rad)},
    stored=("plant_hz", "zeros and poles of the plant; frame_pair is the factor on the pair", "Hz"),
    published=published.MARTHS,
    partitions=PARTITIONS,
)
