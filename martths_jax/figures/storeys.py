"""The uniaxial benchmark's three storeys, what of them is tested, and their modes."""

from __future__ import annotations

import json

import numpy as np

from martths_jax.figures.source import Source
from martths_jax.figures.style import BLUE, DOUBLE, VERMILLION, Drawing, new_figure
from martths_jax.problem.uniaxial.structure import CASES, reference
from martths_jax.structure.modes import effective_masses, natural_modes

#: Half the width of the frame, and the largest displacement drawn, in storey heights.
HALF, SIZE = 0.6, 0.3
STEPS = np.linspace(0.0, 1.0, 13)


def frame(source: Source) -> Drawing:
    """The storeys at rest and in the modes of the reference structure of the study's case."""
    case = json.loads(source.study.dataset.attrs["identity"])["case"] or next(iter(CASES))
    frequency, share, shape = modes_of(case)
    figure = new_figure(DOUBLE, 68)
    axes = figure.subplots(1, 1 + len(frequency), sharey=True)
    _at_rest(axes[0], len(frequency))
    columns: dict[str, list] = {k: [] for k in ("mode", "storey", "displacement")}
    for mode, axis in enumerate(axes[1:]):
        moved = SIZE * shape[:, mode] / np.max(np.abs(shape[:, mode])) * np.sign(shape[-1, mode])
        _deformed(axis, moved)
        axis.set_title(
            f"mode {mode + 1}: {frequency[mode]:.2f} Hz\neffective mass {100 * share[mode]:.3g} %"
        )
        for storey, x in enumerate(moved, 1):
            for column, value in zip(columns.values(), (mode + 1, storey, x), strict=True):
                column.append(value)
    for axis in axes:
        axis.set(aspect="equal", ylim=(-0.25, len(frequency) + 0.3), xticks=[])
        axis.grid(visible=False)
    axes[0].set(ylabel="storey", yticks=range(len(frequency) + 1), xlim=(-1.9, 1.0))
    for axis in axes[1:]:
        axis.set_xlim(-1.05, 1.05)
    caption = (
        f"The reference structure of case {case} (dashed: the column that is tested, which the "
        "actuator moves at storey 1) and its modes, largest displacement drawn as "
        f"{SIZE:g} storey heights."
    )
    return Drawing(figure, columns, caption)


def modes_of(case: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Natural frequencies [Hz], shares of the mass [-] and shapes (storeys, modes) of a case."""
    whole = reference(case)
    omega, shape = natural_modes(whole.M, whole.K)
    mass = effective_masses(whole.M, shape, whole.influence)
    return omega / (2 * np.pi), mass / mass.sum(), shape


def _at_rest(axis, storeys: int) -> None:
    for side in (-HALF, HALF):
        axis.plot(side, 0, "s", color="0.25", ms=4, clip_on=False)
        for floor in range(storeys):
            tested = side < 0 and floor == 0
            axis.plot([side, side], [floor, floor + 1], color=VERMILLION if tested else "0.25",
                      lw=1.8, ls=(0, (3, 1)) if tested else "-")  # fmt: skip
    for floor in range(1, storeys + 1):
        axis.plot([-HALF, HALF], [floor, floor], color="0.25", lw=2.4)
    arrow = {"arrowstyle": "-|>", "lw": 0.8, "color": BLUE, "shrinkB": 2}
    axis.annotate("", (-HALF, 1), (-1.7, 1), arrowprops=arrow)
    axis.text(-1.85, 1.1, "actuator", fontsize=6, color=BLUE)
    axis.set_title("frame; dashed: its\nexperimental part")


def _deformed(axis, moved: np.ndarray) -> None:
    """Storeys at rest and displaced by (storeys,) storey heights; floors stay level."""
    at = np.concatenate([[0.0], moved])
    bend = 3 * STEPS**2 - 2 * STEPS**3
    for side in (-HALF, HALF):
        for floor in range(len(moved)):
            axis.plot([side, side], [floor, floor + 1], color="0.75", lw=0.6, ls=(0, (3, 2)))
            x = side + at[floor] + (at[floor + 1] - at[floor]) * bend
            axis.plot(x, floor + STEPS, color=BLUE, lw=1.1)
    for floor, x in enumerate(moved, 1):
        axis.plot([-HALF, HALF], [floor, floor], color="0.75", lw=0.6, ls=(0, (3, 2)))
        axis.plot([x - HALF, x + HALF], [floor, floor], color=BLUE, lw=1.6)
