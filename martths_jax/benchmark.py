"""The whole benchmark, built once on the host: what stays the same during a run."""

from __future__ import annotations

from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.coupler import Coupler, build_coupler
from martths_jax.errors import argument_error
from martths_jax.plant import NOMINAL_HZ, continuous_modes, nominal_plant
from martths_jax.sensors import SensorNoise
from martths_jax.structure.experimental import (
    Quirks,
    benchmark_partition,
    consistent_partition,
    ideal_frame,
    measured_frame,
    restoring_maps,
)
from martths_jax.structure.frame import FrameGeometry, build_reference
from martths_jax.structure.integrators import INTEGRATORS
from martths_jax.structure.modal import ModalSystem
from martths_jax.structure.statespace import discretise

PARTITIONS = ("benchmark", "consistent")
#: Volts of the two valves: u [mm] / gain + offset (only monitored), and their limit.
VOLT_PER_MM = np.array([1 / (7.4921 * 1.053), 1 / (7.3907 * 1.055)])
VOLT_OFFSET = np.array([-0.0092 / 7.4921, 0.0059 / 7.3907])
VOLT_LIMIT = 3.8


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Benchmark:
    """Everything that a run needs besides controller, plants, motion and noise.

    Attributes:
        fs: sampling rate [Hz].
        numerical: numerical substructure, inputs (a_g, f_1, f_2, f_3), outputs ``OUTPUT_DOFS``.
        reference: reference structure, the same inputs and outputs.
        restoring: (3, 3, 2) taps of the restoring force, see ``restoring_maps``.
        coupler: geometry between actuators and interface.
        plant_model: nominal plant, discretised.
        plant_continuous: (A, B, C) of the nominal plant, states slot by slot.
        noise_power: power of the sensor noise that filters are designed for [mm^2 s].
        integrator, partition: names of the methods used.
    """

    fs: float = field(metadata={"static": True})
    numerical: ModalSystem
    reference: ModalSystem
    restoring: jax.Array
    coupler: Coupler
    plant_model: ModalSystem
    plant_continuous: tuple
    noise_power: float
    integrator: str = field(default="newmark", metadata={"static": True})
    partition: str = field(default="benchmark", metadata={"static": True})

    @property
    def dt(self) -> float:
        """Sample period [s]."""
        return 1.0 / self.fs

    @property
    def r_mm2(self) -> float:
        """Variance of a sample of sensor noise, R of the Kalman filter [mm^2]."""
        return self.noise_power * self.fs


def build_benchmark(
    fs: float = 1024,
    integrator: str = "newmark",
    *,
    partition: str = "benchmark",
    geometry: FrameGeometry | None = None,
    coupler: Coupler | None = None,
    quirks: Quirks | None = None,
    tolerance: float | None = None,
) -> Benchmark:
    """Build the v-maRTHS benchmark (Condori Uribe et al. 2023).

    Args:
        fs: sampling rate [Hz].
        integrator: ``newmark`` (the benchmark's), ``rk4`` (the paper's text) or ``zoh`` (exact).
        partition: ``benchmark`` takes the ideal experimental frame out of the reference;
            ``consistent`` takes out exactly the force that is fed back (for checks).
        geometry: of the reference frame; the published one by default.
        coupler: geometry of the coupler; the published one by default.
        quirks: peculiarities of the published model, all on by default.
        tolerance: of the order reduction of the structures, see ``statespace.discretise``.

    Raises:
        InputError: if fs is not positive or a name is unknown.
    """
    if not (isinstance(fs, (int, float, np.number)) and np.isfinite(fs) and fs > 0):
        raise argument_error("fs", "be a positive sampling rate (Hz)", repr(fs))
    if integrator not in INTEGRATORS:
        raise argument_error("integrator", f"be one of {sorted(INTEGRATORS)}", repr(integrator))
    if partition not in PARTITIONS:
        raise argument_error("partition", f"be one of {sorted(PARTITIONS)}", repr(partition))
    dt = 1.0 / fs
    method = INTEGRATORS[integrator]
    reference = build_reference(geometry)
    experimental = measured_frame(quirks)
    if partition == "benchmark":
        numerical = benchmark_partition(reference, ideal_frame(quirks))
    else:
        numerical = consistent_partition(reference, experimental)
    options = {} if tolerance is None else {"tolerance": tolerance}
    try:
        systems = [discretise(s, method, dt, **options) for s in (numerical, reference)]
    except ValueError as error:
        raise argument_error("fs", "suit the integrator", f"{fs:g}", str(error)) from None
    return Benchmark(
        fs=float(fs),
        numerical=systems[0],
        reference=systems[1],
        restoring=jnp.asarray(restoring_maps(experimental, dt)),
        coupler=coupler or build_coupler(),
        plant_model=nominal_plant().discretise(dt),
        plant_continuous=continuous_plant(),
        noise_power=SensorNoise().power,
        integrator=integrator,
        partition=partition,
    )


def continuous_plant() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Dense continuous (A, B, C) of the nominal plant, in the state order of ``to_dense``."""
    real, frame, real_residue, frame_residue = (
        np.asarray(x)[..., 0] for x in continuous_modes(NOMINAL_HZ[None])
    )
    A, B, C = np.zeros((8, 8)), np.zeros((8, 2)), np.zeros((2, 8))
    for j in range(2):
        at = 4 * j
        A[at, at], A[at + 1, at + 1] = real[j]
        A[at + 2 : at + 4, at + 2 : at + 4] = [
            [frame.real, -frame.imag],
            [frame.imag, frame.real],
        ]
        B[[at, at + 1, at + 2], j] = 1.0
        C[:, at : at + 2] = real_residue[:, j]
        C[:, at + 2], C[:, at + 3] = 2 * frame_residue[:, j].real, -2 * frame_residue[:, j].imag
    return A, B, C


def command_volts(command_mm: jax.Array) -> jax.Array:
    """Valve commands [V] of (2, ...) commands [mm] (benchmark's sensor calibration)."""
    shape = (2,) + (1,) * (command_mm.ndim - 1)
    return command_mm * VOLT_PER_MM.reshape(shape) + VOLT_OFFSET.reshape(shape)
