"""Which bodies leave the floor, where, by how much; which walls face each other."""

import numpy as np
import pytest
from shapely import box

from coop_drake.diagnosis.contacts import contacts, deepest, narrowest_gap, overlaps
from coop_drake.tree.component_tree import Body, Component, ComponentTree, PlanarPose, TreeJoint
from tests.support.cases import disc, rectangle, team_tree

ROOM = box(0.0, 0.0, 4.0, 1.0)


def lone(shape) -> ComponentTree:
    return ComponentTree((Component("load", None, None, (Body("load", None, (shape,)),)),), frozenset())


def test_a_body_too_tall_for_a_room_sticks_out_on_both_sides():
    found = contacts(ROOM, lone(rectangle(-0.5, 0.5, -0.6, 0.6)), np.array([2.0, 0.45, 0.0]))
    assert [contact.depth for contact in found] == pytest.approx([0.15, 0.05])
    assert found[0].wall[1] == pytest.approx(0.0)
    assert found[0].point[1] == pytest.approx(-0.15)
    assert found[1].wall[1] == pytest.approx(1.0)


def test_a_body_inside_sticks_out_nowhere():
    assert contacts(ROOM, lone(disc(0.4)), np.array([2.0, 0.5, 0.3])) == []
    assert deepest(ROOM, lone(disc(0.4)), np.array([2.0, 0.5, 0.3])) == 0.0


def test_a_wall_corner_that_pierces_a_body_counts():
    floor = box(0.0, 0.0, 4.0, 4.0).difference(box(2.0, 0.0, 4.0, 2.0))
    # A square turned by 45 degrees whose side passes 0.1 m behind the corner (2, 2).
    centre = np.array([2.0, 2.0]) + (0.5 - 0.1) * np.array([-1.0, 1.0]) / np.sqrt(2.0)
    (found,) = contacts(floor, lone(rectangle(-0.5, 0.5, -0.5, 0.5)), np.array([*centre, np.pi / 4]))
    assert found.depth == pytest.approx(0.1)
    assert found.wall == pytest.approx([2.0, 2.0])


def test_the_depth_of_an_overlap_is_the_way_out():
    joint = TreeJoint("arm::slide", "prismatic", 0, 0, PlanarPose(), 1.0, (1.0, 0.0), 0.0, 3.0)
    tree = ComponentTree(
        (
            Component("load", None, None, (Body("load", None, (rectangle(-0.5, 0.5, -0.5, 0.5),)),)),
            Component("arm", 0, joint, (Body("arm", 0, (disc(0.2),)),)),
        ),
        frozenset(),
    )
    (found,) = overlaps(tree, np.array([0.0, 0.0, 0.0, 0.65]))
    assert found.bodies == ("load", "arm")
    assert found.depth == pytest.approx(0.05)
    assert overlaps(tree, np.array([0.0, 0.0, 0.0, 0.71])) == []
    assert overlaps(team_tree(), np.zeros(5)) == []


def test_a_gap_joins_walls_that_face_each_other():
    floor = box(0, 0, 2, 2).union(box(1.5, 0.8, 3.5, 1.2)).union(box(3, 0, 5, 2))
    gap = narrowest_gap(floor, [np.array([2.4, 0.8])])
    assert gap is not None
    assert gap.width == pytest.approx(0.4)
    assert gap.second == pytest.approx([2.4, 1.2])


def test_a_corner_of_a_bend_faces_the_outer_walls():
    bend = box(0, 0, 0.8, 3).union(box(0, 2, 3, 3))
    gap = narrowest_gap(bend, [np.array([0.8, 2.0])])
    assert gap is not None
    assert gap.width == pytest.approx(0.8)
    assert gap.second == pytest.approx([0.0, 2.0])
