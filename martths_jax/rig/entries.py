"""Descriptions of one transfer function: zeros, poles and gain, or coefficients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from martths_jax.errors import argument_error
from martths_jax.rig.modal import HZ, Entry, product
from martths_jax.rig.numbers import (
    Batch,
    Number,
    Root,
    is_pair,
    is_plain_zero,
    names_in,
    real_number,
    real_numbers,
    root_numbers,
    without_leading_zeros,
)
from martths_jax.rig.polynomial import Roots, horner

UNITS = {"Hz": HZ, "rad/s": 1.0}
#: What the gain of ``ZerosPoles`` is, see there.
GAINS = ("dc", "factor", "nominal")


@dataclass(frozen=True)
class ZerosPoles:
    """H(s) = k prod(s - zeros) / prod(s - poles).

    Attributes:
        zeros, poles: in `unit`, with negative real parts where stable; a complex one stands for
            itself and its conjugate.
        gain: see `gain_as`.
        gain_as: ``dc``: the static gain H(0), which every drawn plant keeps wherever its zeros and
            poles are; ``factor``: the factor k of every drawn plant, with roots in rad/s;
            ``nominal``: k of the nominal plant, whose static gain every drawn plant keeps.
        unit: of zeros and poles, ``Hz`` or ``rad/s``.

    Raises:
        InputError: for what is no number or name, or an unknown word.
    """

    zeros: tuple[Root, ...]
    poles: tuple[Root, ...]
    gain: Number
    gain_as: str = field(default="dc", kw_only=True)
    unit: str = field(default="Hz", kw_only=True)

    def __post_init__(self):
        for name in ("zeros", "poles"):
            object.__setattr__(self, name, root_numbers(name, getattr(self, name)))
        object.__setattr__(self, "gain", real_number("gain", self.gain))
        for name, known in (("gain_as", GAINS), ("unit", tuple(UNITS))):
            value = getattr(self, name)
            if value not in known:
                raise argument_error(name, f"be one of {', '.join(known)}", repr(value)[:80])
        if self.gain_as == "nominal" and names_in([self.gain]):
            raise argument_error(
                "gain", "be a fixed number where gain_as is nominal", repr(self.gain)[:80],
                "Use gain_as dc or factor for an uncertain gain.",
            )  # fmt: skip

    @property
    def names(self) -> set[str]:
        """Names of the uncertain parameters in it."""
        return names_in([*self.zeros, *self.poles, self.gain])

    def evaluate(self, batch: Batch) -> Entry:
        """The transfer functions of a batch."""
        unit = UNITS[self.unit]
        zeros, poles = (batch.described(x, unit) for x in (self.zeros, self.poles))
        k = batch.number(self.gain)
        # A zero at 0 Hz has no static gain to keep, which ``first_problem`` says.
        with np.errstate(divide="ignore", invalid="ignore"):
            if self.gain_as == "nominal":
                k = batch.of_nominal(self, k * product(zeros, 0.0) / product(poles, 0.0))
            if self.gain_as != "factor":
                k = k * product(poles, 0.0) / product(zeros, 0.0)
        named = sorted(self.poles, key=is_pair)  # as ``Roots`` has them; sorting keeps the order
        return Entry(
            numerator=lambda s: k * product(zeros, s),
            degree=len(zeros),
            lead=1.0,
            poles=poles,
            names=tuple((self.unit, p) for p in named),
        )


@dataclass(frozen=True)
class Coefficients:
    """H(s) = (b_0 s^m + ... + b_m) / (a_0 s^n + ... + a_n), s in rad/s.

    Entries of a column whose denominators are written alike share their states.

    Attributes:
        numerator: b, the highest power first; each a real number, a name, or ``Scaled``.
        denominator: a.

    Raises:
        InputError: for what is no real number or name.
    """

    numerator: tuple[Number, ...]
    denominator: tuple[Number, ...]

    def __post_init__(self):
        for name in ("numerator", "denominator"):
            numbers = without_leading_zeros(real_numbers(name, getattr(self, name)))
            if not numbers or (name == "denominator" and is_plain_zero(numbers[0])):
                raise argument_error(name, "hold a number other than zero", f"{numbers}")
            object.__setattr__(self, name, numbers)

    @property
    def names(self) -> set[str]:
        """Names of the uncertain parameters in it."""
        return names_in([*self.numerator, *self.denominator])

    def evaluate(self, batch: Batch) -> Entry:
        """The transfer functions of a batch."""
        numerator, denominator = (
            [batch.number(c) for c in side] for side in (self.numerator, self.denominator)
        )
        poles = batch.roots(self.denominator, denominator)
        return of_coefficients(numerator, denominator, poles, self.denominator)


def of_coefficients(numerator: Sequence, denominator: Sequence, poles: Roots, key) -> Entry:
    """Entry of two polynomials with coefficients (T,), the highest power first.

    Args:
        poles: roots of the denominator.
        key: hashable; entries of a column with the same one share their states.
    """
    kinds = ["real"] * len(poles.real) + ["upper"] * len(poles.upper)
    return Entry(
        numerator=lambda s: horner(numerator, s),
        degree=len(numerator) - 1,
        lead=denominator[0],
        poles=poles,
        names=tuple((key, kind, k) for k, kind in enumerate(kinds)),
        denominator=denominator,
    )
