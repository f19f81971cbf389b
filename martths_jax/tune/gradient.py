"""Objective and its gradient over a set of plants and motions, through every sample."""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh
from jax.sharding import PartitionSpec as P

from martths_jax import loop
from martths_jax import watch as watching
from martths_jax.benchmark import Benchmark
from martths_jax.errors import argument_error
from martths_jax.motions import Motion
from martths_jax.plant import Plants
from martths_jax.runtime import check_runtime, compiler_options
from martths_jax.sensors import SensorNoise
from martths_jax.simulation import draw_noise, reference_response
from martths_jax.tune.objective import Objective
from martths_jax.tune.parameters import Tuned, tuned
from martths_jax.watch import Status

#: Cost of a gradient in runs, measured with LQG's six numbers and ADFC's two (docs/tuning.md): one
#: pass back through all samples costs the same however many numbers there are; a pass forward
#: carries the derivative of each number along, besides what all of them share.
REVERSE, FORWARD, EACH = 12.0, 4.2, 0.58
MODES = ("forward", "reverse")


def cheaper_mode(numbers: int) -> str:
    """The mode of differentiation that costs less for so many numbers."""
    return "forward" if FORWARD + EACH * numbers <= REVERSE else "reverse"


def segment_length(samples: int, window: int) -> int:
    """Largest divisor of the loop's window up to sqrt(samples): memory then grows like the root."""
    longest = max(1, min(window, math.isqrt(samples)))
    return next(n for n in range(longest, 0, -1) if window % n == 0)


class Gradient:
    """Mean objective over plants and motions, as a function of a controller's coordinates.

    Args:
        benchmark, controller: what is tuned; ``Tuned``, or a text that names the controller.
        objective: what counts.
        plants: T plants; they are split over the devices if their number allows it.
        motions: at the benchmark's rate; each length is compiled once.
        noise: sensor noise.
        free: the numbers that the slope is of; all by default.
        mode: one of ``MODES``; the cheaper one by default.

    Attributes:
        mode: that is used.
    """

    def __init__(
        self,
        benchmark: Benchmark,
        controller: Tuned | str,
        objective: Objective,
        plants: Plants,
        motions: list[Motion],
        noise: SensorNoise | None = None,
        free: Sequence[str] = (),
        mode: str | None = None,
    ):
        check_runtime()
        controller = tuned(controller) if isinstance(controller, str) else controller
        self.free = tuple(free) or tuple(controller.start)
        self.mode = mode or cheaper_mode(len(self.free))
        if self.mode not in MODES:
            raise argument_error("mode", f"be one of {', '.join(MODES)}", repr(mode))
        self.objective, self.plants = objective, plants
        trials = len(plants)
        devices = jax.local_devices()[: math.gcd(trials, jax.local_device_count())]
        observers = objective.observers(benchmark.fs)

        forward = self.mode == "forward"

        def value(moving, still, weights, plants, ground, reference, noise):
            ready = controller.build(benchmark, {**still, **moving})
            states, _ = loop.run(
                benchmark,
                ready,
                plants.discretise(benchmark.dt),
                ground,
                reference,
                noise,
                trials=plants.trial.shape[0],
                observers=observers,
                segment=0 if forward else segment_length(ground.shape[0], loop.window_of(ready)),
            )
            loss, smooth = objective.evaluate(observers, states, weights)
            lost = watching.status_of(states[-1]) >= Status.DIVERGED
            means = jax.tree.map(jnp.mean, smooth), jnp.mean(lost.astype(float))
            return jnp.mean(loss), (jnp.mean(loss), means)

        def local(*arguments):
            slope_of = jax.jacfwd if forward else jax.grad
            slope, (loss, means) = slope_of(value, has_aux=True)(*arguments)
            return jax.tree.map(lambda x: x[None], ((loss, means), slope))

        sharded = jax.shard_map(
            local,
            mesh=Mesh(np.array(devices), ("trials",)),
            in_specs=(
                P(),
                P(),
                P(),
                jax.tree.map(lambda x: P("trials") if jnp.ndim(x) else P(), plants),
                P(),
                P(),
                P(None, None, "trials"),
            ),
            out_specs=P("trials"),
            check_vma=False,
        )
        self.program = jax.jit(sharded, compiler_options=compiler_options())
        noise = noise or SensorNoise()
        self.inputs = [_inputs(benchmark, plants, motion, noise) for motion in motions]

    def of(self, objective: Objective) -> Gradient:
        """The gradient of an objective with the same indices and other weights, not compiled anew.

        Raises:
            InputError: if the indices or the penalty are others.
        """
        if objective.shape != self.objective.shape:
            raise argument_error(
                "gradient", f"be of the indices {objective.names}", self.objective.names
            )
        other = copy(self)
        other.objective = objective
        return other

    def __call__(self, point) -> tuple[float, dict[str, float], dict[str, float], float]:
        """At coordinates: objective, slope in ``free``, smooth indices, share of lost trials."""
        check_runtime()
        point = {name: jnp.asarray(value, dtype=float) for name, value in point.items()}
        moving = {name: point.pop(name) for name in self.free}
        weights = self.objective.weights
        outcomes = [
            self.program(moving, point, weights, self.plants, *each) for each in self.inputs
        ]
        mean = lambda *x: float(np.mean([np.mean(np.asarray(v)) for v in x]))  # noqa: E731
        (loss, (smooth, lost)), slope = jax.tree.map(mean, *outcomes)
        return loss, slope, smooth, lost


def _inputs(benchmark: Benchmark, plants: Plants, motion: Motion, noise: SensorNoise) -> tuple:
    """Ground acceleration, response of the reference structure and noise of a motion."""
    ground = jnp.asarray(motion.acceleration)
    drawn = draw_noise(noise, jnp.asarray(plants.trial), ground.shape[0], benchmark.fs)
    return ground, reference_response(benchmark, ground), drawn
