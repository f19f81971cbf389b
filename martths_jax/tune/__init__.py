"""Tuning of controllers by gradients through whole simulations."""

from martths_jax.tune.objective import Objective
from martths_jax.tune.parameters import Tuned, tuned
from martths_jax.tune.search import Options, tune

__all__ = ["Objective", "Options", "Tuned", "tune", "tuned"]
