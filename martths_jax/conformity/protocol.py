"""Checks of the program that a controller becomes: its structure, one trace, the same unjitted."""

from __future__ import annotations

import dataclasses

import jax

from martths_jax.conformity.report import Finding, in_words
from martths_jax.conformity.stand import EAGER, Stand, apart
from martths_jax.errors import InputError
from martths_jax.simulation import LANES, prepare

#: What jitted and plain commands may differ by, in parts of the largest one: operations that the
#: compiler fuses round differently, and an adaptive fit enlarges that by its condition.
ROUND_OFF = 1e-8


def structure(stand: Stand) -> Finding:
    """State, records and commands of constant structure, shape and type (``control.check``)."""
    name = "structure"
    try:
        for one in (stand.made, getattr(stand.made, "estimator", None)):
            _check_static(one)
        controller = stand.controller
        leaves = len(jax.tree.leaves(jax.eval_shape(lambda c: c.init(LANES), controller)))
    except InputError as error:
        return Finding(name, False, None, str(error))
    except Exception as error:  # the user's code may raise anything
        return Finding(name, False, None, f"Preparing it ends in {in_words(error)}.")
    return Finding(
        name, True, leaves, "State, records and commands keep their structure, shapes and types.",
        "arrays of state",
    )  # fmt: skip


def _check_static(owner) -> None:
    """Refuse static fields that no program can be identified by."""
    for one in dataclasses.fields(owner) if dataclasses.is_dataclass(owner) else ():
        if not one.metadata.get("static"):
            continue
        value = getattr(owner, one.name)
        try:
            hash(value)
        except TypeError:
            raise InputError(
                f"Static field `{one.name}` of {type(owner).__name__} must be hashable, but got "
                f"{type(value).__name__}; make it a tuple, or an array that is not static."
            ) from None


def one_trace(stand: Stand) -> Finding:
    """One program for all samples, strokes and preparations."""
    name = "one trace"
    _, end = stand.first
    before = stand.drive.traces
    _ = stand.second
    if stand.drive.traces > before:
        start = stand.drive.start(stand.controller, LANES)
        return Finding(
            name, False, stand.drive.traces,
            f"It is compiled again after the first samples, since {_other_types(start, end)}; let "
            "`init` return arrays of the types that `step` gives, such as jnp.zeros(trials).",
            "traces",
        )  # fmt: skip
    other = prepare(stand.made, stand.benchmark, LANES)[0]
    stand.drive(other, stand.further)
    if stand.drive.traces > before:
        return Finding(
            name, False, stand.drive.traces,
            "It is compiled again whenever it is prepared, since two preparations differ in "
            f"{_other_fields(stand.controller, other)}; let what is static be numbers, text or "
            "tuples of them, which compare equal, and functions be defined once, outside of "
            "`prepare`.", "traces",
        )  # fmt: skip
    return Finding(
        name, True, stand.drive.traces, "It is compiled once, for all samples and batches.", "trace"
    )


def _other_types(one, other) -> str:
    """The first leaf of a state whose type changes, in words."""
    pairs = zip(jax.tree_util.tree_leaves_with_path(one), jax.tree.leaves(other), strict=True)
    for (path, before), after in pairs:
        a, b = jax.typeof(before), jax.typeof(after)
        if a != b:
            return f"its state {jax.tree_util.keystr(path)} begins as {a} and goes on as {b}"
    return "its state changes its types"


def _other_fields(one, other) -> str:
    """Static fields in which two preparations differ, in words."""
    found = [
        f"`{field.name}`"
        for field in dataclasses.fields(one)
        if field.metadata.get("static") and getattr(one, field.name) != getattr(other, field.name)
    ]
    return ", ".join(found) or "the structure of their fields"


def jit_alike(stand: Stand) -> Finding:
    """The same commands from the compiled program and from Python, sample by sample."""
    name = "jit"
    try:
        plain = stand.eager()
    except Exception as error:  # the user's code may raise anything
        return Finding(
            name, False, None,
            f"Without jit, `step` ends in {in_words(error)}; let it work on ordinary arrays, too, "
            "which is how it is called for a look at single samples.",
        )  # fmt: skip
    jitted = stand.second[: len(plain)]
    difference = apart(jitted, plain)
    if difference > ROUND_OFF:
        return Finding(
            name, False, difference,
            f"Jitted and plain commands differ by {difference:.2g} of the largest in {EAGER} "
            f"samples, more than round-off ({ROUND_OFF:g}); let nothing depend on whether a value "
            "is traced: no isinstance(x, Tracer), no NumPy and no Python `if` on values.",
            "of the largest",
        )  # fmt: skip
    bits = "to the bit" if difference == 0 else f"to round-off (at most {ROUND_OFF:g})"
    return Finding(
        name, True, difference, f"Jitted and plain commands are the same {bits}.", "of the largest"
    )
