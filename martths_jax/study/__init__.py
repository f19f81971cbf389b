"""Monte Carlo studies: controllers x motions x trials, resumable, on one core or many machines.

from martths_jax.study import run_study

study = run_study(trials=200, seed=1, out="first")
print(study.summary())
"""

from martths_jax.campaign.config import StudyConfig, make_config
from martths_jax.campaign.progress import Bars, Lines, Reporter
from martths_jax.study.merge import merge_runs
from martths_jax.study.results import Study, open_study
from martths_jax.study.runner import run_study

__all__ = [
    "Bars",
    "Lines",
    "Reporter",
    "Study",
    "StudyConfig",
    "make_config",
    "merge_runs",
    "open_study",
    "run_study",
]
