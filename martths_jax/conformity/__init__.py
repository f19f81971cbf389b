"""Whether a controller keeps what is promised of all: causal, pure, trial by trial, stable.

    report = check("learning.py:Learning")
    report.passed, report["causal"].sentence

One file a group of checks; ``run.CHECKS`` lists them in their order.
"""

from martths_jax.conformity.report import Finding, Report
from martths_jax.conformity.run import check

__all__ = ["Finding", "Report", "check"]
