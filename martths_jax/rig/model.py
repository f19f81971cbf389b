"""What all plants of a rig have in common, checked once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import jax.numpy as jnp
import numpy as np

from martths_jax.errors import InputError, argument_error
from martths_jax.rig.dynamics import Dynamics
from martths_jax.rig.modal import HZ, fastest, first_problem
from martths_jax.rig.numbers import Batch
from martths_jax.rig.uncertainty import Uncertainty
from martths_jax.runtime import check_runtime

#: No uncertain parameter.
CERTAIN = Uncertainty()


@dataclass(frozen=True)
class PlantModel:
    """What all plants of a rig have in common; hashable, and static to JAX.

    Attributes:
        dynamics: ``TransferMatrix``, ``StateSpace`` or ``Written``.
        uncertainty: parameters that differ from plant to plant; none by default.

    Raises:
        InputError: where the nominal plant has no stable modal form, or a name is not known.
    """

    dynamics: Dynamics
    uncertainty: Uncertainty = CERTAIN

    def __post_init__(self):
        for name, kind in (("dynamics", Dynamics), ("uncertainty", Uncertainty)):
            if not isinstance(getattr(self, name), kind):
                wanted, got = f"be of the kind {kind.__name__}", repr(getattr(self, name))[:80]
                raise argument_error(name, wanted, got)
        unknown = (self.dynamics.names or set()) - set(self.uncertainty.names)
        if unknown:
            known = ", ".join(self.uncertainty.names) or "none, since `uncertainty` has none"
            raise argument_error(
                "dynamics", f"name uncertain parameters only ({known})", f"{min(unknown)!r}"
            )
        check_runtime()
        nominal_of(self)

    @property
    def outputs(self) -> int:
        """Number of outputs."""
        return self.dynamics.shape[0]

    @property
    def inputs(self) -> int:
        """Number of inputs."""
        return self.dynamics.shape[1]

    @property
    def lowest_rate(self) -> float:
        """Lowest sampling rate [Hz]: twice the nominal plant's fastest pole."""
        return 2 * nominal_of(self).fastest / HZ


@dataclass(frozen=True)
class Nominal:
    """What is known of the nominal plant of a model."""

    kept: dict
    fastest: float


def batch_of(model: PlantModel, values, kept: dict, learns: bool = False, xp=jnp) -> Batch:
    """What the numbers of a model are evaluated with, for parameters (T, p)."""
    columns = {name: values[:, i] for i, name in enumerate(model.uncertainty.names)}
    return Batch(columns, values.shape[0], kept, learns, xp)


@lru_cache(maxsize=64)
def nominal_of(model: PlantModel) -> Nominal:
    """The nominal plant of a model, checked."""
    values = np.array([model.uncertainty.nominal], dtype=float)
    batch = batch_of(model, values, {}, learns=True, xp=np)
    matrix = model.dynamics.matrix(batch)
    if problem := first_problem(matrix, nominal=True):
        raise InputError(f"Plant cannot be used: {problem[1]}, for the nominal parameters.")
    model.dynamics.groups(matrix, batch)
    return Nominal(batch.kept, fastest(matrix))
