"""Small planar frames that several tests build."""

import numpy as np

from martths_jax.structure.constraints import diaphragm
from martths_jax.structure.members import Material, Member, Node
from martths_jax.structure.planar import FIXED, PlanarFrame
from martths_jax.structure.sections import Section

STEEL = Material(E=210e9, G=81e9, density=7850.0)
WEIGHTLESS = Material(E=210e9, G=81e9)
STOUT = Section(A=4e-3, I=3e-5, A_s=2e-3)
SLENDER = Section(A=4e-3, I=3e-5)


def frame(nodes, members, supports, **more) -> PlanarFrame:
    """A frame with both sections and both materials."""
    return PlanarFrame(
        nodes={name: Node(*place) for name, place in nodes.items()},
        sections={"stout": STOUT, "slender": SLENDER},
        materials={"steel": STEEL, "weightless": WEIGHTLESS},
        members=members,
        supports=supports,
        **more,
    )


def beam(length, pieces, supports, *, angle=0.0, **member) -> PlanarFrame:
    """A straight line of equal members with nodes 0, 1, 2 ..., turned by an angle [rad]."""
    at = length * np.arange(pieces + 1) / pieces
    c, s = np.cos(angle), np.sin(angle)
    member = {"section": "stout", "material": "weightless", **member}
    return frame(
        {str(i): (x * c, x * s) for i, x in enumerate(at)},
        {f"m{i}": Member(str(i), str(i + 1), **member) for i in range(pieces)},
        supports,
    )


def two_storeys(angle=0.0, tied=False, shift=(0.0, 0.0), **member) -> PlanarFrame:
    """A sloping two-storey, one-bay frame with masses, turned by an angle and moved."""
    places = {
        "a": (0, 0),
        "b": (5, 0.5),
        "c": (0.2, 3),
        "d": (5, 3.2),
        "e": (0.4, 6),
        "f": (4.6, 6),
    }
    c, s = np.cos(angle), np.sin(angle)
    turned = {
        n: (c * x - s * y + shift[0], s * x + c * y + shift[1]) for n, (x, y) in places.items()
    }
    member = {"section": "stout", "material": "steel", **member}
    return frame(
        turned,
        {f"{a}{b}": Member(a, b, **member) for a, b in ("ac", "bd", "ce", "df", "cd", "ef")},
        {"a": FIXED, "b": FIXED},
        masses={"c": 900.0, "d": 1100.0, "e": 700.0, "f": 500.0},
        constraints=(*diaphragm("cd"), *diaphragm("ef")) if tied else (),
    )


def displacement(assembly, loads, dof) -> float:
    """Motion of a degree of freedom under static loads, name -> force."""
    f = sum(force * assembly.at(name) for name, force in loads.items())
    return float(assembly.at(dof) @ np.linalg.solve(assembly.K, f))
