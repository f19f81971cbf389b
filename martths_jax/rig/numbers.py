"""Numbers of a plant's description, each fixed or uncertain, and what they are for a batch.

A number is a real or complex one, the name of an uncertain parameter, or ``Scaled``: such a
parameter times a fixed number.  Where roots are described (zeros, poles), a complex number stands
for itself and its conjugate, and so does ``Damped``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from martths_jax.errors import argument_error
from martths_jax.rig.polynomial import Roots, nominal_roots, roots


@dataclass(frozen=True)
class Scaled:
    """An uncertain parameter times a fixed number, such as a factor on a pair of poles.

    Attributes:
        by: name of the parameter.
        value: fixed number.
    """

    by: str
    value: complex

    def __post_init__(self):
        object.__setattr__(self, "value", plain("value", self.value))
        if not isinstance(self.by, str) or isinstance(self.value, str):
            raise argument_error("Scaled", "be of a parameter's name and a number", repr(self)[:80])


@dataclass(frozen=True)
class Damped:
    """A conjugate pair of roots, f (-z +- j sqrt(1 - z^2)).

    Attributes:
        frequency: f, in the unit of the other roots; a real number.
        damping: z, a real number between zero and one [-].
    """

    frequency: float | str | Scaled
    damping: float | str | Scaled

    def __post_init__(self):
        for name in ("frequency", "damping"):
            object.__setattr__(self, name, real_number(name, getattr(self, name)))


Number = float | complex | str | Scaled
Root = Number | Damped


def plain(name: str, given) -> float | complex | str:
    """`given` as a Python number, or a name as it is.

    Raises:
        InputError: if it is neither, or not finite.
    """
    if isinstance(given, str) and given:
        return given
    try:
        value = complex(given) if not isinstance(given, (bool, str)) else np.nan
    except (TypeError, ValueError):
        value = np.nan
    if not np.isfinite(value):
        raise argument_error(
            name, "be a finite number or the name of an uncertain parameter", repr(given)[:80]
        )
    return value if value.imag else value.real


def real_number(name: str, given) -> float | str | Scaled:
    """`given` as a description of a real number.

    Raises:
        InputError: if it is none.
    """
    number = given if isinstance(given, Scaled) else plain(name, given)
    if is_pair(number):
        raise argument_error(name, "be real", repr(given)[:80])
    return number


def real_numbers(name: str, given) -> tuple[float | str | Scaled, ...]:
    """Several of them, see ``real_number``."""
    if isinstance(given, (str, Mapping)) or not isinstance(given, Iterable):
        raise argument_error(name, "be a list of numbers or names", repr(given)[:80])
    return tuple(real_number(name, number) for number in given)


def root_numbers(name: str, given) -> tuple[Root, ...]:
    """`given` as descriptions of roots; of a pair that is written out, one stays.

    Raises:
        InputError: if one of them is none.
    """
    if isinstance(given, (str, Mapping)) or not isinstance(given, Iterable):
        raise argument_error(name, "be a list of numbers or names", repr(given)[:80])
    found, partners = [], []
    for root in given:
        root = root if isinstance(root, (Scaled, Damped)) else plain(name, root)
        if isinstance(root, complex) and root in partners:
            partners.remove(root)
            continue
        if isinstance(root, complex):
            partners.append(root.conjugate())
        found.append(root)
    return tuple(found)


def is_pair(root: Root) -> bool:
    """Whether a description of a root stands for a conjugate pair."""
    if isinstance(root, Scaled):
        root = root.value
    return isinstance(root, (complex, Damped))


def names_in(numbers: Iterable[Root]) -> set[str]:
    """Names of the uncertain parameters that some numbers depend on."""
    names = set()
    for number in numbers:
        if isinstance(number, Damped):
            names |= names_in([number.frequency, number.damping])
        elif isinstance(number, Scaled):
            names.add(number.by)
        elif isinstance(number, str):
            names.add(number)
    return names


def without_leading_zeros(coefficients: tuple) -> tuple:
    """Coefficients of a polynomial from the first that is not the plain number zero."""
    first = 0
    while first < len(coefficients) - 1 and is_plain_zero(coefficients[first]):
        first += 1
    return tuple(coefficients[first:])


def is_plain_zero(number) -> bool:
    """Whether a coefficient is zero whatever the parameters are."""
    return isinstance(number, (int, float, np.number)) and number == 0


class Batch(NamedTuple):
    """What the numbers of a description are evaluated with.

    Attributes:
        parameters: (T,) values of each uncertain parameter.
        trials: T.
        kept: what is remembered of the nominal plant, by key; filled where `learns`.
        learns: this is the nominal plant (T = 1, NumPy).
        xp: jax.numpy, or NumPy for work on the host.
    """

    parameters: dict[str, Any]
    trials: int
    kept: dict[Any, Any]
    learns: bool = False
    xp: Any = jnp

    def number(self, number: Number):
        """(T,) values of a number."""
        if isinstance(number, Scaled):
            return self.parameters[number.by] * number.value
        if isinstance(number, str):
            return self.parameters[number]
        return self.full(number)

    def full(self, value):
        """(T,) of one number; arrays stay what they are."""
        return self.xp.broadcast_to(self.xp.asarray(value), (self.trials,))

    def described(self, numbers: tuple[Root, ...], unit: float) -> Roots:
        """Roots that are described one by one, times `unit`."""
        real = tuple(self.number(n) * unit for n in numbers if not is_pair(n))
        return Roots(real, tuple(self._pair(n) * unit for n in numbers if is_pair(n)))

    def _pair(self, number: Root):
        if not isinstance(number, Damped):
            return self.number(number)
        f, z = self.number(number.frequency), self.number(number.damping)
        return f * (-z + 1j * self.xp.sqrt(1 - z * z))

    def roots(self, key, coefficients: list) -> Roots:
        """Roots of a polynomial with coefficients (T,), the highest power first.

        Args:
            key: under which the nominal roots are remembered.
        """
        if self.learns:
            found = self.kept[key] = nominal_roots([float(c[0]) for c in coefficients])
            return Roots(*(tuple(map(self.full, kind)) for kind in found))
        c = self.xp.stack([self.full(c) for c in coefficients], axis=1)
        return roots(c, self.kept[key])

    def of_nominal(self, key, value):
        """`value`, but of the nominal plant."""
        if self.learns:
            self.kept[key] = value
        return self.kept[key]
