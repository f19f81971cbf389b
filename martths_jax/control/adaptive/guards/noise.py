"""What sensor noise does to a regressor, and a fit without it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import MappingProxyType

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.algebra import least_squares as ls
from martths_jax.control.adaptive.arguments import check_shape, known, per_part
from martths_jax.control.adaptive.base import Guard

#: Samples after which the filter has forgotten a single noisy one.
REMEMBERED = 6000


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class NoiseRemoval(Guard):
    """Errors in variables: the normal matrix less what noise is expected to have added to it.

        G - N S,  S the covariance of the regressor under sensor noise alone

    Attributes:
        covariance: S [mm^2]: (n, n), or (parts, n, n); None takes it from the estimator and the
            benchmark's noise (``noise_covariance``).
    """

    covariance: jax.Array | None = None
    pairs: jax.Array | float = 0.0

    weighs = True
    shared_axes = MappingProxyType({"covariance": 3, "pairs": 0})

    def prepare(self, benchmark, controller):
        given = self.covariance
        given = noise_covariance(benchmark, controller) if given is None else given
        covariance = per_part(given, *controller.sizes)
        return replace(self, covariance=covariance, pairs=controller.fit.length)

    def problems(self, controller):
        return [
            *check_shape("covariance", self.covariance, controller.parts, ("matrix", "matrices")),
            *noise_problems("covariance", self.covariance, controller),
        ]

    def weigh(self, part, rows, last):
        return ls.weighted(rows, -self.pairs * self.covariance[part.number])


def noise_covariance(benchmark, controller, *, shared: bool = True) -> np.ndarray:
    """Covariance of a controller's regressor under sensor noise alone.

    The estimator's response to a single noisy sample, no command and no motion, goes through the
    regressor; white noise is the sum of such responses.

    Args:
        benchmark: whose noise it is.
        controller: an ``AdaptiveFeedforward`` with its estimator.
        shared: whether both sensors hear the same noise, as in the benchmark.

    Returns:
        (parts, n, n) [mm^2].
    """
    n = controller.actuators
    impulses = np.zeros((REMEMBERED, n, n))  # sample, sensor, trial
    impulses[0] = np.eye(n)
    phi = np.asarray(
        _responses(controller, jnp.asarray(impulses))
    )  # sample, stroke, regressor, sensor that was hit
    phi = phi.reshape(REMEMBERED, -1, n)
    phi = np.sum(phi, axis=2, keepdims=True) if shared else phi
    whole = benchmark.r_mm2 * np.einsum("kis,kjs->ij", phi, phi)
    n = controller.parts[0].unknowns
    blocks = [whole[i : i + n, i : i + n] for i in range(0, len(whole), n)]
    return np.stack(blocks)


@jax.jit
def _responses(controller, measured):
    """Regressors (N, m, n, T) of m measured strokes (N, m, T) at rest and without commands."""
    trials = measured.shape[-1]
    still = jnp.zeros(measured.shape[1:])

    def step(carry, measured):
        predicted, taught = carry
        state, estimate = controller.estimator.correct(predicted, measured)
        taught, _, phi = controller.taught(taught, measured, estimate)
        predicted = controller.estimator.predict(state, still)
        return (predicted, taught), jnp.stack([jnp.stack(one) for one in phi])

    start = controller.estimator.init(trials), controller.init_taught(trials)
    return jax.lax.scan(step, start, measured)[1]


def noise_problems(name: str, given, controller) -> list[str]:
    """A sentence where the noise is to be found out but differs from trial to trial."""
    q = known(controller.q)
    if given is not None or q is None or q.ndim == 0:
        return []
    return [f"Argument `{name}` must be given where q differs from trial to trial."]
