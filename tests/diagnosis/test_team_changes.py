"""Smaller bodies lie inside larger ones, or nothing is said of all sizes from one."""

from itertools import pairwise
from math import pi

import pytest
from shapely import union_all

from coop_drake.diagnosis.diagnosing import changes, shrunk_bodies, widened_joints
from coop_drake.tree.component_tree import Body, Component, ComponentTree
from tests.planning.test_continuous_joints import turret
from tests.support.cases import disc, rectangle
from tests.support.trees import placed_shape

FOOT, LEG, OTHER = rectangle(0, 1, 0, 0.2), rectangle(0, 0.2, 0, 1), rectangle(0.8, 1, 0, 1)
BODIES = {
    "disc": ((disc(0.3),), True),
    "bar": ((FOOT,), True),
    "L": ((FOOT, LEG), True),
    "U": ((FOOT, LEG, OTHER), False),
}


def outline(tree: ComponentTree):
    body = tree.components[0].bodies[0]
    return union_all([placed_shape(shape, tree.poses((0.0, 0.0, 0.0))[0]) for shape in body.shapes])


@pytest.mark.parametrize("name", BODIES)
def test_a_body_that_is_seen_from_a_point_of_it_shrinks_into_itself(name: str) -> None:
    shapes, inwards = BODIES[name]
    tree = ComponentTree((Component("box", None, None, (Body("box", None, shapes),)),), frozenset())
    (smaller,) = changes(tree)
    assert smaller.monotone is inwards
    sizes = [outline(shrunk_bodies(tree, {"box"}, factor)) for factor in (1.0, 0.7, 0.3)]
    nested = all(larger.buffer(1e-9).covers(less) for larger, less in pairwise(sizes))
    assert nested is inwards


def test_joints_without_limits_are_not_widened() -> None:
    endless, limited = turret().tree, turret(limits=(-3.0, 3.0)).tree
    assert widened_joints(endless, 1.0).joints == endless.joints
    (wider,) = widened_joints(limited, 1.0).joints
    assert (wider.lower, wider.upper, wider.circular) == (-pi, pi, False)
    assert "wider joint range" not in [change.name for change in changes(endless)]
    assert "wider joint range" in [change.name for change in changes(limited)]
