"""A problem from a file: its structure, its rig, and what follows from them."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from martths_jax.benchmark import FORCE_FROM, Benchmark
from martths_jax.control.base import Estimator
from martths_jax.errors import InputError, argument_error
from martths_jax.layout import Layout
from martths_jax.problem.base import Problem, Reading
from martths_jax.problem.file.document import Document, read_document
from martths_jax.problem.file.rig import RigData, read_rig
from martths_jax.problem.file.structure import StructureData, read_structure
from martths_jax.published import ANYWHERE
from martths_jax.rig import plants
from martths_jax.rig.specimen import LinearSpecimen
from martths_jax.runtime import check_runtime
from martths_jax.sensors import SensorNoise
from martths_jax.structure.frame import Structure
from martths_jax.structure.integrators import INTEGRATORS
from martths_jax.structure.partition import SystemMatrices
from martths_jax.structure.statespace import Ports, discretise

#: Sizes that ground acceleration, forces and moments, displacements and rotations have in a run;
#: only their ratios matter, to weigh them in the reduction.
SIZES = {"ground": 1.0, "force": 1e4, "moment": 1e3, "x": 1e-2, "r": 1e-2}


@dataclass(frozen=True)
class FileProblem:
    """What a file holds, read and checked.

    Attributes:
        path: of the file.
        structure, rig: its parts; the structure's interface in the order of the coupler's rows.
        fs: sampling rate [Hz].
        integrator: name of the method of the structures.
        sha256: of the file and of all that it names.
        files: these files, the problem file first.
    """

    path: Path
    structure: StructureData
    rig: RigData
    fs: float
    integrator: str
    sha256: str
    files: tuple[Path, ...]


def read_problem(path: Path | str) -> FileProblem:
    """Read a problem file.

    Raises:
        InputError: one that lists all faults by line.
    """
    document = read_document(path)
    root = document.root
    fs = root.number("fs", default=1024.0, above=0.0)
    integrator = root.text("integrator", tuple(sorted(INTEGRATORS)), "newmark")
    structure = read_structure(document)
    rig = None if structure is None else read_rig(document, structure)
    if structure is None:
        for key in ("actuators", "valves", "sensors", "plant", "state_space", "uncertain",
                    "correlation", "runaway_mm"):  # fmt: skip
            document.asked((), key)  # nothing is said of them while the structure is wrong
    elif rig is not None and not rig.plant.lowest_rate <= fs:
        document.fault(
            ("fs",), f"`fs` must be at least {np.ceil(rig.plant.lowest_rate):g} Hz, twice the "
            f"magnitude of the plant's fastest pole, but got {fs:g}.",
        )  # fmt: skip
    named = named_files(document)
    for file in (
        f for f in named if not f.resolve().is_relative_to(document.path.parent.resolve())
    ):
        document.fault((), f"{file} must lie in the folder of this file or below, to be kept with "
                       "results.")  # fmt: skip
    document.finish()
    assert structure is not None and rig is not None
    made = FileProblem(
        Path(path), _reordered(structure, rig.order), rig, fs, integrator,
        _digest([document.path, *named]), (document.path, *named),
    )  # fmt: skip
    build(made)  # what cannot be integrated is said now
    return made


def _reordered(structure: StructureData, order: tuple[int, ...]) -> StructureData:
    """The structure with its interface in another order."""
    order = list(order)
    own = structure.laboratory
    at = np.ix_(order, order)
    laboratory = SystemMatrices(
        tuple(own.dofs[i] for i in order), own.M[at], own.C[at], own.K[at], own.influence[order]
    )
    return replace(
        structure, laboratory=laboratory, at=structure.at[order],
        interface=tuple(structure.interface[i] for i in order),
    )  # fmt: skip


def _digest(paths: list[Path]) -> str:
    found = hashlib.sha256()
    for path in paths:
        found.update(path.name.encode() + b"\0" + path.read_bytes())
    return found.hexdigest()


def named_files(document: Document) -> list[Path]:
    """Files that a document names, in its order."""

    def texts(value):
        if isinstance(value, str):
            yield value
        elif isinstance(value, (dict, list)):
            for one in value.values() if isinstance(value, dict) else value:
                yield from texts(one)

    paths = [document.beside(text) for text in texts(document.root.data) if "." in text]
    return [path for path in dict.fromkeys(paths) if path.is_file()]


def turns(dof: str) -> bool:
    """Whether a degree of freedom is a rotation, by its name."""
    return dof.rpartition(".")[2] in ("r", "rotation")


def file_problem(path: Path | str) -> Problem:
    """The problem of a file.

    Raises:
        InputError: one that lists all faults by line.
    """
    path = Path(path)
    try:
        stamp = tuple((p.stat().st_mtime_ns, p.stat().st_size) for p in path.parent.iterdir()
                      if p.is_file())  # fmt: skip
    except OSError as error:
        raise InputError(f"Problem {path} cannot be read ({error.strerror}).") from None
    return _made(path.resolve(), stamp)


@lru_cache(maxsize=8)  # the same object each time, so that JAX knows its parts again
def _made(path: Path, stamp: tuple) -> Problem:
    made = read_problem(path)
    rig, model = made.rig, made.rig.plant
    return Problem(
        name=path.stem,
        title=f"problem {path.name}",
        paper="",
        layout=layout_of(made),
        parameters=model.uncertainty.names,
        build=partial(build, made),
        plants=lambda draws, trial, spread: plants.TransferPlants(draws, trial, model, spread),
        draw=partial(plants.draw, model),
        check=plants.check,
        readings={"values": Reading("_value", model.uncertainty.draws)},
        stored=("plant_value", "uncertain parameters of the plant", "as the file says"),
        noise=partial(_noise, len(rig.actuators)),
        settings={
            "fs": made.fs, "integrator": made.integrator, "noise_power": rig.noise_power,
            "noise_shared": rig.noise_shared, "controllers": ANYWHERE,
        },
        files=made.files,
        sha256=made.sha256,
    )  # fmt: skip


def _noise(actuators: int, power: float, shared: bool, seed: int) -> SensorNoise:
    return SensorNoise(power, shared, seed, actuators=actuators)


def layout_of(made: FileProblem) -> Layout:
    """Names and sizes of a file's problem."""
    structure = made.structure
    others = tuple(name for name in structure.outputs if name not in structure.interface)
    outputs = (*structure.interface, *others)
    return Layout(
        actuators=made.rig.actuators,
        interface=structure.interface,
        outputs=outputs,
        forces=structure.interface,
        valves=made.rig.valves,
        runaway_mm=made.rig.runaway_mm,
        units=tuple("rad" if turns(dof) else "m" for dof in outputs),
        force_units=tuple("N m" if turns(dof) else "N" for dof in structure.interface),
    )


def ports_of(structure: StructureData) -> Ports:
    """Where forces enter the numerical substructure, and what of it is looked at."""
    n, at = len(structure.reference.dofs), list(structure.at)
    rows = dict(zip(structure.outputs, structure.output_rows, strict=True))
    unit = np.eye(n)
    own = {dof: unit[i] for dof, i in zip(structure.interface, at, strict=True)}
    seen = own | {name: row for name, row in rows.items() if name not in own}
    forces = [SIZES["moment" if turns(dof) else "force"] for dof in structure.interface]
    return Ports(
        forces=unit[:, at],
        outputs=np.array(list(seen.values())),
        input_scale=np.array([SIZES["ground"], *forces]),
        output_scale=np.array([SIZES["r" if turns(dof) else "x"] for dof in seen]),
    )


def build(
    made: FileProblem,
    fs: float | None = None,
    integrator: str | None = None,
    *,
    partition: str = "benchmark",
    force_from: str | Estimator = "estimate",
    coupler: Any = None,
) -> Benchmark:
    """A file's problem as it runs; arguments as of ``build_benchmark``.

    Raises:
        InputError: for an argument that cannot be used, or a structure that cannot be integrated.
    """
    check_runtime()
    if partition != "benchmark":
        raise argument_error("partition", "be benchmark, the only one of a file", repr(partition))
    own = force_from if isinstance(force_from, Estimator) else None
    if own is None and force_from not in FORCE_FROM:
        raise argument_error("force_from", f"be one of {FORCE_FROM}", repr(force_from)[:80])
    fs, integrator = float(fs or made.fs), integrator or made.integrator
    structure, model = made.structure, made.rig.plant
    if fs < model.lowest_rate:
        raise argument_error("fs", f"be at least {np.ceil(model.lowest_rate):g} Hz", f"{fs:g}")
    dt, method = 1.0 / fs, INTEGRATORS[integrator]
    at = partial(discretise, integrator=method, dt=dt, ports=ports_of(structure))
    try:
        numerical, reference = (at(_structure(part, structure)) for part in (
            structure.numerical, structure.reference))  # fmt: skip
    except (ValueError, np.linalg.LinAlgError) as error:
        reason = f"Problem {made.path} cannot be integrated at {fs:g} Hz: {error}"
        raise InputError(reason) from None
    lab, nominal = structure.laboratory, plants.nominal(model)
    discrete = nominal.discretise(dt)
    return Benchmark(
        fs=fs,
        numerical=numerical,
        reference=reference,
        specimen=LinearSpecimen.of(lab.M, lab.C, lab.K, dt),
        coupler=made.rig.coupler if coupler is None else coupler,
        plant_model=discrete,
        plant_continuous=nominal.continuous(),
        noise_power=jnp.asarray(made.rig.noise_power),
        force_filter=own,
        force_from=force_from if own is None else "filter",
        integrator=integrator,
        partition=partition,
        layout=layout_of(made),
    )


def _structure(part: SystemMatrices, whole: StructureData) -> Structure:
    """A part under the load of the whole: -M_whole r a_g."""
    load = whole.reference.M @ whole.reference.influence
    influence = np.linalg.lstsq(part.M, load, rcond=None)[0]
    return Structure(part.M, part.C, part.K, influence)
