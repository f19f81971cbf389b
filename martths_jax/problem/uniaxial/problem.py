"""The uniaxial real-time hybrid simulation benchmark: three storeys, one actuator (Silva 2020).

The specimen, a column of the first storey, hangs on the actuator in the plant's model, and its
force comes back from a load cell.  The order of events is that of the published code, found by
comparison with its printed table (experiments/uniaxial): the controller gets the displacement of
the numerical substructure one sample late, and the force is held from sample to sample.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from martths_jax.benchmark import Benchmark
from martths_jax.errors import argument_error
from martths_jax.layout import Layout, Valves
from martths_jax.problem.base import Problem, Reading
from martths_jax.problem.uniaxial import structure
from martths_jax.problem.uniaxial.plant import PACKAGE, Loop, plant_model
from martths_jax.problem.uniaxial.published import TABLE3
from martths_jax.rig import plants
from martths_jax.rig.direct import Direct
from martths_jax.rig.specimen import LinearSpecimen
from martths_jax.runtime import check_runtime
from martths_jax.sensors import SensorNoise
from martths_jax.structure.integrators import INTEGRATORS
from martths_jax.structure.modal import ModalSystem
from martths_jax.structure.statespace import discretise

PAPER = "Silva et al. 2020"
FS = 4096.0
#: Power of the displacement sensor's noise [mm^2 s] and of the load cell's [N^2 s].
NOISE_MM2, NOISE_N2 = 6.25e-8, 1.16e-3
#: Samples between the numerical substructure's displacement and what the controller sees of it.
TARGET_DELAY = 1
LAYOUT = Layout(
    actuators=("1",),
    interface=("1",),
    outputs=("1", "2", "3"),
    forces=("1",),
    valves=Valves(volt_per_mm=(1 / 7.89,), volt_offset=(0.0,), limit=3.8),
    load_cells=True,
    paper=PAPER,
    table="uniaxial",
)


def uniaxial(case: int, loop: Loop = PACKAGE) -> Problem:
    """A case of the benchmark.

    Args:
        case: of ``structure.CASES``.
        loop: numbers of actuator and specimen: ``PACKAGE``, those of the published code, or
            ``PUBLISHED``, those of the text.
    """
    model = plant_model(loop)
    names = model.uncertainty.names
    return Problem(
        name="uniaxial",
        title=f"uniaxial real-time hybrid simulation benchmark, case {case}",
        paper=PAPER,
        layout=LAYOUT,
        parameters=names,
        build=partial(_build, case, loop),
        plants=lambda draws, trial, spread: plants.TransferPlants(draws, trial, model, spread),
        draw=partial(plants.draw, model),
        check=plants.check,
        readings={"values": Reading("_value", model.uncertainty.draws)},
        stored=("plant_value", "uncertain parameters of the plant: a3, b1 [1/s], b2 [1/s2], "
                "k_e [N/m]", "SI"),
        noise=_noise,
        published=TABLE3[case],
        settings={
            "fs": FS, "integrator": "zoh", "force_from": "measurement", "noise_power": NOISE_MM2,
            "controllers": ("pi-lead",),
        },
    )  # fmt: skip


def _noise(power: float, shared: bool, seed: int) -> SensorNoise:
    return SensorNoise(power, shared, seed, actuators=1, load_cells=1, force_power=NOISE_N2)


def _build(
    case: int,
    loop: Loop,
    fs: float = FS,
    integrator: str = "zoh",
    *,
    partition: str = "benchmark",
    force_from: str = "measurement",
    coupler: Direct | None = None,
) -> Benchmark:
    """The benchmark as it runs; arguments as of ``build_benchmark``.

    Raises:
        InputError: for a partition that it does not have, a coupler, or a rate that is too low.
    """
    check_runtime()
    if partition != "benchmark":
        raise argument_error("partition", "be benchmark, the only one here", repr(partition))
    if coupler is not None:
        raise argument_error("coupler", "be left out: the actuator moves storey 1", repr(coupler))
    nominal = plants.nominal(plant_model(loop))
    dt, method = 1.0 / fs, INTEGRATORS[integrator]
    whole, own = structure.reference(case), structure.numerical(case, loop)
    at = partial(discretise, integrator=method, dt=dt, ports=structure.PORTS)
    A, B, C = nominal.continuous()
    discrete = _shared(nominal.discretise(dt))
    row = np.eye(1)
    return Benchmark(
        fs=float(fs),
        numerical=at(own, delay=TARGET_DELAY),
        reference=at(whole),
        specimen=LinearSpecimen.of(loop.mass * row, loop.damping * row, loop.stiffness * row, dt),
        coupler=Direct(1),
        plant_model=replace(discrete, C=discrete.C[:1]),
        plant_continuous=(A, B, C[:1]),
        noise_power=NOISE_MM2,
        force_from=force_from,
        integrator=integrator,
        partition=partition,
        layout=LAYOUT,
    )


def _shared(plant: ModalSystem) -> ModalSystem:
    """One plant of a batch of one, shared by all trials."""
    return replace(plant, B=plant.B[..., 0], C=plant.C[..., 0])
