"""Conditional adaptive time series with a model predictive controller inside (Aguila et al. 2024).

    du   = argmin sum_{j = 1..N_p} |x(k+j) - r(k)|^2 + rho sum_{j = 0..N_c-1} |du(k+j)|^2
    u(k) = u(k-1) + du(k)

with r from the time series, and the nominal plant in differences as the model,

    dz(k+1) = A dz(k) + B du(k),   x(k+1) = x(k) + C dz(k+1),   dz(k) = z(k) - z(k-1),

so that a constant command costs nothing and a constant error is not left standing; du(k+j) = 0 from
N_c on.  z and x are the Kalman filter's.  No limit is counted on, and the optimum is a constant
gain, found once: with the predictions x(k+j) = x(k) + (F dz(k) + G dU)_j of all j stacked,

    dU = (G'G + rho I)^-1 G' (1 (r(k) - x(k)) - F dz(k)),  of which du(k) is the first block.

r is held over the horizon.  Going on along its slope, or on a parabola, feeds forward derivatives
of a signal that already is made of two, and the hybrid loop runs away.

Aguila et al. (2024), Frontiers in Built Environment 10:1384235, put a conditional adaptive time
series around a model predictive controller on this benchmark; only their abstract was at hand, so
that cost, model and horizons are choices made here.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.algebra.riccati import solve
from martths_jax.control.adaptive.arguments import check_positive, complaint
from martths_jax.control.controllers.ats_rls import RecursiveATS
from martths_jax.control.controllers.cascade import Cascade, outer_parameters
from martths_jax.control.entry import Entry, Parameter
from martths_jax.structure.modal import contract, to_dense

#: Horizon N_p of 40 ms at 1024 Hz, moves N_c, weight rho of a step of the command [-].
HORIZON, MOVES, RHO = 40, 5, 0.1
#: Longest horizon: its predictions are one matrix.
MOST_HORIZON = 400
#: Where the time series settles on the nominal plant with these: delays [s].
DELAY_S = (0.005, 0.001)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class CATSMPC(Cascade):
    """The equations above, du = K_x (r - x) - K_z dz; see ``design``.

    Attributes:
        outer: the time series.
        horizon: N_p; moves: N_c, at most as many [samples].
        rho: weight of the command's steps, a number or (T,).
        K_z: (2, 2, m) or (2, 2, m, T) gain on dz, slot by slot; K_x: (2, 2) or (2, 2, T) on the
            error; both by ``prepare``.
    """

    horizon: int = field(default=HORIZON, metadata={"static": True})
    moves: int = field(default=MOVES, metadata={"static": True})
    rho: jax.Array | float = RHO
    K_z: jax.Array | None = None
    K_x: jax.Array | None = None

    actuators_needed = 2
    name = "cats-mpc"
    shared_axes = MappingProxyType({"rho": 0, "K_z": 3, "K_x": 2})

    @classmethod
    def design(
        cls,
        benchmark,
        *,
        horizon: int = HORIZON,
        moves: int = MOVES,
        rho: float = RHO,
        delay: tuple[float, float] = DELAY_S,
        **outer,
    ) -> CATSMPC:
        """The controller.

        Args:
            benchmark: gives the sampling rate, the nominal plant and the sensor noise.
            horizon, moves [samples], rho: see the attributes.
            delay: of the inner loop, from which the time series starts [s].
            outer: further settings of ``RecursiveATS.design``.

        Raises:
            InputError: as that.
        """
        series = RecursiveATS.design(benchmark, delay=delay, **outer)
        return cls(series, int(horizon), int(moves), jnp.asarray(rho, dtype=float))

    def problems(self, benchmark):
        return [
            *super().problems(benchmark),
            *complaint(1 <= self.horizon <= MOST_HORIZON, "horizon",
                       f"be a whole number from 1 to {MOST_HORIZON}", self.horizon),
            *complaint(1 <= self.moves <= self.horizon, "moves",
                       f"be a whole number from 1 to the horizon, {self.horizon}", self.moves),
            *check_positive("rho", self.rho),
        ]  # fmt: skip

    def prepare(self, benchmark):
        A, B, C, _ = to_dense(benchmark.plant_model)
        n, rho = len(A), jnp.asarray(self.rho, dtype=float)
        gains = lambda one: predictive_gains(A, B, C, self.horizon, self.moves, one)  # noqa: E731
        K_z, K_x = jax.vmap(gains, out_axes=-1)(rho) if rho.ndim else gains(rho)
        slots = K_z.reshape(2, n // 2, 2, *rho.shape)
        return replace(super().prepare(benchmark), rho=rho, K_z=jnp.swapaxes(slots, 1, 2), K_x=K_x)

    def init_inner(self, trials):
        """z (2, m, T) and u (2, T) of the sample before."""
        return jnp.zeros((*self.K_z.shape[1:3], trials)), jnp.zeros((2, trials))

    def follow(self, state, r, seen):
        before, u = state
        u = u + contract(self.K_x, r - seen.x_hat)
        u = u - contract(self.K_z, seen.state - before, axes=2)
        return (seen.state, u), u


def predictive_gains(A, B, C, horizon: int, moves: int, rho) -> tuple[jax.Array, jax.Array]:
    """Gains of the first move, du = K_x (r - x) - K_z dz.

    Args:
        A, B, C: (n, n), (n, i), (o, n) discrete plant.
        horizon, moves: N_p, N_c.
        rho: weight of a step of the command against the error [-], a scalar; may be traced.

    Returns:
        K_z (i, n), K_x (i, o).
    """
    n, (outputs, inputs) = len(A), (len(C), B.shape[1])
    # F_j = C (A + ... + A^j); j samples after a step of the command x has gone C (I + ... +
    # A^(j-1)) B.
    power, row, free, answer = C, np.zeros((outputs, n)), [], []
    for _ in range(horizon):
        answer.append((C + row) @ B)
        power = power @ A
        row = row + power
        free.append(row)
    none = np.zeros((outputs, inputs))
    G = np.block([[answer[j - i] if i <= j else none for i in range(moves)]
                  for j in range(horizon)])  # fmt: skip
    ones = np.tile(np.eye(outputs), (horizon, 1))
    sides = G.T @ np.hstack([np.vstack(free), ones])
    K = solve(jnp.asarray(G.T @ G) + rho * jnp.eye(moves * inputs), jnp.asarray(sides))[:inputs]
    return K[:, :n], K[:, n:]


ENTRY = Entry(
    name="cats-mpc",
    controller=CATSMPC,
    make=CATSMPC.design,
    label="CATS + MPC",
    paper="after Aguila et al. 2024, Front. Built Environ. 10:1384235",
    parameters=(
        Parameter("horizon", "N_p", "prediction horizon", HORIZON, "samples", 1, MOST_HORIZON,
                  whole=True, kind="static"),
        Parameter("moves", "N_c", "steps of the command in it", MOVES, "samples", 1, MOST_HORIZON,
                  whole=True, kind="static"),
        Parameter("rho", "rho", "weight of the command's steps", RHO, "1", 0.0, above=True,
                  kind="tunable"),
        *outer_parameters(DELAY_S),
    ),
)  # fmt: skip
