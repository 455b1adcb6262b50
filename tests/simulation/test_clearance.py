from math import pi

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from coop_drake.errors import GeometryError
from coop_drake.simulation.clearance import TeamClearance
from coop_drake.tree.component_tree import Body, Component, ComponentTree
from tests.support.cases import case, disc, rectangle, team_tree, warehouse

CONFIGURATION = st.tuples(
    st.floats(-0.5, 7.0), st.floats(-0.5, 10.0), st.floats(-pi, pi), *[st.floats(-1.87, 1.87)] * 4
)
WORKSPACE = warehouse()
TREE = team_tree(2, 2)
CLEARANCE = TeamClearance(WORKSPACE, TREE)


def core_in_world(shape, pose):
    points = pose.apply(shape.vertices)
    if len(points) == 1:
        return shapely.Point(points[0])
    return shapely.LineString(points) if len(points) == 2 else shapely.Polygon(points)


def pieces(tree, z):
    poses = tree.poses(z)
    return {
        (c, b): [(core_in_world(shape, poses[c]), shape.radius) for shape in body.shapes]
        for c, component in enumerate(tree.components)
        for b, body in enumerate(component.bodies)
    }


@settings(max_examples=60)
@given(CONFIGURATION)
def test_distances_agree_with_shapely(z):
    walls, bodies = CLEARANCE(np.array(z))
    placed = pieces(TREE, z)
    boundary = WORKSPACE.boundary
    expected = min(core.distance(boundary) - r for body in placed.values() for core, r in body)
    free = all(WORKSPACE.contains(core) for body in placed.values() for core, _ in body)
    if free:
        assert walls.distance == pytest.approx(expected, abs=1e-12)
    else:
        assert walls.distance <= 0.0
    between = min(
        first.distance(second) - r - s
        for one, two in TREE.collision_pairs
        for first, r in placed[one]
        for second, s in placed[two]
    )
    if between > 0.0:
        assert bodies.distance == pytest.approx(between, abs=1e-12)
    else:
        assert bodies.distance <= 0.0


def lone(*shapes):
    return ComponentTree((Component("object", None, None, (Body("object", None, shapes),)),), frozenset())


@pytest.mark.parametrize(
    ("z", "expected"),
    [
        ((2.0, 2.0, 0.0), 1.5),
        ((0.75, 2.0, 0.0), 0.25),
        ((0.4, 2.0, 0.0), -0.1),
        ((-1.0, 2.0, 0.0), -1.5),
        ((2.0, 2.0, pi / 4), 2.0 - 0.5 * np.sqrt(2.0)),
    ],
)
def test_a_square_in_a_square_room(z, expected):
    clearance = TeamClearance(shapely.box(0, 0, 4, 4), lone(rectangle(-0.5, 0.5, -0.5, 0.5)))
    assert clearance(np.array(z))[0].distance == pytest.approx(expected, abs=1e-12)


def test_a_pillar_swallowed_by_a_body_is_a_collision():
    room = shapely.box(0, 0, 4, 4) - shapely.box(1.9, 1.9, 2.1, 2.1)
    clearance = TeamClearance(room, lone(rectangle(-0.5, 0.5, -0.5, 0.5)))
    assert clearance(np.array([2.0, 2.0, 0.0]))[0].distance == pytest.approx(-0.4)


def test_a_disc_is_exact_and_names_its_body():
    clearance = TeamClearance(shapely.box(0, 0, 4, 4), lone(disc(0.25)))
    walls, bodies = clearance(np.array([0.3, 2.0, 0.0]))
    assert walls.distance == pytest.approx(0.05, abs=1e-15)
    assert walls.place == "object and the walls"
    assert bodies.distance == np.inf


def test_a_deep_overlap_of_bodies_is_negative_and_named():
    problem = case("base")
    clearance = TeamClearance(problem.workspace, problem.tree)
    z = problem.start.copy()
    assert clearance(z)[1].distance > 0.0
    z[3:] = (pi - 0.05, 0.0)
    _, bodies = clearance(z)
    assert bodies.distance < 0.0
    assert "robot_0" in bodies.place


def test_a_tree_without_shapes_is_refused():
    with pytest.raises(GeometryError, match="no body with a shape"):
        TeamClearance(shapely.box(0, 0, 1, 1), lone())
