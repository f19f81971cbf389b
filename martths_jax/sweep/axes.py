"""The axes of a sweep: which scalars there are, and how a user writes their values.

lambda=1e-8:1e-4:log9    nine values from 1e-8 to 1e-4, evenly spaced in the logarithm
scale=0.1:1:lin5         five values from 0.1 to 1, evenly spaced
q=1e-6,1e-5              these values
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from martths_jax.campaign.fields import is_number, is_positive
from martths_jax.errors import InputError


@dataclass(frozen=True)
class Scalar:
    """A scalar that can be an axis.

    Attributes:
        setting: what it sets: a setting of the controller (``nb``, ``no``, ``pull``, ``q``) or of
            the study (``scale``, ``fs``, ``spread``, ``noise_power``, ``alpha``, ``p``).
        good: whether a value can be used.
        wanted: what it must be, to complete "must ...".
        unit: of the values.
        label: for axes of figures and for the result file.
        whole: whether values are whole numbers.
    """

    setting: str
    good: Callable[[float], bool]
    wanted: str
    unit: str
    label: str
    whole: bool = False


def _between(low: float, high: float) -> Callable[[float], bool]:
    return lambda value: is_number(value) and low <= value <= high


def _at_least(low: float) -> Callable[[float], bool]:
    return lambda value: is_number(value) and value >= low


SCALARS = {
    "nb": Scalar("nb", _at_least(9), "be a whole number of at least 9", "samples",
                 "buffer length Nb", whole=True),
    "no": Scalar("no", _at_least(0), "be a whole number of at least 0", "samples",
                 "overlap No", whole=True),
    "no_fraction": Scalar("no", _between(0, 1), "lie between 0 and 1", "1", "overlap No / Nb"),
    "hop": Scalar("no", _at_least(1), "be a whole number of at least 1", "samples",
                  "hop Nb - No", whole=True),
    "fb": Scalar("no", is_positive, "be positive", "Hz", "update rate f_b"),
    "lambda": Scalar("pull", _at_least(0), "be zero or positive", "mm^2", "pull lambda"),
    "q": Scalar("q", is_positive, "be positive", "mm^2", "process noise q"),
    "scale": Scalar("scale", lambda v: is_number(v) and v != 0, "be a finite factor but not zero",
                    "1", "scale of the motion"),
    "noise_power": Scalar("noise_power", _at_least(0), "be zero or positive", "mm^2 s",
                          "power of the sensor noise"),
    "fs": Scalar("fs", is_positive, "be positive", "Hz", "sampling rate"),
    "alpha": Scalar("alpha", lambda v: is_number(v) and 0 < v < 90, "lie between 0 and 90 degrees",
                    "degree", "angle alpha of the coupler"),
    "p": Scalar("p", is_positive, "be positive", "m", "arm p of the coupler"),
    "spread": Scalar("spread", _at_least(0), "be zero or positive", "1",
                     "spread of the plant's parameters"),
}  # fmt: skip
#: Four ways to say the overlap; a sweep uses one of them.
OVERLAPS = ("no", "no_fraction", "hop", "fb")
_ALIASES = {"pull": "lambda"}
_REFUSED = {
    "forgetting": (
        "Axis `forgetting` cannot be run: this ADFC fits the last Nb rows with equal weights "
        "(the paper's sliding window) and has no forgetting factor; `nb` sets how long it remembers"
        " and `lambda` how strongly it is pulled back."
    )
}
_RANGE = re.compile(r"([^:]+):([^:]+):(lin|log)(\d+)")


@dataclass(frozen=True)
class Axis:
    """One axis of a grid.

    Attributes:
        name: one of ``SCALARS``.
        values: distinct, in the order given.
    """

    name: str
    values: tuple[float, ...]

    @property
    def scalar(self) -> Scalar:
        """What it moves."""
        return SCALARS[self.name]

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
        raise InputError(f"Axis {text!r} must read NAME=VALUES, such as lambda=1e-8:1e-4:log9.")
    return name, values


def make_axes(given: Mapping | Iterable) -> tuple[tuple[Axis, ...], list[str]]:
    """Axes from names and values, and sentences about all that cannot be used.

    Args:
        given: mapping of names to values, or pairs of them, or texts ``NAME=VALUES``; values are
            numbers or a text as on the command line.
    """
    axes: list[Axis] = []
    problems: list[str] = []
    items = given.items() if isinstance(given, Mapping) else given
    for item in items:
        try:
            raw, values = split_axis(item) if isinstance(item, str) else item
            name = canonical(raw)
            if any(axis.name == name for axis in axes):
                raise InputError(f"Axis `{name}` is given twice; give its values once.")
            axes.append(Axis(name, axis_values(name, values)))
        except InputError as error:
            problems.append(str(error))
    ways = [axis.name for axis in axes if axis.name in OVERLAPS]
    if len(ways) > 1:
        problems.append(
            f"Axes {' and '.join(f'`{w}`' for w in ways)} all set the overlap No; give one of them."
        )
    if not axes and not problems:
        problems.append("A sweep needs at least one axis, such as nb=128,256 or scale=0.1:1:lin5.")
    return tuple(axes), problems


def canonical(name: str) -> str:
    """Name of an axis in ``SCALARS``.

    Raises:
        InputError: with the nearest names, if there is none such.
    """
    plain = str(name).strip().lower().replace("-", "_")
    plain = _ALIASES.get(plain, plain)
    if plain in _REFUSED:
        raise InputError(_REFUSED[plain])
    if plain not in SCALARS:
        near = difflib.get_close_matches(plain, list(SCALARS), n=3)
        hint = f"the nearest are {', '.join(near)}" if near else f"known are {', '.join(SCALARS)}"
        raise InputError(f"Axis {name!r} is unknown; {hint}.")
    return plain


def axis_values(name: str, given) -> tuple[float, ...]:
    """The values of an axis, each of the kind its scalar has.

    Raises:
        InputError: naming every value that cannot be used or is given twice, or an empty list.
    """
    values = _parse(name, given) if isinstance(given, str) else np.ravel(given).tolist()
    scalar = SCALARS[name]
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


def _parse(name: str, text: str) -> list[float]:
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
    return (np.round(values) if SCALARS[name].whole else values).tolist()
