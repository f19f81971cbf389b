"""Picture of a file's problem: frame, what of it stands in the laboratory, actuators, names."""

from __future__ import annotations

import os

import numpy as np

from martths_jax.errors import InputError
from martths_jax.problem.file.problem import FileProblem

NUMERICAL, LABORATORY, ACTUATOR = "#0072b2", "#d55e00", "#009e73"


def draw_problem(made: FileProblem, path: str | os.PathLike) -> None:
    """Write the picture; the ending of `path` picks the format.

    Raises:
        InputError: for a problem of matrices, whose places are not known, or a file that cannot be
            written.
    """
    from matplotlib.figure import Figure

    structure = made.structure
    if not structure.members:
        raise InputError(
            f"{made.path} gives matrices, which have no picture; `martths problem check` lists "
            "their degrees of freedom."
        )
    figure = Figure(figsize=(8, 6), layout="constrained")
    axis = figure.add_subplot(aspect="equal")
    for member in structure.members:
        color = LABORATORY if member.laboratory else NUMERICAL
        axis.plot(*zip(member.start, member.end, strict=True), color=color, lw=2.5,
                  solid_capstyle="round", zorder=2)  # fmt: skip
    _draw_supports(axis, structure)
    _draw_actuators(axis, made)
    _name_nodes(axis, structure)
    for color, label in ((NUMERICAL, "numerical substructure"), (LABORATORY, "laboratory"),
                         (ACTUATOR, "actuator")):  # fmt: skip
        axis.plot([], [], color=color, lw=2.5, label=label)
    axis.margins(0.12)
    axis.set(xlabel="x [m]", ylabel="y [m]", title=made.path.name)
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    try:
        figure.savefig(path, dpi=150)
    except (OSError, ValueError) as error:
        raise InputError(f"Picture {path} cannot be written: {error}.") from None


def _draw_supports(axis, structure) -> None:
    for node, held in structure.supports.items():
        fixed = len(held) > 2
        axis.plot(*structure.nodes[node], marker="s" if fixed else "^", ms=9, color="0.35",
                  zorder=3)  # fmt: skip


def _draw_actuators(axis, made: FileProblem) -> None:
    places = np.array(list(made.structure.nodes.values()))
    long = 0.2 * np.ptp(places, axis=0).max()
    for name, ends in zip(made.rig.actuators, made.rig.drawn, strict=True):
        if ends is None:
            continue
        tip, base = ends
        base = base or (tip[0] - long, tip[1])
        axis.plot(*zip(base, tip, strict=True), color=ACTUATOR, lw=5, alpha=0.6, zorder=1)
        axis.plot(*base, marker="o", ms=6, color=ACTUATOR, zorder=3)
        axis.annotate(name, base, (0, 6), textcoords="offset points", color=ACTUATOR, ha="center")


def _name_nodes(axis, structure) -> None:
    """Nodes, and at those of the interface the degrees of freedom that actuators move."""
    moved: dict[str, list[str]] = {}
    for dof in structure.interface:
        node, _, direction = dof.rpartition(".")
        moved.setdefault(node, []).append(direction)
    for node, place in structure.nodes.items():
        text = f"{node} ({', '.join(moved[node])})" if node in moved else node
        axis.plot(*place, marker="o", ms=4, color="black", zorder=4)
        axis.annotate(text, place, (5, 5), textcoords="offset points",
                      weight="bold" if node in moved else "normal")  # fmt: skip
