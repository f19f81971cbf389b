"""Response of the whole structure: what a hybrid simulation should come to.

For a linear specimen, and one that hangs on the plant, it is that of the reference structure.  Any
other specimen is put into the loop itself: numerical substructure and specimen step together,
without actuators, sensors and delay,

    q(k) = S y(k),  y(k) = C x(k) + D (a_g(k), -f(k)),  f(k) = specimen(q(k), q(k-1), q(k-2))

with S the interface's rows, solved for q(k) at every sample by Newton's method.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.benchmark import Benchmark
from martths_jax.errors import InputError
from martths_jax.rig.specimen import History, LinearSpecimen
from martths_jax.structure.modal import advance, output, respond

#: Newton steps a sample, and how far another may still go, relative to the largest motion.
STEPS, LEFT = 8, 1e-9


def reference_response(benchmark: Benchmark, acceleration: jax.Array) -> jax.Array:
    """(N, o) response of the whole structure to (N,) ground acceleration [m/s^2].

    Args:
        benchmark: whose structure and specimen.
        acceleration: of the ground.

    Raises:
        InputError: where the specimen's force leaves no solution, or none that is found.
    """
    if isinstance(benchmark.specimen, LinearSpecimen) or benchmark.layout.load_cells:
        load = jnp.zeros((acceleration.shape[0], benchmark.layout.inputs))
        return respond(benchmark.reference, load.at[:, 0].set(acceleration))
    response, left = _together(benchmark, jnp.asarray(acceleration))
    if not isinstance(left, jax.core.Tracer):
        _check(np.asarray(response), np.asarray(left), benchmark.fs, type(benchmark.specimen))
    return response


@jax.jit
def _together(benchmark: Benchmark, acceleration: jax.Array):
    """Response (N, o), and how far another step would go at every sample (N,) [m, rad]."""
    system, specimen, dt = benchmark.numerical, benchmark.specimen, benchmark.dt
    d, forces = len(benchmark.layout.interface), len(benchmark.layout.forces)
    direct = jnp.zeros((d, forces)) if system.D is None else system.D[:d, 1:]

    def sample(carry, inputs):
        x, state, before = carry
        k, ground = inputs
        free = output(system, x, [ground, *jnp.zeros((forces, 1))])[:d, 0]

        def force_of(q):
            now = q[:, None]
            history = History(now, jnp.where(k == 0, now, before))
            after, force = specimen.step(state, history, dt)
            return force[:, 0], (after, history)

        def left(q):
            return q - free + direct @ force_of(q)[0]

        def missing(q):
            return jnp.linalg.solve(jax.jacfwd(left)(q), left(q))

        q = jax.lax.fori_loop(0, STEPS, lambda _, q: q - missing(q), free)
        force, (after, history) = force_of(q)
        load = [ground, *-force[:, None]]
        y = output(system, x, load)[:, 0]
        carry = advance(system, x, load), after, history.moved()
        return carry, (y, jnp.max(jnp.abs(missing(q))))

    rest = jnp.zeros((*system.a.shape[:2], 1)), specimen.init(1), jnp.zeros((2, d, 1))
    numbers = jnp.arange(acceleration.shape[0])
    return jax.lax.scan(sample, rest, (numbers, acceleration))[1]


def _check(response: np.ndarray, left: np.ndarray, fs: float, kind: type) -> None:
    size = np.max(np.abs(response), initial=0.0)
    bad = np.flatnonzero(~(left <= LEFT * size))
    if bad.size:
        raise InputError(
            f"The reference response with the specimen {kind.__name__} cannot be found: at sample "
            f"{bad[0]} ({bad[0] / fs:.3f} s) another step of Newton's method goes "
            f"{left[bad[0]]:.3g} m, wanted at most {LEFT:g} of the largest motion ({size:.3g} m); "
            "raise fs, or make the specimen's force a smooth function of its motion."
        )
