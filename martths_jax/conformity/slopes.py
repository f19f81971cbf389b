"""Whether gradients go through a controller to the numbers that it lets others tune."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.conformity.report import Finding, in_words
from martths_jax.conformity.stand import Drive, Stand, drive

#: Trials that are differentiated.
TRIALS = 2
#: The program runs once, so that it is to be compiled soon rather than to run fast.
SOON = {"xla_backend_optimization_level": 0, "xla_llvm_disable_expensive_passes": True}
NAME = "gradient"


def gradient(stand: Stand) -> Finding:
    """Reverse-mode slope of the mean squared command in each number that can be tuned."""
    values = _values(stand)
    if not values:
        return Finding(NAME, None, None, "Its entry declares no parameter of the kind tunable.")
    if missing := [name for name, value in values.items() if value is None]:
        return Finding(
            NAME, None, None, f"Its entry gives {', '.join(missing)} no default to start from."
        )
    fixed = {n: v for n, v in stand.settings.items() if n not in values}

    def build(numbers):
        return stand.entry.build_traced(stand.benchmark, **numbers, **fixed)

    def cost(numbers, x_a, x_m):
        controller = build(numbers)
        start = Drive(stand.benchmark.dt).start(controller, TRIALS)
        u, _ = drive(controller, start, x_a, x_m, stand.benchmark.dt)
        return jnp.mean(u**2)

    numbers = {name: jnp.asarray(value, dtype=float) for name, value in values.items()}
    try:
        jax.eval_shape(build, numbers)
    except Exception as error:  # the user's code may raise anything
        return Finding(
            NAME, False, None,
            f"It cannot be made of traced {', '.join(values)}: {in_words(error)}; let its class "
            "and `prepare` take them as JAX's arrays, or give the entry `traced`.",
        )  # fmt: skip
    strokes = [jnp.asarray(x[..., :TRIALS]) for x in stand.strokes]
    slope = _compiled(jax.grad(cost), numbers, *strokes)(numbers, *strokes)
    bad = [name for name, x in slope.items() if not np.isfinite(x)]
    if bad:
        return Finding(
            NAME, False, len(bad),
            f"The gradient in {', '.join(bad)} is not finite; roots, quotients and powers that "
            "jnp.where leaves out still have slopes: give them a harmless argument there.",
            f"of {len(slope)} not finite",
        )  # fmt: skip
    return Finding(
        NAME, True, 0, f"The gradient in {', '.join(slope)} is finite.",
        f"of {len(slope)} not finite",
    )  # fmt: skip


def _compiled(function, *arguments):
    """A function, compiled as soon as can be."""
    lowered = jax.jit(function).lower(*arguments)
    try:
        return lowered.compile(SOON)
    except jax.errors.JaxRuntimeError:  # options that this JAX does not know
        return lowered.compile()


def _values(stand: Stand) -> dict:
    """Where the numbers that can be tuned stand: as given, as the object has them, by default."""
    found = {}
    for name, parameter in stand.entry.tunable.items():
        own = getattr(stand.made, name, None)
        value = parameter.default if own is None or np.ndim(own) else own
        found[name] = stand.settings.get(name, value)
    return found
