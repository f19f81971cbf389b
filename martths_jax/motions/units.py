"""Units of acceleration, and quantities written with one (``0.4g``, ``0.3g@2.29Hz``)."""

from __future__ import annotations

import math
import re

from ..errors import InputError, argument_error

#: Standard gravity [m/s^2].
G = 9.80665

#: Factor from each unit to m/s^2, by the name ``--units`` takes.
TO_SI = {"g": G, "m/s2": 1.0, "cm/s2": 0.01}

_SPELLINGS = {
    "g": "g", "gs": "g", "gravity": "g",
    "m/s2": "m/s2", "m/s/s": "m/s2", "m/ss": "m/s2", "m/sec2": "m/s2", "m/sec/sec": "m/s2",
    "mps2": "m/s2", "ms-2": "m/s2", "m.s-2": "m/s2", "ms2": "m/s2", "m/(s.s)": "m/s2",
    "cm/s2": "cm/s2", "cm/s/s": "cm/s2", "cm/ss": "cm/s2", "cm/sec2": "cm/s2",
    "cm/sec/sec": "cm/s2", "cmps2": "cm/s2", "cms-2": "cm/s2", "cm.s-2": "cm/s2",
    "cms2": "cm/s2", "cm/(s.s)": "cm/s2", "gal": "cm/s2", "gals": "cm/s2",
}  # fmt: skip

#: Seconds in each unit of time that a header may name.
_TIMES = {
    "s": 1.0, "sec": 1.0, "secs": 1.0, "second": 1.0, "seconds": 1.0, "sek": 1.0, "sn": 1.0,
    "sekunden": 1.0, "ms": 1e-3, "msec": 1e-3, "msecs": 1e-3, "millisecond": 1e-3,
    "milliseconds": 1e-3, "us": 1e-6, "usec": 1e-6, "microsecond": 1e-6, "microseconds": 1e-6,
    "min": 60.0, "mins": 60.0, "minute": 60.0, "minutes": 60.0,
    "h": 3600.0, "hr": 3600.0, "hour": 3600.0, "hours": 3600.0,
}  # fmt: skip

# Anything else that is built like a unit: symbols with prefixes and exponents, joined by / . or x,
# maybe with a number in front or behind (``mg``, ``ft/s2``, ``g/10``, ``10-3g``, ``mm``).
_PREFIX = r"(?:milli|micro|nano|centi|deci|kilo|mega|[numcdkh])?-?"
_NAME = (
    rf"(?:{_PREFIX}(?:gals?|gs?|gravity|met(?:re|er)s?|m|s(?:ec)?|v(?:olts?)?|pa|hz|rad)|kn"
    r"|in(?:ch|ches)?|ft|feet|foot|counts?|cnts?|cts?|digits?|bits?|lsb|lbs?|psi|%g|%|percent)"
)
_FACTOR = r"[\d.]+(?:e[-+]?\d+)?(?:[-+]\d+)?"
_SYMBOL = rf"\(?(?:{_FACTOR}[.x]?)?{_NAME}(?:[-+]?\d)?\)?(?:[./x]{_FACTOR})?"
_BUILT = re.compile(rf"(?:{_FACTOR}/)?{_SYMBOL}(?:[./]\(?{_SYMBOL})*\)?")

#: Written like a unit, but found in brackets as the direction of a record.
_DIRECTIONS = frozenset({"n", "ns", "nm"})

_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")
_SIGNS = str.maketrans(
    {"²": "2", "³": "3", "⁻": "-", "−": "-", "–": "-", "¹": "1", "·": ".", "⋅": ".", "∙": ".",
     "µ": "u", "μ": "u", "×": "x", "°": "deg"}
)  # fmt: skip


def _plain(text: str) -> str:
    text = str(text).translate(_SIGNS).lower()
    text = re.sub(r"\*\*|[\s^{}'`\"]", "", text).replace("*", ".")
    text = text.replace("sec.sec", "s.s").replace("s.s", "ss") if "/(" not in text else text
    return text.removeprefix("in") if text.startswith("in") and text[2:] in _SPELLINGS else text


def is_unit(text: str) -> bool:
    """Whether `parse_unit` knows the unit."""
    return _plain(text) in _SPELLINGS


def parse_unit(text: str, where: str = "Argument `units`") -> str:
    """The canonical name (a key of `TO_SI`) of a unit of acceleration, however it is spelt."""
    if is_unit(text):
        return _SPELLINGS[_plain(text)]
    known = ", ".join(TO_SI)
    raise InputError(f"{where} names the unknown unit {str(text)!r:.60}; known units are {known}.")


def time_unit(text: str) -> float | None:
    """Seconds in the unit of time that `text` names, None where it names none."""
    return _TIMES.get(_plain(text).removesuffix("."))


def looks_like_unit(text: str) -> bool:
    """Whether `text` is built like a unit, of whatever quantity (``mg``, ``ft/s2``, ``g/10``)."""
    plain = _plain(text)
    if plain.strip("()[]") in _DIRECTIONS:
        return False
    return plain in _SPELLINGS or plain in _TIMES or bool(_BUILT.fullmatch(plain))


def parse_acceleration(value: float | str, name: str) -> float:
    """A positive acceleration [m/s^2] from a number (m/s^2) or from text such as ``0.4g``."""
    if isinstance(value, str):
        match = _QUANTITY.fullmatch(value)
        if match is None or not match[2]:
            raise argument_error(
                name, "be a number with its unit", repr(value), "Write for example 0.4g or 3.9m/s2."
            )
        number = float(match[1]) * TO_SI[parse_unit(match[2], f"Argument `{name}`")]
    else:
        number = float(value)
    if not (math.isfinite(number) and number > 0):
        raise argument_error(name, "be a positive acceleration", repr(value))
    return number


def parse_spectral_target(value: str | tuple[float | str, float], name: str = "sa"):
    """(acceleration [m/s^2], frequency [Hz]) from ``0.3g@2.29Hz``, ``0.3g@0.44s`` or a pair.

    In a pair the first entry is what `parse_acceleration` takes and the second is in Hz.
    """
    wanted = "be an acceleration at a frequency or period"
    remedy = "Write for example 0.3g@2.29Hz or 0.3g@0.44s."
    if not isinstance(value, str):
        try:
            level, frequency = value
            frequency = float(frequency)
        except (TypeError, ValueError):
            raise argument_error(name, wanted, repr(value), remedy) from None
    else:
        level, _, place = value.partition("@")
        match = _QUANTITY.fullmatch(place)
        if match is None or match[2].lower() not in ("hz", "s"):
            raise argument_error(name, wanted, repr(value), remedy)
        frequency = float(match[1])
        if match[2].lower() == "s":
            frequency = 1.0 / frequency if frequency else math.inf
    if not (math.isfinite(frequency) and frequency > 0):
        raise argument_error(name, wanted, repr(value), remedy)
    return parse_acceleration(level, name), frequency
