"""Gradient of a whole run on the full El Centro: three ways to it, its memory and its cost.

    python experiments/tune_lqg/gradient_check.py lqg --records DIR
    python experiments/tune_lqg/gradient_check.py adfc --records DIR

Reverse mode with segmented checkpointing against central finite differences and forward mode, for
every number that can be tuned.  Cost is told relative to the objective's own run without a
gradient, in the same process, the best of three.  Writes results/gradient_NAME.json.
"""

from __future__ import annotations

import json
import resource
import time

import jax
import jax.numpy as jnp
import numpy as np
from common import RESULTS, SEED, TUNED_ON, arguments, motion

from martths_jax import build_benchmark, draw_plants, loop
from martths_jax.runtime import compiler_options
from martths_jax.sensors import SensorNoise
from martths_jax.simulation import draw_noise, reference_response
from martths_jax.tune import Objective
from martths_jax.tune.gradient import segment_length
from martths_jax.tune.parameters import tuned

STEP = 1e-4  # of the finite differences [decades]


def main() -> None:
    chosen = arguments(__doc__, controller=str, plants=16)
    kind, objective = chosen.controller, Objective.parse("j2+j5+j8")
    benchmark, plants = build_benchmark(), draw_plants(chosen.plants, SEED)
    ground = jnp.asarray(motion(TUNED_ON, chosen.records).acceleration)
    observers = objective.observers(benchmark.fs)
    noise = draw_noise(SensorNoise(seed=SEED), jnp.asarray(plants.trial), ground.size, benchmark.fs)
    controller = tuned(kind)
    start = controller.coordinates(controller.start)
    names, x = tuple(start), jnp.array(list(start.values()))
    inputs = (plants, ground, reference_response(benchmark, ground), noise)

    def value(x, plants, ground, reference, noise, segment=0):
        ready = controller.build(benchmark, dict(zip(names, x, strict=True)))
        states, _ = loop.run(
            benchmark, ready, plants.discretise(benchmark.dt), ground, reference, noise,
            trials=len(plants), observers=observers, segment=segment,
        )  # fmt: skip
        return jnp.mean(objective.evaluate(observers, states)[0])

    def reverse(x, *inputs):
        segment = segment_length(ground.size, 1024)
        return jax.value_and_grad(lambda x: value(x, *inputs, segment))(x)

    def forward(x, *inputs):
        return jax.jacfwd(lambda x: value(x, *inputs))(x)

    report = {"controller": kind, "samples": int(ground.size), "plants": chosen.plants}
    run, report["run"] = compiled(value, x, *inputs)
    by_forward, report["forward mode, all numbers"] = compiled(forward, x, *inputs)
    by_reverse, report["reverse mode, all numbers"] = compiled(reverse, x, *inputs)
    slopes = {
        "forward mode": np.asarray(by_forward(x, *inputs)),
        "reverse mode": np.asarray(by_reverse(x, *inputs)[1]),
    }
    for mode in slopes:
        cost = report[f"{mode}, all numbers"]["seconds"] / report["run"]["seconds"]
        report[f"{mode}, cost in runs"] = round(cost, 2)
    ends = [[float(run(x + sign * STEP * d, *inputs)) for sign in (1, -1)] for d in jnp.eye(x.size)]
    slopes["finite differences"] = np.array([(up - down) / (2 * STEP) for up, down in ends])
    report["slopes"] = {k: dict(zip(names, v.tolist(), strict=True)) for k, v in slopes.items()}
    text = json.dumps(report, indent=1) + "\n"
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / f"gradient_{kind}.json").write_text(text)
    print(text)


def compiled(function, *inputs):
    """The compiled function, and what it costs."""
    began = time.perf_counter()
    lowered = jax.jit(function, compiler_options=compiler_options()).lower(*inputs)
    traced = time.perf_counter()
    program = lowered.compile()
    built = time.perf_counter()
    times = []
    for _ in range(3):
        began_run = time.perf_counter()
        jax.block_until_ready(program(*inputs))
        times.append(time.perf_counter() - began_run)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1000
    return program, {
        "tracing [s]": round(traced - began, 1),
        "compiling [s]": round(built - traced, 1),
        "seconds": round(min(times), 3),
        "temporary memory [MB]": round(program.memory_analysis().temp_size_in_bytes / 1e6, 1),
        "peak of the process so far [MB]": peak,
    }


if __name__ == "__main__":
    main()
