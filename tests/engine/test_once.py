"""What is computed once stays the same function, and is computed once."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from martths_jax.once import computed, once


def stage(x, y):
    """Cheap arithmetic with two results."""
    return x * y - x, {"sum": x + y}


def readers(function):
    """Two values that read the first result of a stage."""

    def read(x, y):
        value, more = function(x, y)
        return value + y, value * more["sum"]

    return read


def differences(function) -> int:
    """How many subtractions there are in a function's compiled program."""
    x = jnp.arange(8.0)
    return jax.jit(function).lower(x, x + 1).compile().as_text().count(" subtract(")


@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev])
def test_values_and_derivatives_are_those_of_the_function(mode):
    x, y = jnp.linspace(0.1, 1, 5), jnp.linspace(2, 3, 5)
    plain, kept = readers(stage), readers(once(stage))
    for change in (lambda f: f, lambda f: mode(f, argnums=(0, 1)), jax.vmap):
        expected, found = (jax.tree.leaves(jax.jit(change(f))(x, y)) for f in (plain, kept))
        for a, b in zip(expected, found, strict=True):
            np.testing.assert_allclose(b, a, rtol=1e-14)


def test_arithmetic_is_not_repeated():
    """The compiler repeats a stage in its readers, unless it is told not to."""
    assert differences(readers(stage)) == 2
    assert differences(readers(once(stage))) == 1
    assert differences(readers(lambda x, y: (computed(x * y - x), {"sum": x + y}))) == 1


def test_large_arrays_compile_within_a_loop():
    """XLA would split a function that ends in one large array over threads, which fails there."""
    grow = once(lambda x: sum(x * (0.1 * i) for i in range(1, 30)))

    def loop(x):
        return jax.lax.scan(lambda x, _: (grow(x) / 50, None), x, None, length=3)[0]

    x = jnp.ones((64, 1024))
    np.testing.assert_allclose(jax.jit(loop)(x), np.full(x.shape, (43.5 / 50) ** 3), rtol=1e-13)
