"""Problems by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial

from martths_jax.errors import argument_error
from martths_jax.problem.base import Problem
from martths_jax.problem.file.problem import file_problem
from martths_jax.problem.marths import MARTHS
from martths_jax.problem.uniaxial.problem import uniaxial
from martths_jax.problem.uniaxial.structure import CASES

#: Name -> its cases by number; a problem that has none stands under None.
PROBLEMS: Mapping[str, Mapping[int | None, Callable[[], Problem]]] = {
    "marths": {None: lambda: MARTHS},
    "uniaxial": {case: partial(uniaxial, case) for case in CASES},
}


def find_problem(name: str = "marths", case: int | None = None) -> Problem:
    """The problem that is meant.

    Args:
        name: of ``PROBLEMS``, or the path of a problem file, FILE.toml.
        case: of those that have cases; the first by default.

    Raises:
        InputError: for a name or case that does not exist.
    """
    if name.endswith(".toml"):
        if case is not None:
            raise argument_error("case", "be left out, a file has none", repr(case))
        return file_problem(name)
    if name not in PROBLEMS:
        known = ", ".join(PROBLEMS)
        raise argument_error("problem", f"be one of {known}, or a FILE.toml", repr(name))
    cases = PROBLEMS[name]
    if case is None:
        case = next(iter(cases))
    if case not in cases:
        known = [str(one) for one in cases if one is not None]
        wanted = f"be one of {', '.join(known)}" if known else f"be left out, {name} has none"
        raise argument_error("case", wanted, repr(case))
    return _made(name, case)


@cache  # the same object each time, so that JAX knows its parts again
def _made(name: str, case: int | None) -> Problem:
    return PROBLEMS[name][case]()
