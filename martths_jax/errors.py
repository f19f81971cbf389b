"""The one exception for anything a user can get wrong, and how its sentences are built."""

from __future__ import annotations

import operator
from collections.abc import Iterable

import jax
import numpy as np


class InputError(ValueError):
    """An argument, file or configuration that cannot be used.

    The message is one sentence per problem: where it is, what was given, what is wanted and,
    if there is one, the remedy.  The command line prints it without a traceback and exits with 2.
    """


def argument_error(name: str, wanted: str, got: object, remedy: str = "") -> InputError:
    """``InputError`` of the form "Argument `name` must <wanted>, but got <got>.  <remedy>"."""
    sentence = f"Argument `{name}` must {wanted}, but got {got}."
    return InputError(f"{sentence} {remedy}" if remedy else sentence)


def as_numbers(value) -> np.ndarray:
    """An argument as float64, NaN where it is none: a check then refuses it like any other."""
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        return np.array(np.nan)


def check_whole(name: str, value, least: int, most: int) -> None:
    """Refuse an argument that is not a whole number from `least` to `most`.

    What is traced has no value yet and passes.

    Raises:
        InputError: naming the argument.
    """
    if isinstance(value, jax.core.Tracer):
        return
    try:
        good = not isinstance(value, bool) and least <= operator.index(value) <= most
    except TypeError:
        good = False
    if not good:
        raise argument_error(name, f"be a whole number from {least} to {most}", repr(value))


def check_seed(seed) -> None:
    """Refuse a seed that JAX's random streams do not take, see ``check_whole``."""
    check_whole("seed", seed, 0, 2**63 - 1)


def raise_all(problems: Iterable[str], heading: str = "The configuration cannot be used") -> None:
    """Raise one ``InputError`` that lists every problem; do nothing when there is none."""
    problems = list(problems)
    if len(problems) == 1:
        raise InputError(problems[0])
    if problems:
        lines = "\n".join(f"  {i}. {text}" for i, text in enumerate(problems, 1))
        raise InputError(f"{heading} ({len(problems)} problems):\n{lines}")
