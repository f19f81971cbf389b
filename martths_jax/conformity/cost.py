"""What a controller costs, beside the benchmark's own."""

from __future__ import annotations

import time

import numpy as np

from martths_jax.conformity.report import Finding
from martths_jax.conformity.stand import Stand
from martths_jax.simulation import LANES

#: Rounds that are timed, one of the two after the other in each.
ROUNDS = 9


def cost(stand: Stand, beside: Stand) -> Finding:
    """Time of estimator and controller a sample and trial, in times of another's.

    Args:
        stand: of the controller.
        beside: of the one that it is compared with.
    """
    best = {id(one): np.inf for one in (stand, beside)}
    for one in (stand, beside):
        _ = one.u  # compiles
    for _ in range(ROUNDS):
        for one in (stand, beside):
            start = time.perf_counter()
            one.again(one.strokes)
            each = (time.perf_counter() - start) / (one.samples * LANES)
            best[id(one)] = min(best[id(one)], each)
    own, other = (1e9 * best[id(one)] for one in (stand, beside))
    return Finding(
        "cost", True, own / other,
        f"Estimator and controller take {own:.3g} ns a sample and trial, those of {beside.name} "
        f"{other:.3g} ns.", f"x {beside.name}",
    )  # fmt: skip
