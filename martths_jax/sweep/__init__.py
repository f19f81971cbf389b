"""Sweeps: a study repeated on a grid of design parameters, with the same plants and noise.

from martths_jax.sweep import run_sweep

sweep = run_sweep({"nb": [512, 1024], "no_fraction": [0, 0.5, 1]}, trials=200, out="sweep")
print(sweep.summary())
"""

from martths_jax.sweep.config import SweepConfig, make_sweep
from martths_jax.sweep.results import Sweep, open_sweep
from martths_jax.sweep.runner import run_sweep

__all__ = ["Sweep", "SweepConfig", "make_sweep", "open_sweep", "run_sweep"]
