"""Time integration of the structures: each method turns x' = A x + B u into discrete (A, B, C, D).

A new method is one new file with a subclass of ``Integrator``, and one line in ``INTEGRATORS``.
"""

from martths_jax.structure.integrators.base import Integrator
from martths_jax.structure.integrators.newmark import Newmark
from martths_jax.structure.integrators.rk4 import RungeKutta4
from martths_jax.structure.integrators.zoh import ZeroOrderHold

INTEGRATORS: dict[str, Integrator] = {
    "newmark": Newmark(),
    "rk4": RungeKutta4(),
    "zoh": ZeroOrderHold(),
}

__all__ = ["INTEGRATORS", "Integrator", "Newmark", "RungeKutta4", "ZeroOrderHold"]
