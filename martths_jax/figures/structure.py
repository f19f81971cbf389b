"""The maRTHS reference frame with its nodes, interface and actuators, and its first modes."""

from __future__ import annotations

import numpy as np

from martths_jax.figures.source import Source
from martths_jax.figures.style import BLUE, DOUBLE, VERMILLION, Drawing, new_figure
from martths_jax.structure.frame import Modes, build_reference, diaphragm_map, modes
from martths_jax.structure.sections import FrameGeometry

SHOWN = 3  # modes
STEPS = np.linspace(0.0, 1.0, 13)


def frame(source: Source | None = None) -> Drawing:
    """The frame at rest and its first modes; the same for every study."""
    g = FrameGeometry()
    found = modes(build_reference(g))
    figure = new_figure(DOUBLE, 62)
    axes = figure.subplots(1, 1 + SHOWN, sharey=True, width_ratios=[1.2, *[1] * SHOWN])
    _at_rest(axes[0], g)
    columns: dict[str, list] = {k: [] for k in ("mode", "member", "x_m", "y_m")}
    for mode in range(SHOWN):
        lines = deformed(g, found, mode, size=0.22)
        axis = axes[mode + 1]
        for number, (rest, moved) in enumerate(lines):
            axis.plot(*rest, color="0.75", lw=0.6, ls=(0, (3, 2)))
            axis.plot(*moved, color=BLUE, lw=1.1)
            for x, y in moved.T:
                for column, value in zip(columns.values(), (mode + 1, number, x, y), strict=True):
                    column.append(value)
        axis.set_title(
            f"mode {mode + 1}: {found.frequency[mode]:.2f} Hz\n"
            f"effective mass {_percent(found.effective_mass[mode])}"
        )
    for axis in axes:
        axis.set(aspect="equal", xlabel="x [m]", xlim=(-0.4, 2.75), ylim=(-0.22, 2.25))
        axis.grid(visible=False)
    axes[0].set_ylabel("y [m]")
    axes[0].set_xlim(-1.1, 2.75)
    caption = (
        "The reference frame (thin lines: lighter sections; open circles: pins; squares: fixed "
        "bases; node 4 is moved by the actuators) and its first modes, largest displacement drawn "
        "as 0.22 m."
    )
    return Drawing(figure, columns, caption)


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %" if share >= 1e-4 else "< 0.01 %"


def _members(g: FrameGeometry):
    """Ends ((line, floor), (line, floor)) of columns, then beams; floor 0 is the base."""
    columns = [((line, f), (line, f + 1)) for line in range(4) for f in range(3)]
    return columns + [((bay, f), (bay + 1, f)) for bay in range(3) for f in (1, 2, 3)]


def _place(g: FrameGeometry, end) -> np.ndarray:
    return np.array([end[0] * g.bay, end[1] * g.storey])


def _at_rest(axis, g: FrameGeometry) -> None:
    for a, b in _members(g):
        p, q = _place(g, a), _place(g, b)
        column = a[0] == b[0]
        light = column and a[1] == 0 and a[0] in (1, 2)
        lab = light or (a, b) == ((1, 1), (2, 1))
        width = (0.9 if light else 1.8) if column else 1.2
        axis.plot(*np.array([p, q]).T, color=VERMILLION if lab else "0.25", lw=width,
                  solid_capstyle="round", ls=(0, (3, 1)) if lab else "-")  # fmt: skip
    for line in range(4):
        pinned = line in (1, 2)
        axis.plot(line * g.bay, 0, marker="o" if pinned else "s", ms=4.5 if pinned else 4,
                  mfc="white" if pinned else "0.25", color="0.25", mew=0.8,
                  clip_on=False)  # fmt: skip
        for floor in (1, 2, 3):
            x, y = _place(g, (line, floor))
            axis.annotate(str(3 * line + floor), (x, y), (2, 2), textcoords="offset points",
                          fontsize=6)  # fmt: skip
    pin = (2 * g.bay, g.storey - 2.4 * g.pin_offset)  # drawn lower than it is, to be seen
    axis.plot(*pin, "o", ms=2.6, mfc="white", color=VERMILLION, mew=0.7)
    node = _place(g, (1, 1))
    for drop in (-0.127, 0.127):
        arrow = {"arrowstyle": "-|>", "lw": 0.8, "color": BLUE, "shrinkB": 3}
        axis.annotate("", node, node + (-1.75, drop), arrowprops=arrow)
    axis.text(-0.98, g.storey + 0.2, "actuators", fontsize=6, color=BLUE)
    axis.set_title("frame; dashed: its\nexperimental part")


def deformed(g: FrameGeometry, found: Modes, mode: int, size: float):
    """Members at rest and in a mode shape, as [(2, 2) rest, (2, n) moved] coordinates [m].

    Args:
        size: largest nodal displacement as drawn [m].
    """
    shape = diaphragm_map() @ found.shape[:, mode]  # (38,)
    scale = size / np.max(np.hypot(shape[:12], shape[12:24]))
    scale *= np.sign(shape[2]) or 1.0  # the roof goes to the right
    return [
        (np.array([_place(g, a), _place(g, b)]).T, _curve(g, scale * shape, a, b))
        for a, b in _members(g)
    ]


def _motion_of(shape: np.ndarray, end) -> np.ndarray:
    line, floor = end
    if floor == 0:
        return np.array([0.0, 0.0, shape[{1: 36, 2: 37}[line]] if line in (1, 2) else 0.0])
    node = 3 * line + floor - 1
    return shape[[node, 12 + node, 24 + node]]


def _curve(g: FrameGeometry, shape: np.ndarray, a, b) -> np.ndarray:
    """(2, n) a member's axis through its ends' displacements and rotations (cubic).

    The column below the moment release bends as one with a hinge: its slope there follows from the
    other three values.
    """
    p, q = _place(g, a), _place(g, b)
    (u1, v1, r1), (u2, v2, r2) = _motion_of(shape, a), _motion_of(shape, b)
    length = float(np.hypot(*(q - p)))
    along = (q - p) / length
    left = np.array([-along[1], along[0]])
    w1, w2 = np.array([u1, v1]) @ left, np.array([u2, v2]) @ left
    s1, s2 = np.array([u1, v1]) @ along, np.array([u2, v2]) @ along
    if (a, b) == ((2, 0), (2, 1)):
        r2 = 1.5 * (w2 - w1) / length - 0.5 * r1
    t = STEPS
    across = (
        w1 * (1 - 3 * t**2 + 2 * t**3)
        + r1 * length * (t - 2 * t**2 + t**3)
        + w2 * (3 * t**2 - 2 * t**3)
        + r2 * length * (t**3 - t**2)
    )
    return p[:, None] + np.outer(along, length * t + s1 + t * (s2 - s1)) + np.outer(left, across)
