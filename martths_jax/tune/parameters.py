"""What can be tuned: the numbers of a controller's entry, as coordinates of a descent.

A number that must not be negative is tuned as its log10, so that it stays positive and a step is a
change by decades.  Any other is tuned as it is, in units of where it starts (of 1 at zero).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from martths_jax.benchmark import Benchmark
from martths_jax.campaign.given import expand
from martths_jax.control import registry
from martths_jax.control.controllers import Controller
from martths_jax.control.entry import Entry, Parameter
from martths_jax.errors import InputError, argument_error


@dataclass(frozen=True)
class Tuned:
    """A controller that is tuned.

    Attributes:
        given: the text that names it; name: what it is called in tables.
        guest: where it comes from.
        fixed: settings that stay.
        start: values of the numbers that tuning starts from, in the order of the entry.
    """

    given: str
    name: str
    guest: registry.Guest
    fixed: Mapping[str, Any] = field(default_factory=dict)
    start: Mapping[str, float] = field(default_factory=dict)

    @property
    def entry(self) -> Entry:
        """What it says of itself."""
        return self.guest.entry

    def column(self, name: str) -> str:
        """Head of a number's column in the history."""
        return f"log10_{name}" if self.is_log(name) else name

    def is_log(self, name: str) -> bool:
        """Whether a number is tuned as its log10."""
        return self.entry.tunable[name].low >= 0

    def coordinates(self, values: Mapping[str, float]) -> dict[str, float]:
        """Coordinates of some values."""
        return {
            name: float(np.log10(value)) if self.is_log(name) else value / self._unit(name)
            for name, value in values.items()
        }

    def values(self, coordinates: Mapping) -> dict:
        """The numbers themselves; coordinates may be traced."""
        return {
            name: 10.0**x if self.is_log(name) else x * self._unit(name)
            for name, x in coordinates.items()
        }

    def shown(self, coordinates: Mapping[str, float]) -> dict[str, float]:
        """What the history says of a point: log10 of a number, or the number."""
        values = self.values(coordinates)
        return {
            self.column(name): x if self.is_log(name) else values[name]
            for name, x in coordinates.items()
        }

    def _unit(self, name: str) -> float:
        return abs(self.start[name]) or 1.0

    def build(self, benchmark: Benchmark, coordinates: Mapping) -> Controller:
        """Prepared controller from coordinates, which may be traced."""
        arrays = {name: jnp.asarray(x, dtype=float) for name, x in coordinates.items()}
        return self.entry.build_traced(benchmark, **self.values(arrays), **self.fixed)

    def on_host(self, benchmark: Benchmark, coordinates: Mapping[str, float]) -> Controller:
        """The same by the controller's ordinary, checked constructor."""
        values = {name: float(x) for name, x in self.values(coordinates).items()}
        return self.entry.build_tuned(benchmark, **values, **self.fixed)

    def check(self, benchmark: Benchmark) -> None:
        """Refuse what cannot be built, before anything is compiled.

        Raises:
            InputError: settings that the controller does not take where it is tuned.
        """
        try:
            jax.eval_shape(lambda x: self.build(benchmark, x), self.coordinates(self.start))
        except InputError:
            raise
        except Exception as error:  # code of the user's may raise anything
            settings = f" with {', '.join(self.fixed)} set" if self.fixed else ""
            raise InputError(
                f"Controller {self.given!r} cannot be tuned{settings}: what it makes of "
                f"{', '.join(self.start)} as traced numbers fails ({type(error).__name__}: "
                f"{str(error).splitlines()[0] if str(error) else error!r})."
            ) from error


def tuned(
    given: str,
    start: Mapping[str, float] | None = None,
    settings: Mapping[str, Any] | None = None,
) -> Tuned:
    """The controller that a text names, and where its tuning starts.

    Args:
        given: a built-in name, ``package.module:Class`` or ``path/file.py:Class``, also with
            settings, as in ``adfc{nb=2048,no=2047}``; numbers among them that are tuned start
            there.
        start: values to start from instead.
        settings: more of them, as a table has them; those of the text go on top.

    Raises:
        InputError: for an unknown controller, setting or number, a value out of its range, or a
            number without a start.
    """
    (name,), tables = expand((given,), {given: dict(settings)} if settings else {})
    table = dict(tables.get(name, {}))
    guest = registry.find(table.pop("kind", name))
    entry, numbers = guest.entry, guest.entry.tunable
    if not numbers:
        raise InputError(
            f"Controller {name!r} has no number that can be tuned; its entry must have parameters "
            "of the kind 'tunable'."
        )
    values = {n: p.default for n, p in numbers.items()}
    values |= {n: table.pop(n) for n in list(table) if n in numbers}
    for n, value in (start or {}).items():
        if n not in numbers:
            raise argument_error("start", f"name one of {', '.join(numbers)}", repr(n))
        values[n] = value
    unknown = sorted(set(table) - set(entry.defaults))
    if unknown:
        known = ", ".join(dict.fromkeys([*numbers, *entry.defaults]))
        raise argument_error("controller", f"have settings among {known}", unknown[0])
    problems = [text for n in numbers for text in _problems(numbers[n], values[n])]
    problems += entry.problems(table)
    if problems:
        raise InputError("\n".join(problems))
    return Tuned(given, name, guest, table, {n: float(v) for n, v in values.items()})


def _problems(number: Parameter, value) -> list[str]:
    """Why a tuning cannot start from a value."""
    name = number.name
    if value is None:
        return [str(argument_error("start", f"give {name} a value, since it has none", "none"))]
    if number.low >= 0 and not 0 < value < float("inf"):
        return [str(argument_error("start", f"give a positive {name}", value))]
    if not number.good(value):
        return [str(argument_error("start", f"give a {name} that can {number.wanted}", value))]
    return []


def start_of(controller: str, given: Mapping[str, float] | None = None) -> dict[str, float]:
    """Coordinates that the tuning of a controller starts from (see ``tuned``)."""
    found = tuned(controller, given)
    return found.coordinates(found.start)


def build(controller: str, benchmark: Benchmark, coordinates: Mapping) -> Controller:
    """``Tuned.build`` of a controller with its defaults."""
    return tuned(controller).build(benchmark, coordinates)


def host_controller(controller: str, benchmark: Benchmark, coordinates: Mapping) -> Controller:
    """``Tuned.on_host`` of a controller with its defaults."""
    return tuned(controller).on_host(benchmark, coordinates)
