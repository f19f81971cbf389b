"""The axes of a sweep: which scalars there are, and how a user writes their values.

pull=1e-8:1e-4:log9      nine values from 1e-8 to 1e-4, evenly spaced in the logarithm
scale=0.1:1:lin5         five values from 0.1 to 1, evenly spaced
q=1e-6,1e-5              these values
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from martths_jax.campaign.fields import is_number, is_positive
from martths_jax.control.controllers import ENTRIES
from martths_jax.control.entry import Entry, Parameter
from martths_jax.errors import InputError


@dataclass(frozen=True)
class Scalar:
    """A scalar that can be an axis.

    Attributes:
        setting: what it sets: a setting of the study, of its coupler, or of controllers.
        good: whether a value can be used.
        wanted: what it must be, to complete "must ...".
        unit: of the values.
        label: for axes of figures and for the result file.
        whole: whether values are whole numbers.
        own: whether it is the controllers'.
    """

    setting: str
    good: Callable[[float], bool]
    wanted: str
    unit: str
    label: str
    whole: bool = False
    own: bool = False


def _at_least(low: float) -> Callable[[float], bool]:
    return lambda value: is_number(value) and value >= low


#: Axes of the study itself, whatever controllers run.
STUDY = {
    "scale": Scalar("scale", lambda v: is_number(v) and v != 0, "be a finite factor but not zero",
                    "1", "scale of the motion"),
    "noise_power": Scalar("noise_power", _at_least(0), "be zero or positive", "mm^2 s",
                          "power of the sensor noise"),
    "fs": Scalar("fs", is_positive, "be positive", "Hz", "sampling rate"),
    "alpha": Scalar("alpha", lambda v: is_number(v) and 0 < v < 90, "lie between 0 and 90 degrees",
                    "degree", "angle alpha of the coupler"),
    "arm": Scalar("arm", is_positive, "be positive", "m", "arm p of the coupler"),
    "spread": Scalar("spread", _at_least(0), "be zero or positive", "1",
                     "spread of the plant's parameters"),
}  # fmt: skip


def scalars(entries: Iterable[Entry] = ENTRIES) -> dict[str, Scalar]:
    """Everything that can be an axis of a study of these controllers, by name.

    Args:
        entries: of the controllers; of all of ours by default.
    """
    found: dict[str, Scalar] = {}
    for entry in entries:
        for name, (of, one) in own_axes(entry).items():
            wanted = one.wanted.partition(" (")[0]
            found.setdefault(
                name, Scalar(of, one.good, wanted, one.unit, one.title, one.whole, True)
            )
    return found | STUDY


def own_axes(entry: Entry) -> dict[str, tuple[str, Parameter]]:
    """Axes of an entry -> the parameter that each sets, and what its values are."""
    plain = {apart(entry, p.name): (p.name, p) for p in entry.parameters if p.is_number}
    return plain | {d.name: (d.of, d.as_parameter) for d in entry.derived}


def apart(entry: Entry, name: str) -> str:
    """The name of a parameter, as CONTROLLER.PARAMETER where an axis of the study is called so."""
    return f"{entry.name}.{name}" if name in STUDY else name


def ways(entries: Iterable[Entry]) -> dict[str, tuple[str, ...]]:
    """Parameters that several axes set -> these axes, of which a sweep uses one."""
    found: dict[str, dict[str, None]] = {}
    for entry in entries:
        for derived in entry.derived:
            found.setdefault(derived.of, {derived.of: None})[derived.name] = None
    return {of: tuple(names) for of, names in found.items()}


#: Former names of axes -> what settings, options and results call the same thing.
RENAMED = {"lambda": "pull", "p": "arm"}

_RANGE = re.compile(r"([^:]+):([^:]+):(lin|log)(\d+)")


@dataclass(frozen=True)
class Axis:
    """One axis of a grid.

    Attributes:
        name: of one of ``scalars``.
        values: distinct, in the order given.
        scalar: what it moves.
    """

    name: str
    values: tuple[float, ...]
    scalar: Scalar = field(compare=False)

    def text(self, value: float) -> str:
        """A value as tables show it."""
        return f"{value:d}" if self.scalar.whole else f"{value:.6g}"


def split_axis(text: str) -> tuple[str, str]:
    """Name and values of ``NAME=VALUES``.

    Raises:
        InputError: if there is no ``=``.
    """
    name, sign, values = text.partition("=")
    if not sign:
        raise InputError(f"Axis {text!r} must read NAME=VALUES, such as pull=1e-8:1e-4:log9.")
    return name, values


def make_axes(
    given: Mapping | Iterable, entries: Iterable[Entry] = ENTRIES
) -> tuple[tuple[Axis, ...], list[str]]:
    """Axes from names and values, and sentences about all that cannot be used.

    Args:
        entries: of the controllers that run.
        given: mapping of names to values, or pairs of them, or texts ``NAME=VALUES``; values are
            numbers or a text as on the command line.
    """
    axes: list[Axis] = []
    problems: list[str] = []
    # Those of ours that do not run are known too, so that the grid can say that they move nothing.
    known = scalars(ENTRIES) | scalars(entries)
    items = given.items() if isinstance(given, Mapping) else given
    for item in items:
        try:
            raw, values = split_axis(item) if isinstance(item, str) else item
            name = canonical(raw, known)
            if any(axis.name == name for axis in axes):
                raise InputError(f"Axis `{name}` is given twice; give its values once.")
            axes.append(Axis(name, axis_values(name, values, known[name]), known[name]))
        except InputError as error:
            problems.append(str(error))
    for of, names in ways([*ENTRIES, *entries]).items():
        several = [axis.name for axis in axes if axis.name in names]
        if len(several) > 1:
            listed = " and ".join(f"`{name}`" for name in several)
            what = known[of].label
            problems.append(f"Axes {listed} all set the {what}; give one of them.")
    if not axes and not problems:
        problems.append("A sweep needs at least one axis, such as nb=128,256 or scale=0.1:1:lin5.")
    return tuple(axes), problems


def canonical(name: str, known: Mapping[str, Scalar]) -> str:
    """Name of an axis among the known ones.

    Args:
        name: as a user writes it.
        known: from ``scalars``.

    Raises:
        InputError: with the nearest names, or with the new name of an axis that has one.
    """
    plain = str(name).strip().lower().replace("-", "_")
    exact = str(name).strip()
    if exact in known:
        return exact
    if plain not in known:
        if plain in RENAMED:
            raise InputError(f"Axis {name!r} is called `{RENAMED[plain]}` now; write that.")
        near = difflib.get_close_matches(plain, list(known), n=3)
        hint = f"the nearest are {', '.join(near)}" if near else f"known are {', '.join(known)}"
        raise InputError(f"Axis {name!r} is unknown; {hint}.")
    return plain


def axis_values(name: str, given, scalar: Scalar) -> tuple[float, ...]:
    """The values of an axis, each of the kind its scalar has.

    Raises:
        InputError: naming every value that cannot be used or is given twice, or an empty list.
    """
    whole = scalar.whole
    values = _parse(name, given, whole) if isinstance(given, str) else np.ravel(given).tolist()
    if not values:
        raise InputError(f"Axis `{name}` has no values; give at least one.")
    bad = [v for v in values if not scalar.good(v) or (scalar.whole and v != int(v))]
    twice = sorted({v for v in values if values.count(v) > 1})
    problems = []
    if bad:
        # Parentheses, since square brackets are markup on a terminal.
        unit = "" if scalar.unit == "1" else f" ({scalar.unit})"
        given = ", ".join(f"{v:g}" if is_number(v) else repr(v) for v in bad)
        problems.append(f"Values of axis `{name}` must {scalar.wanted}{unit}, but got {given}.")
    if twice:
        problems.append(
            f"Axis `{name}` has {', '.join(f'{v:g}' for v in twice)} more than once; "
            "every value makes cells of its own."
        )
    if problems:
        raise InputError("  ".join(problems))
    return tuple(int(v) if scalar.whole else float(v) for v in values)


def _parse(name: str, text: str, whole: bool) -> list[float]:
    text = text.strip()
    match = _RANGE.fullmatch(text)
    try:
        if not match:
            return [float(word) for word in text.split(",")] if text else []
        low, high, count = float(match[1]), float(match[2]), int(match[4])
    except ValueError:
        raise InputError(
            f"Axis `{name}` must be numbers such as 1,2,3 or a range such as 0.1:1:lin5 or "
            f"1e-8:1e-4:log9, but got {text!r}."
        ) from None
    if match[3] == "log" and not (low > 0 and high > 0):
        raise InputError(f"Axis `{name}` is spaced in the logarithm, so {text!r} must be positive.")
    if not (math.isfinite(low) and math.isfinite(high)) or count > 10_000:
        raise InputError(f"Axis `{name}` must run between finite numbers in at most 10 000 steps.")
    spaced = np.geomspace if match[3] == "log" else np.linspace
    values = spaced(low, high, count)
    return (np.round(values) if whole else values).tolist()
