"""Problems: what is tested, one file or folder each.

To add one, write a file like ``marths.py`` that makes a ``Problem``, and name it in
``registry.PROBLEMS``.
"""

from martths_jax.problem.base import Problem, Reading
from martths_jax.problem.registry import PROBLEMS, find_problem

__all__ = ["PROBLEMS", "Problem", "Reading", "find_problem"]
