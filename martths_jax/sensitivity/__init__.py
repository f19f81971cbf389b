"""Global sensitivity: which uncertain parameter drives which index (Sobol' indices).

from martths_jax.sensitivity import run_sensitivity

found = run_sensitivity(trials=512, controllers=["adfc"], out="sensitivity")
print(found.summary())
"""

from martths_jax.sensitivity.estimators import SobolIndices, sobol
from martths_jax.sensitivity.results import Sensitivity, open_sensitivity
from martths_jax.sensitivity.runner import run_sensitivity

__all__ = ["Sensitivity", "SobolIndices", "open_sensitivity", "run_sensitivity", "sobol"]
