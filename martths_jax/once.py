"""Values that the compiler is to compute once.

XLA's fusion on CPUs repeats the arithmetic of a value in every kernel that reads it.  What goes
into a function that is not inlined, and what comes out of it, is computed once and kept.  The
stages of a sample period are such functions; nothing but time depends on it.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from functools import wraps
from typing import TypeVar

import jax
import jax.numpy as jnp

try:
    from jax.experimental.xla_metadata import set_xla_metadata
except ImportError:  # without it the compiler repeats arithmetic, which costs time and no more

    def set_xla_metadata(**_):
        return nullcontext()


Function = TypeVar("Function", bound=Callable)


def once(function: Function) -> Function:
    """Let a pure function of arrays stay a function of its own in the compiled program."""

    @wraps(function)
    def with_tuple(*args):
        # A computation that ends in a tuple is not split over threads by XLA; one that ends in a
        # large array is, which does not compile within a loop.
        return function(*args), jnp.zeros(())

    compiled = jax.jit(with_tuple)

    @wraps(function)
    def call(*args):
        with set_xla_metadata(inlineable="false"):
            value = compiled(*args)
        return jax.lax.optimization_barrier(value)[0]  # JAX would drop a result that nobody reads

    return call


@once
def computed(value):
    """The value itself, computed once however many read it."""
    return value
