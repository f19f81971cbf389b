"""The whole benchmark, built once on the host: what stays the same during a run."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.control.base import Estimator
from martths_jax.coupler import Coupler, build_coupler
from martths_jax.errors import argument_error
from martths_jax.layout import Layout, Valves
from martths_jax.plant import (
    Plants,
    lowest_rate,
    nominal_plant,
    one_plant,
)
from martths_jax.rig.specimen import LinearSpecimen, Specimen
from martths_jax.runtime import check_runtime
from martths_jax.sensors import SensorNoise
from martths_jax.structure.experimental import (
    Quirks,
    benchmark_partition,
    consistent_partition,
    ideal_frame,
    measured_frame,
    restoring_maps,
)
from martths_jax.structure.frame import FORCE_DOFS, OUTPUT_DOFS, FrameGeometry, build_reference
from martths_jax.structure.integrators import INTEGRATORS
from martths_jax.structure.modal import ModalSystem
from martths_jax.structure.sections import check_positive
from martths_jax.structure.statespace import discretise
from martths_jax.transfer import NOMINAL_HZ, continuous_modes

PARTITIONS = ("benchmark", "consistent")
#: Strokes that the restoring force can be made from, beside those of a filter of one's own.
FORCE_FROM = ("estimate", "measurement")
#: The benchmark's names and sizes; the coupler has no position for strokes 254 mm apart, and the
#: largest stroke of the study is about a tenth of what counts as run away.
LAYOUT = Layout(
    actuators=("1", "2"),
    interface=("4", "28"),
    outputs=tuple(str(dof) for dof in OUTPUT_DOFS),
    forces=tuple(str(dof) for dof in FORCE_DOFS),
    valves=Valves(
        volt_per_mm=(1 / (7.4921 * 1.053), 1 / (7.3907 * 1.055)),
        volt_offset=(-0.0092 / 7.4921, 0.0059 / 7.3907),
        limit=3.8,
    ),
    paper="Condori Uribe et al. 2023",
    units=("m", "rad") * 3,
    force_units=("N", "N m", "N m"),
    force_labels=("storey force", "moment, node 4", "moment, node 7"),
)
#: Valve command that counts as saturated [V].
VOLT_LIMIT = LAYOUT.valves.limit


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Benchmark:
    """Everything that a run needs besides controller, plants, motion and noise.

    Attributes:
        fs: sampling rate [Hz].
        numerical: numerical substructure, inputs (a_g, f_1, f_2, f_3), outputs ``OUTPUT_DOFS``.
        reference: reference structure, the same inputs and outputs.
        specimen: what answers the interface motion with a force, see ``rig.specimen``.
        coupler: geometry between actuators and interface.
        plant_model: the plant that controllers and filters are designed for, discretised.
        plant_continuous: (A, B, C) of that plant, states slot by slot.
        noise_power: power of the sensor noise that filters are designed for [mm^2 s].
        force_filter: the force path's own ``Estimator``, where `force_from` is ``filter``.
        force_from: strokes that the restoring force is made from: the controller's ``estimate``,
            the ``measurement`` or those of the own ``filter``.
        integrator, partition: names of the methods used.
        layout: names and sizes.
    """

    fs: float = field(metadata={"static": True})
    numerical: ModalSystem
    reference: ModalSystem
    specimen: Specimen
    coupler: Any
    plant_model: ModalSystem
    plant_continuous: tuple
    noise_power: float
    force_filter: Any = None
    force_from: str = field(default="estimate", metadata={"static": True})
    integrator: str = field(default="newmark", metadata={"static": True})
    partition: str = field(default="benchmark", metadata={"static": True})
    layout: Layout = field(default=LAYOUT, metadata={"static": True})

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
    plant: Plants | None = None,
    force_from: str | Estimator = "estimate",
    tolerance: float | None = None,
) -> Benchmark:
    """Build the v-maRTHS benchmark (Condori Uribe et al. 2023).

    Args:
        fs: sampling rate [Hz].
        integrator: ``newmark`` (the benchmark's), ``rk4`` (the paper's text) or ``zoh`` (exact).
        partition: ``benchmark`` takes the ideal experimental frame out of the reference;
            ``consistent`` takes out exactly the force that is fed back (for checks).
        geometry: of the frame.  Only the published one can be run: the experimental frame, which is
            taken out of it and put back, keeps its own lengths and sections.
        coupler: geometry of the coupler; the published one by default.
        quirks: peculiarities of the published model, all on by default.
        plant: one plant, from ``plant_from_hz``, which filters, LQG and ADFC's anchor are designed
            for; the benchmark's nominal plant by default.  ``simulate`` is given the plants that
            run, such as ``draw_plants(1000, around=plant)``.
        force_from: what the force of the experimental frame is made from, and so what ``x_hat`` and
            ``est`` are in the results: the strokes that the controller's estimator gives
            (``estimate``, as the published loop does), those measured (``measurement``), or those
            of an estimator of the force path's own, such as ``design_kalman(...)``.
        tolerance: of the order reduction of the structures, see ``statespace.discretise``.

    Raises:
        InputError: for an argument that cannot be used; an fs below what the plant's poles ask.
    """
    check_runtime()
    plant = nominal_plant() if plant is None else one_plant("plant", plant)
    _check_arguments(fs, integrator, partition, geometry, coupler, quirks, tolerance)
    _check_rate(fs, plant)
    own = _own_filter(force_from)
    dt = 1.0 / fs
    method = INTEGRATORS[integrator]
    reference = build_reference(geometry)
    experimental = measured_frame(quirks)
    if partition == "benchmark":
        numerical = benchmark_partition(reference, ideal_frame(quirks))
    else:
        numerical = consistent_partition(reference, experimental)
    if np.any(np.diag(numerical.M) < 0):
        raise argument_error(
            "quirks", "leave every floor of the numerical substructure a mass", f"{quirks}"
        )
    options = {} if tolerance is None else {"tolerance": tolerance}
    try:
        systems = [discretise(s, method, dt, **options) for s in (numerical, reference)]
    except ValueError as error:
        raise argument_error("fs", "suit the integrator", f"{fs:g}", str(error)) from None
    return Benchmark(
        fs=float(fs),
        numerical=systems[0],
        reference=systems[1],
        specimen=LinearSpecimen(jnp.asarray(restoring_maps(experimental, dt))),
        coupler=coupler or build_coupler(),
        plant_model=plant.discretise(dt),
        plant_continuous=continuous_plant(plant),
        noise_power=SensorNoise().noise_power,
        force_filter=own,
        force_from=force_from if own is None else "filter",
        integrator=integrator,
        partition=partition,
    )


def _check_arguments(fs, integrator, partition, geometry, coupler, quirks, tolerance) -> None:
    number = isinstance(fs, (int, float, np.number)) and not isinstance(fs, bool)
    if not (number and np.isfinite(fs) and fs > 0):
        raise argument_error("fs", "be a positive sampling rate (Hz)", repr(fs))
    for name, value, known in (
        ("integrator", integrator, sorted(INTEGRATORS)),
        ("partition", partition, sorted(PARTITIONS)),
    ):
        if value not in known:
            raise argument_error(name, f"be one of {known}", repr(value))
    for name, value, kind in (
        ("geometry", geometry, FrameGeometry), ("coupler", coupler, Coupler),
        ("quirks", quirks, Quirks),
    ):  # fmt: skip
        if value is not None and not isinstance(value, kind):
            raise argument_error(name, f"be a {kind.__name__} or None", repr(value)[:80])
    for name, published in vars(FrameGeometry()).items():
        given = published if geometry is None else getattr(geometry, name)
        if given != published:
            raise argument_error(
                "geometry", f"have the published {name}, {published}", f"{given}",
                "The experimental frame keeps its own lengths and sections, so another reference "
                "would be run with a part that does not belong to it; build_reference(geometry) "
                "and modes(...) take any.",
            )  # fmt: skip
    if tolerance is not None:
        check_positive("tolerance", tolerance, "1")


def _own_filter(force_from) -> Estimator | None:
    """The force path's own estimator, if `force_from` is one."""
    if isinstance(force_from, Estimator):
        return force_from
    if force_from not in FORCE_FROM:
        raise argument_error(
            "force_from", f"be one of {list(FORCE_FROM)} or an Estimator", repr(force_from)[:80]
        )
    return None


def _check_rate(fs: float, plant: Plants) -> None:
    """Refuse a sampling rate that does not resolve the plant's fastest pole."""
    least = lowest_rate(plant.parameters_hz[0])
    if fs < least:
        raise argument_error(
            "fs", f"be at least {np.ceil(least):g} Hz, twice the magnitude of the plant's fastest "
            f"pole ({least / 2:.3g} Hz)", f"{fs:g}",
        )  # fmt: skip


def continuous_plant(plant: Plants | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Dense continuous (A, B, C) of a plant (default: nominal), states as in ``to_dense``."""
    values = NOMINAL_HZ[None] if plant is None else plant.parameters_hz
    real, frame, real_residue, frame_residue = (
        np.asarray(x)[..., 0] for x in continuous_modes(values)
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
