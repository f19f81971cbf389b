"""martths_jax: fast, differentiable virtual multi-axial real-time hybrid simulation on JAX.

from martths_jax import ADFC, build_benchmark, draw_plants, indices, load_motion, simulate

benchmark = build_benchmark()
motion = load_motion("elcentro-like", scale=0.4, fs=1024)
result = simulate(benchmark, ADFC(), draw_plants(1000, seed=1), motion)
print(indices(result)["J2_1"].mean())
"""

from martths_jax import runtime  # first: float64 and the devices are set before JAX starts
from martths_jax._version import __version__
from martths_jax.benchmark import Benchmark, build_benchmark
from martths_jax.control.base import (
    Controller,
    Decision,
    DelayLine,
    Estimator,
    Observation,
    Signal,
)
from martths_jax.control.compensator import Compensator
from martths_jax.control.controllers import ADFC, LQG, AdaptiveFeedforward, Passthrough
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.estimators import DirectMeasurement, KalmanFilter, design_kalman
from martths_jax.coupler import Coupler, build_coupler
from martths_jax.errors import InputError
from martths_jax.indices import indices
from martths_jax.motions import Motion, load_motion
from martths_jax.plant import (
    IdealPlants,
    Plants,
    draw_plants,
    nominal_plant,
    plant_from_draws,
    plant_from_hz,
)
from martths_jax.result import Result
from martths_jax.sensors import SensorNoise
from martths_jax.simulation import simulate
from martths_jax.structure.experimental import Quirks
from martths_jax.watch import Status

__all__ = [
    "ADFC",
    "LQG",
    "AdaptiveFeedforward",
    "Benchmark",
    "Compensator",
    "Controller",
    "Coupler",
    "Decision",
    "DelayLine",
    "DirectMeasurement",
    "Entry",
    "Estimator",
    "IdealPlants",
    "InputError",
    "KalmanFilter",
    "Motion",
    "Observation",
    "Parameter",
    "Passthrough",
    "Plants",
    "Quirks",
    "Result",
    "SensorNoise",
    "Signal",
    "Status",
    "__version__",
    "build_benchmark",
    "build_coupler",
    "design_kalman",
    "draw_plants",
    "indices",
    "load_motion",
    "nominal_plant",
    "plant_from_draws",
    "plant_from_hz",
    "runtime",
    "simulate",
]
