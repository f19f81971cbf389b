"""What is unlikely of a record, and its likely cause: notices, no refusals."""

from __future__ import annotations

from .record import Record
from .units import G

#: Limits of what strong-motion records are: PGA [m/s^2], time step [s].
LARGEST_PGA, SMALLEST_PGA = 5.0 * G, 1e-4 * G
COARSEST_STEP = 0.1


def plausibility(record: Record, unit: str) -> tuple[str, ...]:
    """Sentences about a PGA above 5 g or below 1e-4 g, and a time step above 0.1 s or of 1 s.

    Args:
        record: the record in m/s^2.
        unit: the unit that its numbers were read in.
    """
    notices = []
    name = f"Motion `{record.name}`"
    others = {"g": "cm/s2 or m/s2", "m/s2": "cm/s2", "cm/s2": "g or m/s2"}
    if record.pga > LARGEST_PGA:
        likely = others[unit] if unit != "cm/s2" else "counts"
        notices.append(
            f"{name} has a PGA of {record.pga / G:.4g} g, more than any record; its numbers are "
            f"likely in {likely} instead of {unit}, or one of them is no sample."
        )
    elif record.pga < SMALLEST_PGA:
        likely = {"cm/s2": "g or m/s2", "m/s2": "g"}.get(unit, "another unit")
        notices.append(
            f"{name} has a PGA of {record.pga / G:.4g} g, too little to be felt; its numbers are "
            f"likely in {likely} instead of {unit}, or are no acceleration."
        )
    if record.dt == 1.0:
        notices.append(
            f"{name} has a time step of exactly 1 s; its times likely count rows: give the step in "
            "`dt` (--dt)."
        )
    elif record.dt > COARSEST_STEP:
        notices.append(
            f"{name} has a time step of {record.dt:.4g} s, too coarse for strong motion; its times "
            "are likely in ms, or rows were left out."
        )
    return tuple(notices)
