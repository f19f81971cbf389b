"""What a controller says of itself: name, label, paper, how it is made, and its parameters.

Every controller's file carries one ``Entry``; help texts, TOML templates, axes of sweeps, numbers
that can be tuned, colours, labels and columns of tables come from it.
"""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from martths_jax.control.base import Controller
from martths_jax.errors import InputError, argument_error
from martths_jax.text import counted

#: What may become of a parameter: it shapes the program, it may differ from trial to trial, or a
#: tuning may move it as well.
KINDS = ("static", "lane", "tunable")
#: ``Parameter.size`` of as many numbers as there are actuators.
ANY = -1


@dataclass(frozen=True)
class Parameter:
    """A setting of a controller.

    Attributes:
        name: keyword of ``Entry.make``.
        symbol: in the paper; label: in words.
        default: value where none is given; None where the controller chooses.
        unit: of its values, "1" for none.
        low, high: bounds of a number, themselves allowed if finite; `above` where `low` is not.
        above: whether a number must be larger than `low`.
        whole: whether it is a whole number.
        size: how many numbers it is; 0 for one, ``ANY`` for one an actuator.
        choices: the words it may be, if it is a word.
        kind: one of ``KINDS``; `tunable` numbers can be axes of a sweep too, `static` ones if they
            are one number.
    """

    name: str
    symbol: str = ""
    label: str = ""
    default: Any = None
    unit: str = "1"
    low: float = -np.inf
    high: float = np.inf
    above: bool = False
    whole: bool = False
    size: int = 0
    choices: tuple[str, ...] = ()
    kind: str = "lane"

    @property
    def title(self) -> str:
        """Label and symbol, for axes of figures."""
        return " ".join(x for x in (self.label or self.name, self.symbol) if x)

    @property
    def is_number(self) -> bool:
        """Whether one number sets it."""
        boolean = isinstance(self.default, bool)
        return not (self.choices or self.size or boolean or isinstance(self.default, str))

    @property
    def wanted(self) -> str:
        """What a value must be, to complete "must ..."."""
        if self.choices:
            return f"be one of {', '.join(map(repr, self.choices))}"
        kind = "whole number" if self.whole else "number"
        many = f"{self.size} {kind}s" if self.size > 0 else f"a {kind}"
        if self.size == ANY:
            many = f"{kind}s, one an actuator,"
        unit = "" if self.unit == "1" else f" ({self.unit})"
        low, high = np.isfinite(self.low), np.isfinite(self.high)
        if low and high:
            return f"be {many} from {self.low:g} to {self.high:g}{unit}"
        if low:
            return f"be {many} {'above' if self.above else 'of at least'} {self.low:g}{unit}"
        return f"be {many}{f' of at most {self.high:g}' if high else ''}{unit}"

    def good(self, value) -> bool:
        """Whether a value can be used; a traced one, and None for the controller's choice, can."""
        if value is None:
            return self.default is None
        if self.choices:
            return value in self.choices
        if isinstance(self.default, bool):
            return isinstance(value, bool)
        if isinstance(self.default, str):
            return isinstance(value, str)
        if isinstance(value, (bool, str)):
            return False
        try:
            numbers = np.asarray(value, dtype=float)
        except (TypeError, ValueError):
            return False
        sized = numbers.size >= 1 if self.size == ANY else numbers.size == max(1, self.size)
        if not sized or not np.all(np.isfinite(numbers)):
            return False
        bounded = (numbers > self.low if self.above else numbers >= self.low) & (
            numbers <= self.high
        )
        return bool(np.all(bounded) and (not self.whole or np.all(numbers == np.round(numbers))))


@dataclass(frozen=True)
class Derived:
    """Another way to say a parameter, as an axis of sweeps: the update rate instead of No.

    Attributes:
        name: of the axis; of: of the parameter that it sets.
        value: from the axis' value, the other settings and the sampling rate [Hz] to the parameter.
        label, unit, low, high, above, whole: as of ``Parameter``, of the axis' values.
        of_cell: the axis' value from all settings and the sampling rate, where results should hold
            it for every cell.
    """

    name: str
    of: str
    value: Callable[[float, Mapping[str, Any], float], Any]
    label: str = ""
    unit: str = "1"
    low: float = -np.inf
    high: float = np.inf
    above: bool = False
    whole: bool = False
    of_cell: Callable[[Mapping[str, Any], float], float] | None = None

    @property
    def as_parameter(self) -> Parameter:
        """Bounds, unit and label of the axis' values."""
        names = ("name", "label", "unit", "low", "high", "above", "whole")
        return Parameter(**{n: getattr(self, n) for n in names})


@dataclass(frozen=True)
class Entry:
    """What a controller says of itself.

    Attributes:
        name: how it is named in settings, tables and files.
        controller: its class.
        make: ``make(benchmark, **settings)``, where it is not the class called with the settings.
        label: in legends and heads of tables; the name by default.
        paper: where it comes from.
        parameters: its settings, in the order of help texts.
        derived: other axes that set one of them.
        tuned: positive numbers that a tuning moves, where they are not the parameters of the kind
            ``tunable``; their defaults are where it starts.
        traced: ``traced(benchmark, **values)``: the prepared controller from values of these, which
            may be traced; by default it is made and prepared like any other.
        settings_from: ``settings_from(values)``: settings that mean the same as such values, where
            the values are none.
        follow: ``follow(own, changed)``: settings that change with others where a sweep moves
            these, given what the controller has and what moves.
        clash: ``clash(settings)``: sentences about settings that exclude each other.
        look: position of its colour and dashes, where that shall be the same in all figures.
        problem: what its default settings were chosen for.
    """

    name: str
    controller: type[Controller]
    make: Callable[..., Controller] | None = None
    label: str = ""
    paper: str = ""
    parameters: tuple[Parameter, ...] = ()
    derived: tuple[Derived, ...] = ()
    tuned: tuple[Parameter, ...] = ()
    traced: Callable[..., Controller] | None = None
    settings_from: Callable[[Mapping[str, float]], dict[str, Any]] | None = None
    follow: Callable[[Mapping[str, Any], Mapping[str, Any]], dict[str, Any]] | None = None
    clash: Callable[[Mapping[str, Any]], list[str]] | None = None
    look: int | None = None
    problem: str = "marths"

    def __post_init__(self):
        names = [p.name for p in self.parameters] + [d.name for d in self.derived]
        for name in sorted({n for n in names if names.count(n) > 1}):
            raise InputError(f"Entry {self.name!r} names the parameter {name!r} twice.")
        for p in self.parameters:
            if p.kind not in KINDS:
                raise InputError(
                    f"Parameter {p.name!r} of entry {self.name!r} must be one of "
                    f"{', '.join(KINDS)}, but got {p.kind!r}."
                )

    @property
    def title(self) -> str:
        """Its label, or its name."""
        return self.label or self.name

    @property
    def defaults(self) -> dict[str, Any]:
        """Settings and their defaults."""
        return {p.name: p.default for p in self.parameters}

    @property
    def tunable(self) -> dict[str, Parameter]:
        """Numbers that a tuning can move."""
        own = self.tuned or [p for p in self.parameters if p.kind == "tunable"]
        return {p.name: p for p in own}

    def parameter(self, name: str) -> Parameter:
        """One of its parameters, by name."""
        return next(p for p in self.parameters if p.name == name)

    def problems(self, settings: Mapping[str, Any]) -> list[str]:
        """Sentences about settings out of their range."""
        return [
            str(argument_error(p.name, p.wanted, f"{settings[p.name]!r:.80}"))
            for p in self.parameters
            if p.name in settings and not p.good(settings[p.name])
        ]

    def followed(self, own: Mapping[str, Any], changed: Mapping[str, Any]) -> dict[str, Any]:
        """Settings that change with others, see ``follow``."""
        return {} if self.follow is None else self.follow(own, changed)

    def clashes(self, settings: Mapping[str, Any]) -> list[str]:
        """Sentences about settings out of range or that exclude each other."""
        return ([] if self.clash is None else self.clash(settings)) or self.problems(settings)

    def build(self, benchmark, **settings) -> Controller:
        """The controller with some settings, not prepared.

        Raises:
            InputError: a setting that it does not have, or out of its range.
        """
        unknown = sorted(set(settings) - set(self.defaults))
        if unknown:
            raise argument_error(
                "settings", f"be among {', '.join(self.defaults) or 'none'}", unknown[0]
            )
        found = self.problems(settings) + wrong_number(self.controller, benchmark)
        if found:
            raise InputError("\n".join(found))
        return self._made(benchmark, settings)

    def build_traced(self, benchmark, **values) -> Controller:
        """The prepared controller from values of its tunable parameters, which may be traced."""
        if self.traced is not None:
            return self.traced(benchmark, **values)
        return self._made(benchmark, values).prepare(benchmark)

    def build_tuned(self, benchmark, **values: float) -> Controller:
        """The same from known numbers, by the ordinary, checked constructor; not prepared."""
        convert = self.settings_from or dict
        return self.build(benchmark, **convert(values))

    def _made(self, benchmark, settings) -> Controller:
        if self.make is None:
            return self.controller(**settings)
        return self.make(benchmark, **settings)


def wrong_number(controller: Controller | type[Controller], benchmark) -> list[str]:
    """A sentence about a controller that is made for another number of actuators."""
    needed = controller.actuators_needed
    got = None if benchmark is None else len(benchmark.layout.actuators)
    if None in (needed, got) or needed == got:
        return []
    return [
        f"Controller {controller.name!r} is made for {counted(needed, 'actuator')}, but the "
        f"problem has {got}; adfc, mff, error-model and passthrough take any number."
    ]


def entry_of(controller: type[Controller]) -> Entry:
    """The entry of a class that carries none: its fields are its parameters.

    Static fields are static; other fields that hold one number by default may differ from trial to
    trial and be tuned; what prepares the controller (``estimator``) and arrays are left out.
    """
    found = []
    for one in dataclasses.fields(controller) if dataclasses.is_dataclass(controller) else ():
        given = one.default
        plain = isinstance(given, (bool, int, float, str))
        if one.name == "estimator" or not one.init or not plain:
            continue
        static = bool(one.metadata.get("static")) or isinstance(given, (bool, str))
        whole = isinstance(given, int) and not isinstance(given, bool) and static
        kind = "static" if static else "tunable"
        found.append(Parameter(one.name, default=given, whole=whole, kind=kind))
    text = (inspect.getdoc(controller) or "").partition("\n")[0]
    return Entry(controller.name, controller, paper=text, parameters=tuple(found))
