"""Checks of the whole loop: causality, lost trials, volts, stability."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from martths_jax.benchmark import VOLT_LIMIT
from martths_jax.conformity.report import Finding
from martths_jax.conformity.stand import Stand, same
from martths_jax.control.base import Controller
from martths_jax.stability import linear_loop, margin_of, radius_of
from martths_jax.text import counted

#: Part of the strong motion after which the ground is altered.
CUT = 0.6
#: Uncertain plants whose stability is told, beside the nominal one.
WORST = 2


def causal_loop(stand: Stand) -> Finding:
    """Ground motion altered after sample k leaves all signals up to k as they were."""
    name = "causal loop"
    ground = np.array(stand.strong.acceleration)
    k = int(CUT * ground.size)
    ground[k + 1 :] *= -1
    other = stand.through(replace(stand.strong, acceleration=ground)).signals
    for signal in ("u", "x_a", "x_m"):
        early = ~same(stand.kept.signals[signal][:, : k + 1], other[signal][:, : k + 1])
        if early.any():
            first = int(np.min(np.argwhere(early)[:, 1]))
            return Finding(
                name, False, k - first + 1,
                f"Signal {signal} of sample {first} changes with the ground motion after sample "
                f"{k}; let `step` use nothing but its state and what it is told of the sample.",
                "samples ahead",
            )  # fmt: skip
    return Finding(name, True, 0, "No signal depends on later ground motion.", "samples ahead")


def lost(stand: Stand) -> Finding:
    """Trials that diverge."""
    away = np.flatnonzero(stand.whole.lost)
    trials = len(stand.plants)
    if away.size:
        return Finding(
            "lost", False, away.size,
            f"{stand.whole.describe(int(away[0]))}; bound what adapts, lower gains, or give the "
            "loop more margin.", f"of {trials} trials",
        )  # fmt: skip
    return Finding(
        "lost", True, 0, f"All of {counted(trials, 'uncertain plant')} last through the motion.",
        f"of {trials} trials",
    )  # fmt: skip


def volts(stand: Stand) -> Finding:
    """The largest valve command."""
    peak = np.asarray(stand.whole.watch.volt_peak)
    trial, actuator = np.unravel_index(np.argmax(peak), peak.shape)
    largest = float(peak[trial, actuator])
    where = f"actuator {actuator + 1} in trial {int(stand.plants.trial[trial])}"
    if largest > VOLT_LIMIT:
        return Finding(
            "volts", False, largest,
            f"It asks {where} for more than the {VOLT_LIMIT:g} V that a valve bears; lower its "
            "gains or limit u in `step`.", "V",
        )  # fmt: skip
    return Finding("volts", True, largest, f"The peak, {where}; a valve bears {VOLT_LIMIT:g}.", "V")


def stability(stand: Stand) -> tuple[Finding, ...]:
    """Spectral radius and delay margin of the frozen loop: nominal plant, and the worst ones."""
    controller = frozen_as_run(stand)
    if isinstance(controller, str):
        return tuple(Finding(name, None, None, controller) for name in ("radius", "margin"))
    A, B, C = linear_loop(stand.benchmark, controller, stand.with_nominal, opened=True)
    radius = radius_of(A + B @ C)
    uncertain = np.nan_to_num(radius[1:], nan=np.inf)
    shown = np.append(0, 1 + np.argsort(-uncertain, kind="stable")[:WORST])
    margin = margin_of(*(np.asarray(x)[shown] for x in (A, B, C)), stand.benchmark.dt)
    where = ", ".join(f"{int(stand.with_nominal.trial[i])}" for i in shown[1:])
    when = "; frozen as the strong motion ends" if stand.controller.adapts else ""
    return _radius(radius[shown], where, when), _margin(margin, where, 1e3 * stand.benchmark.dt)


def _radius(radius: np.ndarray, where: str, when: str) -> Finding:
    largest = float(np.max(radius))
    told = f"Nominal {radius[0]:.6f}, trials {where}: {_listed(radius[1:], '.6f')}{when}"
    good = bool(largest < 1)
    told += "." if good else "; the loop runs away: lower the gains, or lead by less."
    return Finding("radius", good, largest, told)


def _margin(margin: np.ndarray, where: str, period: float) -> Finding:
    least = float(np.min(margin))
    told = f"Nominal {margin[0]:.3g}, trials {where}: {_listed(margin[1:], '.3g')}"
    good = least > period
    told += "." if good else f"; one sample ({period:.3g} ms) late, and it runs away: lower gains."
    return Finding("margin", good, least, told, "ms")


def _listed(values, how: str) -> str:
    return ", ".join(format(value, how) for value in values)


def frozen_as_run(stand: Stand) -> Controller | str:
    """The linear controller that stands for one, or why there is none.

    One that adapts is frozen with each plant's own coefficients at the end of the strong motion:
    the first signal that it declares holds them.
    """
    made = stand.controller
    if not made.adapts:
        line = made.delay_line(1)
        return made if line is None else "Its delay line is no part of the linear loop."
    signal = next((s.name for s in made.signals if not s.count), None)
    kept = None if signal is None else stand.kept.signals.get(signal)
    if kept is None:
        return "It adapts and declares no signal with its coefficients to freeze."
    frozen = stand.made.frozen(stand.benchmark, np.moveaxis(kept[:, -1], 0, -1))
    if frozen.adapts:
        return "It adapts and has no `frozen`, so that no linear loop stands for it."
    return frozen
