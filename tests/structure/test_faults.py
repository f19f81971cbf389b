"""Every fault of a frame's data is one sentence that names what is wrong."""

from dataclasses import replace

import numpy as np
import pytest

from martths_jax.errors import InputError
from martths_jax.structure.assembly import assemble, check_definite
from martths_jax.structure.constraints import Relation
from martths_jax.structure.members import Material, Member, Node
from martths_jax.structure.planar import FIXED
from martths_jax.structure.sections import Section
from tests.structure.frames import beam, frame, two_storeys


def changed(**more):
    return lambda: replace(two_storeys(), **more)


def with_member(**more):
    built = two_storeys()
    return lambda: replace(
        built, members=built.members | {"ac": replace(built.members["ac"], **more)}
    )


def with_node(name, *place):
    built = two_storeys()
    return lambda: replace(built, nodes=built.nodes | {name: Node(*place)})


FAULTS = {
    "loose node": (
        with_node("g", 1, 1),
        "Node g is loose: no member and no constraint reaches it.",
    ),
    "unknown node": (
        with_member(start="aa"),
        "Member ac names the node 'aa', which is unknown: the nearest is a.",
    ),
    "unknown section": (
        with_member(section="stuot"),
        "Member ac names the section 'stuot', which is unknown: the nearest is stout.",
    ),
    "unknown material": (
        with_member(material="oak"),
        "Member ac names the material 'oak', which is unknown: known are steel, weightless.",
    ),
    "no length": (
        with_node("c", 0, 0),
        "Member ac has no length: both its nodes stand at the same place.",
    ),
    "rigid through": (
        with_member(rigid_start=2.0, rigid_end=1.5),
        "Member ac has rigid ends of 2 m and 1.5 m, but its nodes are 3.00666 m apart.",
    ),
    "support": (
        changed(supports={"a": FIXED, "bb": FIXED}),
        "A support stands at the node 'bb', which is unknown: the nearest is b.",
    ),
    "support's word": (
        changed(supports={"a": ("x", "z")}),
        "The support of node a must be a list of x, y and rotation, but got 'z'.",
    ),
    "support as text": (
        changed(supports={"a": "xy"}),
        "The support of node a must be a list of x, y and rotation, but got 'xy'.",
    ),
    "mass nowhere": (
        changed(masses={"c.rotatoin": 1.0}),
        "A point mass is at 'c.rotatoin', which is unknown: the nearest are c.rotation, ",
    ),
    "mass below zero": (
        changed(masses={"c": -1.0}),
        "The point mass at c must be a number of at least zero (kg), but got -1.0.",
    ),
    "constraint": (
        changed(constraints=(Relation("e.x", {"c.u": 2.0}),)),
        "The constraint e.x = 2 c.u names 'c.u', which is unknown: the nearest are c.",
    ),
    "kind": (
        changed(nodes={"a": (0, 0)}),
        "Argument `nodes['a']` must be a Node, but got tuple.",
    ),
    "list of nodes": (changed(nodes=[Node(0, 0)]), "Argument `nodes` must map names to values"),
    "dot": (with_node("c.x", 1, 1), "The name of a node must have no dot in it, but one is 'c.x'."),
    "no relation": (
        changed(constraints=({"e.x": 1.0},)),
        "Argument `constraints` must be relations, but got {'e.x': 1.0}.",
    ),
    "follower": (
        lambda: Relation(3, {"a.x": 1.0}),
        "Argument `follower` must be the name of a degree of freedom, but got 3.",
    ),
    "no name": (with_member(end=3), "Argument `end` must be a name, but got 3."),
    "no flag": (with_member(rotatory=1), "Argument `rotatory` must be True or False, but got 1."),
    "no list": (
        with_member(release="end"),
        "Argument `release` must be a list of no other words than start, end, but got 'end'.",
    ),
    "support as number": (
        changed(supports={"a": 3}),
        "The support of node a must be a list of x, y and rotation, but got 3.",
    ),
    "area": (lambda: Section(-1.0, 1.0), "Argument `A` must be a number of at least zero (m^2)"),
    "inertia": (lambda: Section(1.0, 0.0), "Argument `I` must be a number above zero (m^4)"),
    "shear area": (
        lambda: Section(1.0, 1.0, -np.inf),
        "Argument `A_s` must be a number above zero (m^2), but got -inf.",
    ),
    "density": (
        lambda: Material(1.0, 1.0, -1.0),
        "Argument `density` must be a number of at least zero (kg/m^3), but got -1.0.",
    ),
    "modulus": (lambda: Material(0.0, 1.0), "Argument `E` must be a number above zero (Pa)"),
    "place": (lambda: Node(0.0, np.nan), "Argument `y` must be a finite number (m), but got nan."),
    "carried": (with_member(carried=-2), "Argument `carried` must be a number of at least zero"),
    "release": (
        with_member(release=("top",)),
        "Argument `release` must be a list of no other words than start, end, but got ('top',).",
    ),
    "mass": (with_member(mass="all"), "Argument `mass` must be one of none, lumped, consistent"),
    "terms": (lambda: Relation("a.x", {}), "Argument `terms` must map names"),
    "coefficient": (
        lambda: Relation("a.x", {"b.x": np.inf}),
        "Argument `terms` must give a finite coefficient to b.x, but got inf.",
    ),
    "contradiction": (
        lambda: assemble(
            replace(two_storeys(), constraints=(Relation("c.x", {"a.x": 1.0}),))
        ),
        "The constraint c.x = a.x contradicts the others or a support: together they hold c.x at "
        "zero. Hold it by a support if that is meant.",
    ),
    "free rotation": (
        lambda: assemble(beam(3.0, 3, {"0": FIXED, "3": FIXED}, release=("start", "end"))),
        "The frame is a mechanism: nothing resists the motion of 1.y, 1.rotation, 2.y, 2.rotation.",
    ),
    "unsupported": (
        lambda: assemble(beam(3.0, 1, {"0": ("x",)})),
        "The frame is a mechanism: nothing resists the motion of 0.y, 0.rotation, 1.y, 1.rotation.",
    ),
    "held": (
        lambda: assemble(beam(3.0, 1, {"0": FIXED, "1": FIXED})),
        "The frame cannot move: supports hold every degree of freedom.",
    ),
    "no mass": (
        lambda: assemble(beam(3.0, 1, {"0": FIXED})),
        "The frame has no mass: give it point masses, a density or mass that members carry.",
    ),
    "indefinite": (
        lambda: check_definite(np.diag([1e9, 2.0]) - [[0, 1e5], [1e5, 0]], ("a.x", "a.rotation")),
        "The stiffness is indefinite: it pushes the motion of a.x, a.rotation on.",
    ),
    "negative": (
        lambda: check_definite(np.diag([1e9, -2.0]), ("a.x", "a.rotation")),
        "The stiffness is indefinite: it pushes the motion of a.rotation on.",
    ),
    "direction": (
        lambda: assemble(two_storeys()).influence("z"),
        "Argument `direction` must be x, y or two numbers, but got 'z'.",
    ),
    "row": (
        lambda: assemble(two_storeys()).at("a.x"),
        "Argument `name` must be a free degree of freedom, but got 'a.x': the nearest are ",
    ),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_one_sentence(fault):
    build, sentence = FAULTS[fault]
    with pytest.raises(InputError) as found:
        build()
    text = str(found.value)
    assert text.startswith(sentence), text
    assert "\n" not in text and text.endswith(".")


def test_several_faults_are_a_list():
    with pytest.raises(InputError, match="The frame cannot be built \\(2 problems\\)") as found:
        changed(supports={"z": FIXED}, masses={"q": 1.0})()
    assert "1. A support stands at the node 'z'" in str(found.value)


@pytest.mark.parametrize("angle", [0.0, 0.5, -1.3])
@pytest.mark.parametrize("pieces", [1, 7, 30])
def test_mechanisms_are_found_at_every_angle_and_size_and_frames_are_not_taken_for_one(
    pieces, angle
):
    loose = beam(9.0, pieces, {"0": ("x", "y")}, angle=angle, material="steel")
    with pytest.raises(
        InputError, match=r"is a mechanism: nothing resists the motion of 0\.rotation, 1\."
    ):
        assemble(loose)
    assemble(replace(loose, supports={"0": FIXED}))


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_members_of_very_different_stiffness_are_no_mechanism(factor):
    built = two_storeys()
    s = built.sections["stout"]
    other = Section(s.A * factor, s.I * factor, s.A_s * factor)
    members = built.members | {"cd": replace(built.members["cd"], section="other")}
    assemble(replace(built, sections=built.sections | {"other": other}, members=members))


def test_a_node_that_only_a_constraint_reaches():
    """It may stand for a floor's mass; what nothing holds of it is named."""
    nodes = {"0": (0, 0), "1": (0, 3), "mass": (1, 3)}
    column = Member("0", "1", "stout", "steel")
    built = frame(
        nodes,
        {"c": column},
        {"0": FIXED},
        masses={"mass.x": 100.0},
        constraints=(Relation("mass.x", {"1.x": 1.0}),),
    )
    with pytest.raises(InputError, match=r"the motion of mass\.y, mass\.rotation\.$"):
        assemble(built)
    model = assemble(replace(built, supports=built.supports | {"mass": ("y", "rotation")}))
    assert "mass.x" not in model.coordinates


def test_a_mechanism_is_named_whole():
    """A beam on a pin turns: small motions near the pin are part of it as the large ones are."""
    with pytest.raises(InputError, match=r"2\.rotation, 3\.y, 3\.rotation\.$") as found:
        assemble(beam(3.0, 3, {"0": ("x", "y")}, material="steel"))
    assert "motion of 0.rotation, 1.y, 1.rotation, 2.y," in str(found.value)


@pytest.mark.parametrize("angle", [0.3, 0.5, 0.6, 1.1])
def test_what_round_off_leaves_of_a_stiffness_is_none(angle):
    """A bar whose end is made to slide across it: the two parts of its stiffness cancel."""
    bar = beam(3.0, 1, {"0": FIXED, "1": ("rotation",)}, angle=angle, release=("start", "end"))
    slide = Relation("1.x", {"1.y": -np.tan(angle)})
    with pytest.raises(InputError, match=r"nothing resists the motion of 1\.y\.$"):
        assemble(replace(bar, constraints=(slide,), masses={"1": 1.0}))
