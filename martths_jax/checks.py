"""All checks of what a user hands to ``simulate``: on the host, before anything runs."""

from __future__ import annotations

from collections.abc import Sequence

import jax
import numpy as np

from martths_jax.benchmark import LAYOUT, Benchmark
from martths_jax.control.adaptive.inverse import BAND_HZ
from martths_jax.control.controllers import Controller
from martths_jax.control.entry import wrong_number
from martths_jax.errors import InputError, argument_error, raise_all
from martths_jax.layout import Layout
from martths_jax.motions import Motion
from martths_jax.plant import IdealPlants, Plants
from martths_jax.resources import available_memory
from martths_jax.sensors import SensorNoise
from martths_jax.structure.modal import ModalSystem, to_dense

#: Numbers a sample and trial that ``keep=True`` stores, ADFC's coefficients among them.
KEPT_NUMBERS = 36
#: Difference of frequency responses that no draw of Table 2 comes near, see ``plant_notice`` [-].
OTHER_PLANT = 0.35
#: Plants of a batch that are looked at.
PICKED = 8
#: Part of the memory now free that kept signals may take.
MEMORY_SHARE = 0.8


def check_simulation(benchmark, controller, plants, motion, noise, keep=False, progress=None):
    """Check the arguments of ``simulate``, each by itself and against one another.

    Raises:
        InputError: listing every problem.
    """
    problems = []

    def expect(good, name, wanted, got, remedy=""):
        if not good:
            problems.append(str(argument_error(name, wanted, got, remedy)))
        return good

    whole = expect(
        isinstance(benchmark, Benchmark), "benchmark", "be a Benchmark", _kind(benchmark),
        "Use build_benchmark().",
    )  # fmt: skip
    found = plant_problems(plants)
    trials = None if found else len(plants)
    problems += found
    found = motion_problems(motion, benchmark.fs if whole else None)
    samples = None if found else int(np.size(motion.acceleration))
    problems += found
    problems += noise_problems(noise, trials, samples, benchmark.layout if whole else LAYOUT)
    problems += controller_problems(controller, benchmark if whole else None, trials)
    expect(isinstance(keep, (bool, np.bool_)), "keep", "be True or False", repr(keep))
    expect(progress is None or callable(progress), "progress", "be callable", _kind(progress))
    if keep is True and trials and samples:
        need, free = 8.0 * KEPT_NUMBERS * trials * samples, available_memory()
        expect(
            need <= MEMORY_SHARE * free, "keep", f"fit into {MEMORY_SHARE * free / 2**30:.3g} GiB",
            f"{trials} trials of {samples} samples, about {need / 2**30:.3g} GiB",
            "Keep the signals of a few trials: simulate(..., plants[:8], ..., keep=True).",
        )  # fmt: skip
    raise_all(problems, "The simulation cannot run")


def _kind(value) -> str:
    """Type of a value, or the class itself where one forgot to call it."""
    return f"the class {value.__name__}" if isinstance(value, type) else type(value).__name__


def _known(value) -> bool:
    return not isinstance(value, jax.core.Tracer)


def plant_problems(plants) -> list[str]:
    """Sentences about plants that cannot be simulated."""
    if isinstance(plants, type) or not hasattr(plants, "discretise"):
        remedy = "Use draw_plants(n, seed) or plant_from_draws(draws)."
        return [str(argument_error("plants", "be a batch of plants", _kind(plants), remedy))]
    if len(plants) == 0:
        return [str(argument_error("plants", "hold at least one trial", "none"))]
    problems = []
    if np.shape(plants.trial) != (len(plants),):
        wanted = f"hold one trial number for each of the {len(plants)} plants"
        problems.append(str(argument_error("plants", wanted, f"shape {np.shape(plants.trial)}")))
    parameters = getattr(plants, "parameters_hz", None)
    if parameters is not None and _known(parameters) and not np.all(np.isfinite(parameters)):
        row = int(np.argwhere(~np.isfinite(np.asarray(parameters)))[0][0])
        wanted = "have finite zeros and poles"
        problems.append(str(argument_error("plants", wanted, f"NaN or infinity in row {row}")))
    return problems


def plant_notice(benchmark: Benchmark, controller: Controller, plants) -> str:
    """A sentence if the plants are others than the one a controller's filter was designed for.

    The plants are compared by their frequency response up to ``BAND_HZ``.  Those that Table 2 draws
    differ from the nominal one by 4 % in the middle and 16 % at most (400 drawn), so a batch of
    which even the nearest of some plants is beyond ``OTHER_PLANT`` was drawn about another.

    Args:
        benchmark: of the run.
        controller: prepared.
        plants: T of them.

    Returns:
        the sentence, empty if there is nothing to say or the values are traced.
    """
    model = getattr(controller.estimator, "model", None)
    if not isinstance(model, ModalSystem) or model.a.shape[-1] > 1:
        return ""  # nothing was designed for a plant
    if not all(map(_known, jax.tree.leaves((model, plants)))):
        return ""
    if isinstance(plants, IdealPlants):
        apart = "IdealPlants have no dynamics"
    elif isinstance(plants, Plants):
        nearest = _nearest(plants, model, benchmark.fs)
        if nearest <= OTHER_PLANT * max(1.0, float(plants.spread)):
            return ""
        apart = f"up to {BAND_HZ:g} Hz even the nearest answers {100 * nearest:.0f} % differently"
    else:
        return ""  # a class of the user's own, whose plants are known to themselves alone
    return (
        f"The plants are others than the one that controller `{controller.name}` and its filter "
        f"were designed for: {apart}. Unless that is meant, let the benchmark know the plant: "
        "build_benchmark(plant=plant_from_hz(...)), and draw_plants(n, around=...) for others "
        "about it."
    )


def _nearest(plants: Plants, model: ModalSystem, fs: float) -> float:
    """Least difference of a few of the plants from a discrete model, relative to its response."""
    f = np.geomspace(0.25, BAND_HZ, 7)
    s = 2j * np.pi * f / fs
    A, B, C, _ = to_dense(model)
    known = C @ np.linalg.solve(np.exp(s)[:, None, None] * np.eye(len(A)) - A, B)
    few = np.linspace(0, len(plants) - 1, PICKED).round().astype(int)
    few = jax.tree.map(lambda x: np.asarray(x)[few] if np.ndim(x) else float(x), plants)
    hold = ((1 - np.exp(-s)) / s)[:, None, None, None]
    theirs = np.moveaxis(hold * few.frequency_response(f)[:, : len(known[0])], -1, 0)
    apart = np.linalg.norm(theirs - known, axis=(2, 3)) / np.linalg.norm(known, axis=(1, 2))
    return float(np.min(np.max(apart, axis=1)))


def motion_problems(motion, fs: float | None) -> list[str]:
    """Sentences about a motion that cannot be simulated at `fs` (None if that is not known)."""
    if not isinstance(motion, Motion):
        return [
            str(argument_error("motion", "be a Motion", _kind(motion), "Use load_motion(...)."))
        ]
    problems = []

    def expect(good, wanted, got, remedy=""):
        if not good:
            problems.append(str(argument_error("motion", wanted, got, remedy)))
        return good

    if fs is not None:
        expect(
            motion.fs == fs, f"be sampled at the benchmark's {fs:g} Hz", f"{motion.fs:g} Hz",
            f"Load it with load_motion(..., fs={fs:g}).",
        )  # fmt: skip
    acceleration = motion.acceleration
    if not _known(acceleration):
        return problems
    acceleration = np.asarray(acceleration)
    if not expect(acceleration.dtype.kind in "fiu", "hold real numbers", acceleration.dtype):
        return problems
    good = acceleration.ndim == 1 and acceleration.size >= 2
    if expect(good, "have (N,) samples, N >= 2", acceleration.shape):
        bad = np.flatnonzero(~np.isfinite(acceleration))
        if bad.size:
            expect(False, "be finite", f"{acceleration[bad[0]]} at sample {bad[0]}")
    return problems


def noise_problems(
    noise, trials: int | None, samples: int | None, layout: Layout = LAYOUT
) -> list[str]:
    """Sentences about noise that does not fit a run of so many trials and samples.

    A number that is not known (None), because its argument has problems of its own, fits.
    """
    if noise is None or isinstance(noise, SensorNoise) or not _known(noise):
        return []
    size = [("trials" if trials is None else trials), ("N" if samples is None else samples)]
    n = layout.plant_outputs
    units = "mm and N" if layout.load_cells else "mm"
    wanted = (
        f"be a SensorNoise or an array ({size[1]}, {n}) or ({size[0]}, {size[1]}, {n}) in {units}"
    )
    if not isinstance(noise, (np.ndarray, jax.Array)):
        return [str(argument_error("noise", wanted, _kind(noise)))]
    shape = noise.shape
    good = len(shape) in (2, 3) and shape[-1] == n
    good = good and (len(shape) == 2 or trials is None or shape[0] == trials)
    if not good or (samples is not None and shape[-2] < samples):
        return [str(argument_error("noise", wanted, f"shape {shape}"))]
    if noise.dtype.kind not in "fiu":
        return [str(argument_error("noise", "hold real numbers", noise.dtype))]
    if not np.all(np.isfinite(noise)):
        return [str(argument_error("noise", "be finite", "NaN or infinity"))]
    return []


def controller_problems(controller, benchmark, trials: int | None) -> list[str]:
    """Sentences about a controller, or a sequence with one a trial, that cannot be used."""
    if isinstance(controller, Controller):
        return wrong_number(controller, benchmark) or controller.problems(benchmark)
    if isinstance(controller, type) and issubclass(controller, Controller):
        remedy = f"Call it: {controller.__name__}(...)."
        wanted = "be a Controller or a sequence of them"
        return [str(argument_error("controller", wanted, _kind(controller), remedy))]
    try:
        check_sequence(controller, trials)
    except InputError as error:
        return [str(error)]
    problems = []
    for distinct in {id(c): c for c in controller}.values():
        problems += [text for text in distinct.problems(benchmark) if text not in problems]
    return problems


def check_sequence(controllers, trials: int | None) -> Sequence[Controller]:
    """A sequence of controllers, one a trial (any number if `trials` is None).

    Raises:
        InputError: if it is not one, or of the wrong length.
    """
    if not isinstance(controllers, (list, tuple)) or not all(
        isinstance(c, Controller) for c in controllers
    ):
        raise argument_error(
            "controller", "be a Controller or a sequence of them", _kind(controllers)
        )
    if trials is not None and len(controllers) != trials:
        raise argument_error(
            "controller", f"be one, or one for each of the {trials} trials", len(controllers)
        )
    return controllers


def check_alike(trees) -> None:
    """Controllers that share a batch must differ in numbers only.

    Raises:
        InputError: if they differ in kind or in a count that sets array shapes.
    """
    if len(set(trees)) > 1:
        raise InputError(
            "Argument `controller` must hold controllers of one kind with the same counts (such as "
            f"nb), but got {len(set(trees))} different kinds; run them separately."
        )
