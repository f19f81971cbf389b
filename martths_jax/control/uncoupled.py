"""What compensators of one actuator by itself have in common: numbers of an entry, and a filter.

Such a compensator has a field for each parameter of its entry, ``name_1`` and ``name_2`` where the
actuators differ, and commands u_i from x_a,i alone.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from types import MappingProxyType

import jax.numpy as jnp
import numpy as np

from martths_jax.control.adaptive.arguments import known
from martths_jax.control.base import Controller
from martths_jax.control.entry import Entry, Parameter
from martths_jax.control.estimators import DirectMeasurement, design_kalman
from martths_jax.errors import argument_error

#: What the strokes are estimated with: the Kalman filter on the nominal plant, or nothing.
ESTIMATES = ("kalman", "measured")
#: Parameters of every such compensator; the noise is that of the other controllers' filter.
FILTER = (
    Parameter("q", "q", "process noise", 3e-5, "mm^2", 0.0, above=True),
    Parameter("estimate", "", "strokes that are handed on", "kalman", choices=ESTIMATES,
              kind="static"),
)  # fmt: skip


def gain_and_time(
    i: int, gain: float, name: str, symbol: str, label: str, value: float
) -> tuple[Parameter, Parameter]:
    """Parameters of actuator i, both tunable: a gain, and a time of up to 0.2 s.

    Args:
        i: 1 or 2.
        gain: default of ``gain_i`` [-].
        name, symbol, label: of the time, without the actuator; value: its default [s].
    """
    return (
        Parameter(f"gain_{i}", f"g_{i}", f"gain of actuator {i}", gain, "1", 0.0, above=True,
                  kind="tunable"),
        Parameter(f"{name}_{i}", f"{symbol}_{i}", f"{label} of actuator {i}", value, "s", 0.0, 0.2,
                  kind="tunable"),
    )  # fmt: skip


def numbers(*names: str) -> MappingProxyType:
    """``Controller.shared_axes`` of fields that are one number, or one a trial; q is one."""
    return MappingProxyType(dict.fromkeys((*names, "q"), 0))


def both(text: str) -> tuple[str, str]:
    """The names of a field that each actuator has its own of."""
    return f"{text}_1", f"{text}_2"


def out_of_range(controller: Controller, entry: Entry) -> list[str]:
    """Sentences about fields that their entry does not allow; what is traced has no value yet."""
    found = []
    for p in entry.parameters:
        value = getattr(controller, p.name)
        given = known(value)
        if given is None:
            good = value is not None or p.default is None
        elif p.is_number and given.dtype != object:
            good = given.ndim < 2 and all(map(p.good, given.ravel().tolist()))
        else:
            good = p.good(value)
        if not good:
            found.append(str(argument_error(p.name, p.wanted, f"{value!r:.80}")))
    return found


def as_arrays(controller: Controller, names: Iterable[str]) -> Controller:
    """The controller with some fields as float64 arrays, as the loop wants them."""
    return replace(controller, **{n: jnp.asarray(getattr(controller, n), float) for n in names})


def ready(controller: Controller, benchmark) -> Controller:
    """The controller with its filter, and with its numbers as arrays.

    Args:
        controller: with fields `q` [mm^2], `estimate` (of ``ESTIMATES``) and `estimator`.
        benchmark: gives the nominal plant and the sensor noise.
    """
    made = as_arrays(controller, controller.shared_axes)
    if controller.estimate == "measured":
        return replace(made, estimator=DirectMeasurement())
    filtered = design_kalman(benchmark.plant_model, controller.q, benchmark.r_mm2)
    return replace(made, estimator=filtered)


def per_actuator(controller: Controller, name: str) -> tuple:
    """The two values of a field that each actuator has its own of."""
    return tuple(getattr(controller, one) for one in both(name))


def whole_samples(seconds: float, fs: float) -> int:
    """A static time as samples, to the nearest."""
    return int(np.floor(seconds * fs + 0.5))
