"""What may act on what: no sample on an earlier one, no trial on another."""

from __future__ import annotations

import numpy as np

from martths_jax.conformity.report import Finding
from martths_jax.conformity.stand import Stand, apart, same
from martths_jax.simulation import LANES, fill

#: Samples after which strokes are altered, in parts of a drive: in its first and its last window.
CUTS = (0.3, 0.8)
#: The trial that is ill, and the one that is run alone.
ILL, ALONE = 5, 41
#: Trials of a part of a batch.
PART = 24
#: Differences below this are of round-off, above of trials that are mixed [-].
ROUND_OFF = 1e-9
MIXED = (
    "let `step` and the estimator reduce (sum, mean, max, any) over named axes in front of the "
    "trials only, never over the last one or over all."
)
ROUNDED = (
    "it multiplies matrices in a way that rounds by the place in the batch; write small products "
    "out as sums over their few terms (martths_jax.structure.modal.contract)."
)


def causal(stand: Stand) -> Finding:
    """Strokes altered after sample k leave the commands up to k as they were, bit by bit."""
    name = "causal"
    for part in CUTS:
        k = int(part * stand.samples)
        for i, signal in enumerate(("x_a", "x_m")):
            given = list(stand.strokes)
            given[i] = given[i].copy()
            given[i][k + 1 :] = 0.3 - 1.7 * given[i][k + 1 :]
            u = stand.again(tuple(given))
            early = ~same(stand.u[: k + 1], u[: k + 1])
            if early.any():
                first = int(np.argwhere(early)[0, 0])
                return Finding(
                    name, False, k - first + 1,
                    f"The command of sample {first} changes with {signal} after sample {k}; let "
                    "`step` use nothing but its state and what it is told of the sample.",
                    "samples ahead",
                )  # fmt: skip
    return Finding(name, True, 0, "No command depends on later strokes.", "samples ahead")


def independent(stand: Stand) -> Finding:
    """A permuted batch, a part of one and a trial alone have the bits of the whole."""
    rng = np.random.default_rng(stand.seed)
    batches = {
        "in another order": rng.permutation(LANES),
        "in a smaller batch": fill(np.arange(PART), LANES),
        "alone": fill(np.array([ALONE]), LANES),
    }
    name, largest, told = "trials", 0.0, []
    for what, lanes in batches.items():
        u = stand.again(tuple(x[..., lanes] for x in stand.strokes))
        distance = apart(stand.u[..., lanes], u)
        largest = max(largest, distance)
        told += [what] if distance else []
    if told:
        kind = f"differ by {largest:.2g} of the largest" if largest > ROUND_OFF else "round off"
        remedy = MIXED if largest > ROUND_OFF else ROUNDED
        return Finding(
            name, False, largest,
            f"Commands of a trial {kind} where it runs {' and '.join(told)}; {remedy}",
            "of the largest",
        )  # fmt: skip
    return Finding(
        name, True, 0.0, "A trial has the same bits in any place, in a part and alone.",
        "of the largest",
    )  # fmt: skip


def contained(stand: Stand) -> Finding:
    """Strokes of one trial that are NaN from some sample on change no other trial's commands."""
    k = int(CUTS[0] * stand.samples)
    given = tuple(x.copy() for x in stand.strokes)
    for x in given:
        x[k:, :, ILL] = np.nan
    touched = ~same(stand.u, stand.again(given)).all(axis=(0, 1))
    others = int(np.delete(touched, ILL).sum())
    if others:
        return Finding(
            "nan", False, others,
            f"Trial {ILL} turns NaN and changes {others} other trials; {MIXED}", "other trials",
        )  # fmt: skip
    return Finding("nan", True, 0, "A trial that turns NaN changes no other.", "other trials")
