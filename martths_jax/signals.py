"""The signals that the loop itself gives, in one table; a controller declares its own likewise.

What stores, exports or draws a signal asks the tables for its axes, unit and label.
"""

from __future__ import annotations

from dataclasses import replace

from martths_jax.control.base import Signal
from martths_jax.layout import Layout

#: Axis of what has a row a force.
FORCE = "interface_force"
#: Signals of every run, beside those that a controller declares (``Controller.signals``).
SIGNALS = (
    Signal("x_a", ("actuator",), "mm", "target strokes"),
    Signal("x_m", ("actuator",), "mm", "measured strokes"),
    Signal("x_hat", ("actuator",), "mm", "estimated strokes"),
    Signal("u", ("actuator",), "mm", "commands"),
    Signal("num", ("dof",), "m, rad", "numerical interface and storey motion"),
    Signal("est", ("interface_dof",), "m, rad", "estimated interface motion"),
    Signal("force", (FORCE,), "N, N m", "restoring force"),
    # Observers see these too.  It is x_m without the sensors' noise, which the seed draws again, so
    # that it is not worth its 16 B a sample and trial in what is stored.
    Signal("x", ("actuator",), "mm", "true strokes", stored=False),
)
#: What observers are given beside the signals: the response of the reference structure.
REFERENCE = Signal("reference", ("dof",), "m, rad", "response of the reference structure")


def declared(controller, layout: Layout | None = None) -> dict[str, Signal]:
    """Signals of a run with a controller, by name: the loop's own, then the controller's.

    Args:
        controller: gives signals of its own.
        layout: of the problem, whose units they have; the maRTHS benchmark's by default.
    """
    own = {signal.name: in_units(signal, layout) for signal in SIGNALS}
    return own | {signal.name: signal for signal in controller.signals}


def in_units(signal: Signal, layout: Layout | None) -> Signal:
    """A signal with the units that it has in a problem."""
    if layout is None or signal.dims[:1] not in (("dof",), ("interface_dof",), (FORCE,)):
        return signal
    units = layout.load_units if signal.dims[0] == FORCE else layout.output_units
    if signal.dims[0] == "interface_dof":
        units = units[: len(layout.interface)]
    return replace(signal, unit=", ".join(dict.fromkeys(units)))
