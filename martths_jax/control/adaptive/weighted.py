"""Least squares over the last N_b samples, of which some count less or not at all."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType

import jax
import jax.numpy as jnp

from martths_jax.algebra import least_squares as ls
from martths_jax.control.adaptive.arguments import complaint, known
from martths_jax.control.adaptive.base import Fitted
from martths_jax.control.adaptive.window import Window


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class WeightedWindow(Window):
    """C = (sum w phi phi')^-1 sum w phi u' over the last N_b pairs, w = mu^age or nought.

    A pair enters with weight 1, fades by mu a sample and leaves with mu^N_b, so that a window with
    mu < 1 forgets softly and yet wholly.  With ``every`` = m only each m-th pair counts.

    Attributes:
        nb, no, solver: as of ``Window``; `nb` counts samples, taken or not.
        forgetting: factor mu a sample, above 0 and at most 1.
        every: m; must divide `nb`, so that a pair that leaves is one that was taken.
    """

    forgetting: jax.Array | float = 1.0
    every: int = field(default=1, metadata={"static": True})

    shared_axes = MappingProxyType({"no": 0, "forgetting": 0})

    @property
    def length(self):
        """Sum of the weights of a full window, that of one number at a time."""
        ages = jnp.arange(0, self.nb, self.every, dtype=float)
        mu = jnp.asarray(self.forgetting, dtype=float)
        return jnp.sum(mu[..., None] ** ages.reshape((1,) * mu.ndim + (-1,)), axis=-1)

    def prepare(self, benchmark, controller):
        forgetting = jnp.asarray(self.forgetting, dtype=float)
        return replace(super().prepare(benchmark, controller), forgetting=forgetting)

    def problems(self, controller):
        found = super().problems(controller)
        if found:
            return found
        mu, unknowns = known(self.forgetting), controller.parts[0].unknowns
        whole = type(self.every) is int and self.every >= 1 and self.nb % self.every == 0
        found = complaint(whole, "every", f"be a whole divisor of nb = {self.nb}", self.every)
        if not found:
            wanted = f"leave at least {unknowns + 1} pairs in the window ({unknowns} unknowns)"
            left = self.nb // self.every
            found = complaint(left > unknowns, "every", wanted, f"{left}")
        good = mu is None or ((mu > 0) & (mu <= 1))
        wanted = "be above 0 and at most 1"
        return found + complaint(good, "forgetting", wanted, self.forgetting)

    def step(self, state, part, pair, last, weigh):
        # Since `every` divides N_b, k and k - N_b are taken or left out together.
        taken = jnp.where(pair.k % self.every == 0, 1.0, 0.0)
        root = taken * self.forgetting ** (self.nb / 2)  # a product of two carries mu^N_b
        phi, values = ([taken * x for x in xs] for xs in (pair.phi, pair.values))
        left = ([root * x for x in xs] for xs in (pair.phi_leaving, pair.values_leaving))
        faded = jax.tree.map(lambda x: self.forgetting * x, state)
        new = ls.add_observation(faded["new"], phi, values)
        rows = ls.exchange_observation(faded["rows"], phi, values, *left)
        asked = weigh(rows)
        coefficients, tolerance = ls.SOLVERS[self.solver](asked)
        return {"rows": rows, "new": new}, Fitted(coefficients, asked, tolerance)
