"""Linear constraints against Lagrange multipliers, and what contradicts."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from scipy import linalg

from martths_jax.errors import InputError
from martths_jax.structure.assembly import assemble, free_matrices
from martths_jax.structure.constraints import (
    Relation,
    diaphragm,
    equal,
    resolve,
    rigid_link,
)
from martths_jax.structure.members import Member
from tests.structure.frames import displacement, frame, two_storeys

DOFS = tuple("abcdefg")


def matrix_of(relations):
    """(k, n) rows of B d = 0."""
    B = np.zeros((len(relations), len(DOFS)))
    for row, relation in zip(B, relations, strict=True):
        row[DOFS.index(relation.follower)] += 1.0
        for name, c in relation.terms.items():
            row[DOFS.index(name)] -= c
    return B


CHAIN = (
    Relation("a", {"b": 1.0}),
    Relation("b", {"c": 2.0, "d": -0.5}),
    Relation("d", {"e": 3.0}),
    Relation("a", {"f": 1.0, "e": 0.25}),
)


def test_a_chain_leaves_what_its_rows_leave():
    T, kept = resolve(CHAIN, DOFS)
    assert len(kept) == len(DOFS) - len(CHAIN)
    np.testing.assert_allclose(matrix_of(CHAIN) @ T, 0, atol=1e-14)
    at = [DOFS.index(name) for name in kept]
    np.testing.assert_array_equal(T[at], np.eye(len(kept)))


def test_the_order_of_relations_does_not_matter():
    """The kept names may differ, the space of motions does not."""
    T, _ = resolve(CHAIN, DOFS)
    basis = linalg.orth(T)
    for order in permutations(CHAIN):
        other, _ = resolve(order, DOFS)
        np.testing.assert_allclose(other - basis @ (basis.T @ other), 0, atol=1e-13)


def test_the_first_of_a_floor_stays():
    relations = (*equal("b", "c", "a"), Relation("c", {"e": 1.0}))
    T, kept = resolve(relations, DOFS)
    assert kept == ("b", "d", "f", "g")
    np.testing.assert_array_equal(T[[0, 1, 2, 4], 0], 1.0)


def test_saying_it_twice_changes_nothing():
    once = resolve(CHAIN, DOFS)
    again = resolve((*CHAIN, Relation("f", {"b": 1.0, "e": -0.25}), *CHAIN), DOFS)
    assert once[1] == again[1]
    np.testing.assert_allclose(once[0], again[0], atol=1e-15)
    circle = (*equal("a", "b"), *equal("b", "c"), *equal("c", "a"))
    assert resolve(circle, DOFS)[1] == ("a", "d", "e", "f", "g")


@pytest.mark.parametrize(
    "relations",
    [
        (Relation("a", {"b": 1.0}), Relation("a", {"b": 2.0})),
        (Relation("a", {"b": 1.0}), Relation("b", {"c": 1.0}), Relation("c", {"a": 0.5})),
        (Relation("a", {"a": 2.0}),),
        (Relation("a", {"b": 1.0, "c": -1.0}), Relation("c", {"b": 1.0})),
        (Relation("c", {"b": 1.0}), Relation("a", {"b": 1.0, "c": -1.0})),
        (Relation("a", {"g": 1.0}),),
    ],
)
def test_contradictions_are_refused(relations):
    free = DOFS[:-1]  # g is held
    with pytest.raises(InputError, match=r"contradicts the others or a support.*at zero"):
        resolve(relations, free, held=("g",))
    resolve((Relation("g", {"g": 0.5}), *equal("a", "b")), free, held=("g",))  # says nothing


def test_a_constrained_frame_meets_lagrange_multipliers():
    """[K B'; B 0] [d; force] = [f; 0] with a lever, a tie and a chain."""
    relations = (
        Relation("e.x", {"c.x": 1.5, "d.y": -0.3}),
        Relation("f.x", {"e.x": 1.0}),
        Relation("d.rotation", {"c.rotation": 1.0}),
    )
    built = replace(two_storeys(), constraints=relations)
    names, K, _ = free_matrices(built)
    B = np.zeros((len(relations), len(names)))
    for row, relation in zip(B, relations, strict=True):
        row[names.index(relation.follower)] = 1.0
        for name, c in relation.terms.items():
            row[names.index(name)] = -c
    f = np.random.default_rng(3).standard_normal(len(names))
    B_scaled = B * np.abs(K).max()
    both = np.block([[K, B_scaled.T], [B_scaled, np.zeros((3, 3))]])
    expected = np.linalg.solve(both, np.concatenate([f, np.zeros(3)]))[: len(names)]
    model = assemble(built)
    found = model.T @ np.linalg.solve(model.K, model.T.T @ f)
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


def test_a_diaphragm_is_a_beam_that_does_not_stretch():
    """The difference to a bar of growing stiffness falls as one over it."""
    off = []
    for factor in (1e2, 1e4):
        loose = two_storeys()
        stiff = replace(loose.sections["stout"], A=loose.sections["stout"].A * factor)
        tie = {"section": "stiff", "material": "steel", "release": ("start", "end")}
        nodes = loose.nodes | {"d": replace(loose.nodes["d"], y=loose.nodes["c"].y)}
        tied = replace(loose, nodes=nodes, constraints=(*diaphragm("cd"), *diaphragm("ef")))
        built = replace(
            loose,
            nodes=nodes,
            sections=loose.sections | {"stiff": stiff},
            members=loose.members
            | {"c=d": Member("c", "d", **tie), "e=f": Member("e", "f", **tie)},
        )
        rigid = displacement(assemble(tied), {"f.x": 1.0}, "f.x")
        off.append(displacement(assemble(built), {"f.x": 1.0}, "f.x") / rigid - 1)
    assert 0 < off[1] < 1e-5
    assert off[0] / off[1] == pytest.approx(100, rel=0.05)


def test_a_rigid_link_is_a_member_that_does_not_give():
    """Again the difference falls as one over the stiffness, for a load that turns it."""
    nodes = {"0": (0, 0), "1": (2, 0.4), "2": (2.5, 1.3)}
    beam = Member("0", "1", "stout", "steel")
    load = {"2.x": 1.0, "2.y": 0.5}
    supports = {"0": ("x", "y", "rotation")}
    plain = frame(nodes, {"b": beam}, supports, masses={"2": 1.0}, constraints=equal("2.x", "1.x"))
    linked = replace(plain, constraints=rigid_link(plain.nodes, "1", "2"))
    rigid = displacement(assemble(linked), load, "2.y")
    off = []
    for factor in (1e3, 1e5):
        s = plain.sections["stout"]
        stiff = replace(s, A=s.A * factor, I=s.I * factor, A_s=s.A_s * factor)
        arm = Member("1", "2", "stiff", "steel")
        built = replace(
            plain,
            sections=plain.sections | {"stiff": stiff},
            members=plain.members | {"arm": arm},
            constraints=(),
        )
        off.append(abs(displacement(assemble(built), load, "2.y") / rigid - 1))
    assert off[1] < 1e-4
    assert off[0] / off[1] == pytest.approx(100, rel=0.05)


def test_a_relation_may_name_its_follower_again():
    """a = a / 2 + b is a = 2 b."""
    T, kept = resolve((Relation("a", {"a": 0.5, "b": 1.0}),), ("a", "b"))
    assert kept == ("b",)
    np.testing.assert_array_equal(T, [[2.0], [1.0]])
