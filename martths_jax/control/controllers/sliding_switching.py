"""Sliding mode with a switching law in a boundary layer, and the adaptive discrete model.

    u' = -Lambda (A* X + (0, r')) - eta s - kappa sat(s / phi),   s = Lambda X

with sat(y) = y cut at -1 and 1.  Surface, X and the discrete model in front are those of
``sliding-adm``.  Unlike there the law knows r', so that on the nominal plant no motion of the
reference leads away from s = 0: it is what the model does not know that the switching term works
against, up to kappa.  Inside the layer |s| < phi it is linear, at a rate eta + kappa / phi.  It is
integrated with the rest of the law, and the command has no jumps:

    u(k) = -K z_hat(k) + K_e sum dt (r - x_hat) - Lambda_e r(k) - sum dt kappa sat(s / phi).

s(k) is of z'_hat = A z_hat(k) + B u(k-1) and e = r(k) - x_hat(k).  The lag behind a ramp is that of
s = 0, L = Lambda_e^-1 Lambda_z A^-1 B H(0)^-1.

Li and others switch around a model of second order of one actuator, in a layer of varying width;
this form for the coupled plant, with a layer that stays, is a choice of this project.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp

from martths_jax.algebra.riccati import solve
from martths_jax.control.controllers.sliding_adm import ENTRY as LINEAR
from martths_jax.control.controllers.sliding_adm import SlidingADM, ramp, surface
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.uncoupled import as_arrays
from martths_jax.structure.modal import contract

#: kappa [mm/s], phi [mm] and eta [1/s]: in the layer s returns at 70 /s.
SWITCH, LAYER, REACH = 5.0, 0.1, 20.0


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class SlidingSwitching(SlidingADM):
    """The law above on top of ``SlidingADM``.

    Attributes:
        switch: kappa [mm/s].
        layer: phi [mm].
        S_z: (2, 2, m) of z'_hat in s through z_hat, slot by slot; S_u: (2, 2) through u(k-1); S_e:
            (2, 2) of e; by ``prepare``.

    The other attributes are those of ``SlidingADM``; u(k-1) and r belong to the inner loop.
    """

    reach: jax.Array | float = REACH
    switch: jax.Array | float = SWITCH
    layer: jax.Array | float = LAYER
    S_z: jax.Array | None = None
    S_u: jax.Array | None = None
    S_e: jax.Array | None = None

    actuators_needed = 2
    name = "sliding-switching"
    shared_axes = SlidingADM.shared_axes | {"switch": 0, "layer": 0, "S_z": 3, "S_u": 2, "S_e": 2}

    @property
    def entry(self):
        return ENTRY

    @property
    def rate(self):
        return self.reach + self.switch / self.layer

    def ramp_lag(self, benchmark):
        L, (w, _) = surface(benchmark, self.e), ramp(benchmark)
        return -solve(L[:, -2:], L[:, :-2] @ w)

    def prepare(self, benchmark):
        A, B, _ = benchmark.plant_continuous
        L = surface(benchmark, self.e)
        S_z, S_u = L[:, :-2] @ A, L[:, :-2] @ B
        return replace(
            as_arrays(super().prepare(benchmark), ("switch", "layer")),
            S_z=jnp.swapaxes(S_z.reshape(2, -1, 2), 1, 2),
            S_u=S_u,
            S_e=L[:, -2:],
        )

    def init_inner(self, trials):
        """The sum of all that is integrated, and u(k-1), (2, T) each.

        One sum: two would stand still together wherever they cancel.
        """
        return (jnp.zeros((2, trials)),) * 2

    def follow(self, state, r, seen):
        summed, before = state
        error = r - seen.x_hat
        s = contract(self.S_z, seen.state, axes=2)
        s = contract(self.S_u, before, start=contract(self.S_e, error, start=s))
        switched = self.switch * jnp.clip(s / self.layer, -1.0, 1.0)
        summed = summed + seen.dt * (contract(self.K_e, error) - switched)
        u = summed - contract(self.K, seen.state, axes=2) - contract(self.S_e, r)
        return (summed, u), u


_of_linear = {p.name: p for p in LINEAR.parameters}
ENTRY = Entry(
    name="sliding-switching",
    controller=SlidingSwitching,
    label="Switching sliding mode + ADM",
    paper="after Shangguan et al. 2024 and Li et al., sliding mode with a boundary layer",
    parameters=(
        _of_linear["e"],
        replace(_of_linear["reach"], default=REACH),
        Parameter("switch", "kappa", "switching gain", SWITCH, "mm/s", 0.0),
        Parameter("layer", "phi", "width of the boundary layer", LAYER, "mm", 0.0, above=True),
        *(p for name, p in _of_linear.items() if name not in ("e", "reach")),
    ),
)
