"""The step of a column of times, as far as its printed digits say it."""

from __future__ import annotations

import numpy as np

from ..errors import InputError

#: Largest departure of a time stamp from the uniform grid, as a fraction of the step, that is
#: passed over whatever the digits are: far below one missing or doubled sample.
TIME_TOLERANCE = 0.02

#: The coarsest last digit that times may be rounded to, as a fraction of the step.  Steps then
#: differ by less than half a step from each other; at a missing or doubled sample by more.
ROUNDED_TOLERANCE = 0.49

#: Decimals that times may be rounded to, and how far (relative) a step may be off for that.
_DECIMALS = range(7)
_LOOSE = 1e-3

#: Whole rates that are tried.
_RATES = 200


def uniform_step(
    time: np.ndarray, where: str, lines: list[int] | None = None, dt: float | None = None
) -> tuple[float, tuple[str, ...]]:
    """Time step [s] of a uniform, increasing time axis (n,) [s], and notices.

    The end points say the step.  Times that are rounded, to d decimals, leave it uncertain by
    10^-d / (n - 1): within that it is the given `dt` [s], else 1/f where one whole rate f [Hz]
    fits.

    Raises:
        InputError: times that do not increase, are not uniform, or have too few decimals.
    """
    time = np.asarray(time, dtype=np.float64).ravel()
    if time.size < 2:
        raise InputError(f"{where} holds one row of numbers, but a motion needs at least 2.")
    finite = bool(np.all(np.isfinite(time)))
    unit = _last_decimal(time) if finite else 0.0
    with np.errstate(all="ignore"):
        step = float((time[-1] - time[0]) / (time.size - 1))
        departure = np.abs(time - (time[0] + step * np.arange(time.size)))
    exact = finite and np.max(departure) <= 1e-9 * step
    if finite and dt and 0 < unit and not exact and _fits(time, dt, unit):
        return dt, ()
    few = finite and np.isfinite(step) and step > 0 and unit > ROUNDED_TOLERANCE * step
    if few and np.max(departure) > TIME_TOLERANCE * step and np.max(departure) <= unit:
        raise InputError(
            f"{where}: its times have too few decimals ({_count(unit)}) for a step near {step:.3g} "
            "s; give the time step in `dt` (--dt 0.001), or print more decimals."
        )
    rounding = 1.001 * unit if unit <= ROUNDED_TOLERANCE * step else 0.0
    allowed = max(TIME_TOLERANCE * step, rounding)
    _refuse_uneven(time, step, departure, allowed, where, lines)
    if exact:
        return step, ()
    return _snapped(time, step, unit, where)


def is_time(values: np.ndarray) -> bool:
    """Whether numbers could be a time axis: they increase, by one step but for rounding."""
    try:
        uniform_step(values, "Column")
    except InputError:
        return False
    return True


def _refuse_uneven(time, step, departure, allowed, where, lines) -> None:
    """`InputError` at the first time that is not finite, not later, or off the grid."""
    bad = np.flatnonzero(~np.isfinite(time))
    with np.errstate(all="ignore"):
        steps = np.diff(time)
        if not bad.size:
            bad = np.flatnonzero(~(steps > 0)) + 1
        uneven = np.abs(steps - step) > 2 * TIME_TOLERANCE * step
        if not bad.size and np.max(departure) > allowed:
            typical = np.median(steps)
            bad = np.flatnonzero(np.abs(steps - typical) > max(allowed, 0.02 * typical)) + 1
            bad = bad if bad.size else np.array([int(np.argmax(departure))])
        elif not bad.size and np.any(uneven):
            bad = np.flatnonzero(np.abs(steps - step) > allowed + allowed / steps.size) + 1
    if bad.size or not (np.isfinite(step) and step > 0):
        first = int(bad[0]) if bad.size else 0
        place = f"line {lines[first]}" if lines else f"sample {first + 1}"
        before = f" after {time[first - 1]:.10g}" if first else ""
        raise InputError(
            f"{where}, {place}: found the time {time[first]:.10g}{before}, but the time step "
            "must be the same, and positive, throughout; interpolate the record to a uniform "
            "step first."
        )


def _last_decimal(time: np.ndarray) -> float:
    """10^-d for the fewest decimals d that write every time, 0 where none up to 6 does."""
    for decimals in _DECIMALS:
        scaled = time * 10.0**decimals
        if np.all(np.abs(scaled - np.round(scaled)) <= 1e-9 * np.maximum(1.0, np.abs(scaled))):
            return 10.0**-decimals
    return 0.0


def _count(unit: float) -> int:
    return round(-np.log10(unit))


def _fits(time: np.ndarray, dt: float, unit: float) -> bool:
    """Whether the times are those of step `dt`, rounded or cut off to `unit`."""
    if not (np.isfinite(dt) and dt > 0):
        return False
    away = time - time[0] - dt * np.arange(time.size)
    return bool(np.max(np.abs(away)) <= 1.001 * unit and np.ptp(away) <= 1.001 * unit)


def _snapped(
    time: np.ndarray, step: float, unit: float, where: str
) -> tuple[float, tuple[str, ...]]:
    """`step` [s], or 1/f for the one whole rate f [Hz] whose times round to these."""
    doubt = unit / (time.size - 1)
    first = np.ceil(1 / (step + doubt))
    last = np.floor(1 / (step - doubt)) if step > doubt else np.inf
    if doubt > 0 and last - first < _RATES:
        fitting = [f for f in np.arange(first, last + 1) if _fits(time, 1 / f, unit)]
        if len(fitting) == 1:
            return float(1 / fitting[0]), ()
    if doubt <= _LOOSE * step:
        return step, ()
    return step, (
        f"{where}: its times are rounded, so that the step {step:.6g} s is known to within "
        f"{100 * doubt / step:.2g} % only; give it in `dt` (--dt) if you know it better.",
    )
