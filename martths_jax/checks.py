"""All checks of what a user hands to ``simulate``: on the host, before anything runs."""

from __future__ import annotations

from collections.abc import Sequence

import jax
import numpy as np

from martths_jax.controllers import Controller
from martths_jax.errors import InputError, argument_error, raise_all
from martths_jax.motions import Motion
from martths_jax.sensors import SensorNoise


def check_simulation(benchmark, controller, plants, motion, noise) -> None:
    """Check the arguments of ``simulate`` against one another.

    Raises:
        InputError: listing every problem.
    """
    problems = []

    def expect(good, name, wanted, got, remedy=""):
        if not good:
            problems.append(str(argument_error(name, wanted, got, remedy)))
        return good

    if not hasattr(plants, "discretise"):
        expect(
            False, "plants", "be a batch of plants", type(plants).__name__,
            "Use draw_plants(n, seed) or plant_from_draws(draws).",
        )  # fmt: skip
    else:
        expect(len(plants) > 0, "plants", "hold at least one trial", "none")
    problems += motion_problems(motion, benchmark.fs)
    if not problems:
        problems += noise_problems(noise, len(plants), np.size(motion.acceleration))
    problems += controller.problems(benchmark)
    raise_all(problems, "The simulation cannot run")


def motion_problems(motion, fs: float) -> list[str]:
    """Sentences about a motion that cannot be simulated at `fs`."""
    if not isinstance(motion, Motion):
        return [
            str(
                argument_error(
                    "motion", "be a Motion", type(motion).__name__, "Use load_motion(...)."
                )
            )
        ]
    problems = []
    if motion.fs != fs:
        problems.append(
            str(
                argument_error(
                    "motion", f"be sampled at the benchmark's {fs:g} Hz", f"{motion.fs:g} Hz",
                    f"Load it with load_motion(..., fs={fs:g}).",
                )
            )
        )  # fmt: skip
    acceleration = motion.acceleration
    if isinstance(acceleration, jax.core.Tracer):
        return problems
    if np.ndim(acceleration) != 1 or np.size(acceleration) < 2:
        problems.append(
            str(argument_error("motion", "have (N,) samples, N >= 2", np.shape(acceleration)))
        )
    elif not np.all(np.isfinite(acceleration)):
        first = int(np.flatnonzero(~np.isfinite(acceleration))[0])
        problems.append(
            str(argument_error("motion", "be finite", f"{acceleration[first]} at sample {first}"))
        )
    return problems


def noise_problems(noise, trials: int, samples: int) -> list[str]:
    """Sentences about noise that does not fit the run."""
    if isinstance(noise, (SensorNoise, jax.core.Tracer)):
        return []
    shape = np.shape(noise)
    good = (len(shape) == 2 and shape[1] == 2) or (
        len(shape) == 3 and shape[0] == trials and shape[2] == 2
    )
    wanted = f"be a SensorNoise or an array ({samples}, 2) or ({trials}, {samples}, 2) in mm"
    if not good or shape[-2] < samples:
        return [str(argument_error("noise", wanted, f"shape {shape}"))]
    if not np.all(np.isfinite(noise)):
        return [str(argument_error("noise", "be finite", "NaN or infinity"))]
    return []


def check_sequence(controllers, trials: int) -> Sequence[Controller]:
    """A sequence of controllers, one a trial.

    Raises:
        InputError: if it is not one, or of the wrong length.
    """
    if not isinstance(controllers, (list, tuple)) or not all(
        isinstance(c, Controller) for c in controllers
    ):
        raise argument_error(
            "controller", "be a Controller or a sequence of them", type(controllers).__name__
        )
    if len(controllers) != trials:
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
