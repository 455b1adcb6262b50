"""The checker's own sweeps: outer ones hold every placed copy, inner ones lie in all, as sharp as asked."""

from functools import reduce

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import MultiPoint, Polygon

from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import PlanarPose
from coop_drake.verification.inner_sweeps import inner_sweep
from coop_drake.verification.outer_sweeps import outer_sweep, turned
from coop_drake.verification.solids import Solid, Stage, colliding_pairs, team_solids
from tests.support.cases import team_tree
from tests.support.trees import configurations, placed_shape, slices_of, trees

SAMPLES = 16


@st.composite
def teams_with_slices(draw):
    tree = draw(trees(robots=(1, 1)))
    return tree, draw(slices_of(tree)), draw(st.integers(0, 1_000))


def placed_solids(tree: ComponentTree, intervals, seed):
    """Every solid with its exact copies (arcs inscribed) at sampled configurations of a slice."""
    solids = team_solids(tree)
    shapes = [s for component in tree.components for body in component.bodies for s in body.shapes]
    poses = [tree.poses(z) for z in configurations(intervals, seed, SAMPLES)]
    for solid, shape in zip(solids, shapes, strict=True):
        yield solid, [placed_shape(shape, X_WC[solid.component]) for X_WC in poses]


@given(teams_with_slices(), st.sampled_from((1e-2, 1e-4, 1e-6)))
@settings(max_examples=25, deadline=None)
def test_outer_sweeps_hold_every_copy(team, tolerance):
    tree, intervals, seed = team
    lower, upper = np.array(intervals).T
    for solid, copies in placed_solids(tree, intervals, seed):
        hull = MultiPoint(outer_sweep(solid, lower, upper, tolerance)).convex_hull
        points = shapely.points(shapely.get_coordinates(copies))
        assert shapely.distance(hull, points).max() <= solid.radius + 1e-9


@given(teams_with_slices(), st.sampled_from((1e-2, 1e-4, 1e-6)))
@settings(max_examples=25, deadline=None)
def test_inner_sweeps_lie_in_every_copy(team, tolerance):
    tree, intervals, seed = team
    lower, upper = np.array(intervals).T
    for solid, copies in placed_solids(tree, intervals, seed):
        ring = inner_sweep(solid, lower, upper, tolerance)
        if ring is not None:
            points = shapely.points(ring)
            # Copies with arcs are inscribed polygons of 128 vertices, that much smaller.
            assert max(shapely.distance(copy, points).max() for copy in copies) <= 4e-4 * solid.radius


def test_joints_that_turn_about_the_same_point_do_not_multiply_the_vertices():
    stages = tuple(Stage(axis, "revolute", 1.0, np.zeros(2), PlanarPose()) for axis in (2, 1, 0))
    solid = Solid("arm", 1, 0, np.array([[0.2, 0.0], [1.0, 0.0], [1.0, 0.1]]), 0.0, stages)
    lower, upper = np.array([0.3, -0.2, 0.1]), np.array([1.4, 0.5, 1.0])
    ring = outer_sweep(solid, lower, upper, 1e-6)
    assert len(ring) < 6_000
    angles = np.linspace(lower.sum(), upper.sum(), 500)
    copies = shapely.points(turned(solid.vertices, angles))
    assert shapely.distance(Polygon(ring), copies).max() <= 1e-12
    furthest = np.hypot(1.0, 0.1)
    assert furthest <= np.hypot(*ring.T).max() <= furthest + 2e-6


def test_sweeps_are_as_sharp_as_asked():
    """Hull and intersection of many copies, turned by theta alone, are met up to the tolerance."""
    solid = team_solids(team_tree(1, 1))[0]
    lower, upper = np.array([0.2, 0.0]), np.array([0.9, 0.0])
    angles = np.linspace(0.2, 0.9, 301)
    copies = [shapely.affinity.rotate(Polygon(solid.vertices), a, (0, 0), use_radians=True) for a in angles]
    hull = shapely.union_all(copies).convex_hull
    common = reduce(shapely.intersection, copies)
    for tolerance in (1e-3, 1e-5):
        outer = Polygon(outer_sweep(solid, lower, upper, tolerance))
        assert outer.buffer(1e-9).covers(hull)
        assert hull.buffer(tolerance + 1e-6).covers(outer)
        inner = Polygon(inner_sweep(solid, lower, upper, tolerance))
        assert common.buffer(1e-9).covers(inner)
        assert inner.buffer(tolerance + 2e-6, join_style="mitre").covers(common)


def test_a_turn_about_a_pivot_outside_leaves_nothing():
    solid = team_solids(team_tree(1, 1))[2]
    wide = np.array([-3.0, -1.8]), np.array([3.0, 1.8])
    assert inner_sweep(solid, *wide, 1e-3) is None


def test_pairs_leave_out_bodies_that_share_a_joint():
    tree = team_tree(2, 1)
    pairs = colliding_pairs(tree, team_solids(tree))
    names = {frozenset((first.name, second.name)) for first, second, *_ in pairs}
    assert frozenset(("robot_0::link_1", "robot_0::link_2")) not in names
    assert frozenset(("robot_0::base", "robot_1::base")) in names
    assert frozenset(("object", "robot_0::base")) in names
    assert all(first.component != second.component for first, second, *_ in pairs)


def test_pairs_meet_in_the_component_that_both_hang_from():
    tree = team_tree(1, 2)
    stages = {
        (first.name, second.name): counts
        for first, second, *counts in colliding_pairs(tree, team_solids(tree))
    }
    assert stages["object", "robot_0::base"] == [0, 2]
    assert stages["object", "robot_0::middle"] == [0, 1]
