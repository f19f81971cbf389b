"""Least squares over the last N_b samples, on a delay line."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.algebra import least_squares as ls
from martths_jax.control.adaptive.arguments import complaint, known
from martths_jax.control.adaptive.base import Fit, Fitted
from martths_jax.resources import available_memory

#: Memory of a row of the buffer for trials side by side, with the inputs of a window [bytes].
NB_BYTES = 8 * 8 * 128


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Window(Fit):
    """C = (sum phi phi')^-1 sum phi u' over the last N_b pairs.

    Attributes:
        nb: buffer length N_b.
        no: overlap N_o of successive fits; new coefficients come every N_b - N_o samples; None is
            every sample.  One value a trial too.
        solver: ``ldl`` (unrolled, fast) or ``lu`` (``jnp.linalg.solve``, the reference).
    """

    nb: int = field(default=1024, metadata={"static": True})
    no: jax.Array | int | None = None
    solver: str = field(default="ldl", metadata={"static": True})

    normal = True
    shared_axes = MappingProxyType({"no": 0})

    @property
    def memory(self):
        return self.nb

    @property
    def length(self):
        return float(self.nb)

    def prepare(self, benchmark, controller):
        return self if self.no is None else replace(self, no=jnp.asarray(self.no))

    def problems(self, controller):
        nb, no, unknowns = self.nb, known(self.no), controller.parts[0].unknowns
        if not isinstance(nb, (int, np.integer)) or nb <= unknowns:
            wanted = f"be a whole number of at least {unknowns + 1} ({unknowns} unknowns)"
            return complaint(False, "nb", wanted, nb)
        room = int(available_memory() / 2 / NB_BYTES)
        found = complaint(nb <= room, "nb", f"be at most {room}, whose rows fit into memory", nb)
        if no is not None:
            wanted = f"lie in [0, nb - 1 = {nb - 1}]"
            found += complaint((no >= 0) & (no <= nb - 1), "no", wanted, no)
        wanted = f"be one of {sorted(ls.SOLVERS)}"
        return found + complaint(self.solver in ls.SOLVERS, "solver", wanted, self.solver)

    def init(self, part, trials):
        """Normal equations of all pairs in the buffer, and of those since its last turn alone."""
        empty = ls.zeros(part.unknowns, len(part.sides), trials)
        return {"rows": empty, "new": empty}

    def due(self, k, reach):
        # The first fit waits until no row in the buffer reaches back before the first sample.
        since_full = k - (self.nb + reach)
        hop = 1 if self.no is None else self.nb - self.no
        return (since_full >= 0) & (since_full % hop == 0)

    def step(self, state, part, pair, last, weigh):
        new = ls.add_observation(state["new"], pair.phi, pair.values)
        rows = ls.exchange_observation(
            state["rows"], pair.phi, pair.values, pair.phi_leaving, pair.values_leaving
        )
        asked = weigh(rows)
        coefficients, tolerance = ls.SOLVERS[self.solver](asked)
        return {"rows": rows, "new": new}, Fitted(coefficients, asked, tolerance)

    def renew(self, state):
        """The fresh sum of the rows in the delay line replaces the sliding sum.

        Adding and subtracting rows for ever would let round-off grow with the record; here every
        sum is at most two lengths of the line old.
        """
        return state | {"rows": state["new"], "new": jax.tree.map(jnp.zeros_like, state["new"])}
