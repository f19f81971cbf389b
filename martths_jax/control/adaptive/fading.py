"""Least squares over the whole past, which fades: recursive least squares by normal equations."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType

import jax

from martths_jax.algebra import least_squares as ls
from martths_jax.control.adaptive.arguments import (
    MATRICES,
    check_positive,
    check_shape,
    complaint,
    known,
    per_coefficient,
    per_part,
)
from martths_jax.control.adaptive.base import Fit, Fitted


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Fading(Fit):
    """C = (G + mu^k L)^-1 (h + mu^k L C_0), G = sum mu^age phi phi', h = sum mu^age phi u'.

    The same coefficients as ``Recursive`` with P_0 = L^-1, in a form that guards can change, and
    that never winds up: where nothing moves G fades, and a guard's pull takes over.

    Attributes:
        forgetting: factor mu a sample; a memory of 1/(1 - mu) samples.
        prior: L, weight of the start coefficients at first: a number, n numbers, (n, n) or
            (parts, n, n).
        wait: samples before the first coefficients are used, beyond those that make a whole row.
        solver: as of ``Window``.
    """

    forgetting: jax.Array | float = 1 - 1 / 1024
    prior: jax.Array | float = 0.0
    wait: int = field(default=0, metadata={"static": True})
    solver: str = field(default="ldl", metadata={"static": True})
    start: jax.Array | None = None

    normal = True
    shared_axes = MappingProxyType({"forgetting": 0, "prior": 3, "start": 2})

    @property
    def length(self):
        return 1 / (1 - self.forgetting)

    def prepare(self, benchmark, controller):
        sizes = controller.sizes
        start = per_coefficient(controller.start, *sizes)
        return replace(self, prior=per_part(self.prior, *sizes), start=start)

    def problems(self, controller):
        mu = known(self.forgetting)
        return [
            *complaint(mu is None or ((mu > 0) & (mu < 1)), "forgetting", "lie between 0 and 1",
                       self.forgetting),
            *check_shape("prior", self.prior, controller.parts, MATRICES),
            *check_positive("wait", self.wait, zero=True),
            *complaint(self.solver in ls.SOLVERS, "solver", f"be one of {sorted(ls.SOLVERS)}",
                       self.solver),
        ]  # fmt: skip

    def init(self, part, trials):
        empty = ls.zeros(part.unknowns, len(part.sides), trials)
        start = part.columns(self.start)
        return ls.weighted(empty, self.prior[part.number], start)

    def due(self, k, reach):
        return k >= self.wait + reach

    def step(self, state, part, pair, last, weigh):
        faded = jax.tree.map(lambda x: self.forgetting * x, state)
        rows = ls.add_observation(faded, pair.phi, pair.values)
        asked = weigh(rows)
        coefficients, tolerance = ls.SOLVERS[self.solver](asked)
        return rows, Fitted(coefficients, asked, tolerance)
