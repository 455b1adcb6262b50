"""Clearances, invariants and messages of a run, as they are measured for its log."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from coop_drake.errors import GeometryError
from coop_drake.simulation import Invariants, communication
from coop_drake.simulation.clearance import TeamClearance
from coop_drake.simulation.telemetry import Sample
from coop_drake.tree.component_tree import Body, Component, ComponentTree
from tests.support.cases import case, disc, rectangle, team_tree, warehouse
from tests.support.small_plan import ROOM, small_plan
from tests.support.synthetic_log import synthetic_log

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


ROOM_OF_4 = shapely.box(0, 0, 4, 4)
SQUARE = rectangle(-0.5, 0.5, -0.5, 0.5)


@pytest.mark.parametrize(
    ("room", "shape", "z", "expected"),
    [
        (ROOM_OF_4, SQUARE, (2.0, 2.0, 0.0), 1.5),
        (ROOM_OF_4, SQUARE, (0.75, 2.0, 0.0), 0.25),
        (ROOM_OF_4, SQUARE, (0.4, 2.0, 0.0), -0.1),
        (ROOM_OF_4, SQUARE, (-1.0, 2.0, 0.0), -1.5),
        (ROOM_OF_4, SQUARE, (2.0, 2.0, pi / 4), 2.0 - 0.5 * np.sqrt(2.0)),
        (ROOM_OF_4 - shapely.box(1.9, 1.9, 2.1, 2.1), SQUARE, (2.0, 2.0, 0.0), -0.4),  # it holds a pillar
        (ROOM_OF_4, disc(0.25), (0.3, 2.0, 0.0), 0.05),
    ],
)
def test_clearances_of_one_body_by_hand(room, shape, z, expected):
    walls, bodies = TeamClearance(room, lone(shape))(np.array(z))
    assert walls.distance == pytest.approx(expected, abs=1e-12)
    assert (walls.place, bodies.distance) == ("object and the walls", np.inf)


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


PLAN = small_plan(("robot_0::joint_1", "robot_1::joint_1"))


Z = PLAN.start


GOOD = Sample(
    time=1.25,
    cell=0,
    entry=0.5,
    z=Z,
    rates=np.zeros(5),
    accelerations=np.zeros(5),
    base_poses=np.zeros((2, 3)),
    governor_position=Z[:2],
    governor_spread=0.0,
    funnel_lower=np.array([0.1, -0.2, -0.2]),
    funnel_upper=np.array([0.3, 0.2, 0.25]),
    energy_margin=0.4,
    object_wrench=np.zeros(3),
    commanded_wrenches=np.ones((2, 3)),
    measured_wrenches=np.ones((2, 3)),
    grasp_error=0.0,
    base_wrenches=np.zeros((2, 3)),
    joint_torques=np.zeros(2),
    acceleration_error=1e-12,
    ready_margins=np.zeros(2),
    held=0.0,
    clock_lag=0.0,
    causes=np.zeros(0),
    alarms=np.zeros((0, 3)),
    arrived=False,
)


@pytest.fixture(scope="module")
def invariants():
    return Invariants(TeamClearance(ROOM, team_tree(2, 1)), PLAN)


def test_a_good_sample_has_positive_margins_and_no_violation(invariants):
    margins = invariants.check(GOOD)
    assert margins.violation == ""
    assert margins.workspace_clearance > 0.0
    assert margins.body_clearance > 0.0
    assert margins.cell_clearance == pytest.approx(0.8)
    assert margins.funnel_margin == pytest.approx(0.1)
    assert margins.slice_margin == pytest.approx(0.2)
    assert margins.energy_margin == 0.4
    assert invariants.check(replace(GOOD, energy_margin=0.0)).violation == ""
    assert margins.acceleration_error == 1e-12
    assert margins.wrench_error == 0.0


def moved(index, value):
    z = Z.copy()
    z[index] = value
    return z


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"z": moved(0, 1.0)}, "clearance between robot_1::base and the walls is -"),
        ({"z": moved(3, 3.1)}, "clearance between "),
        ({"z": moved(1, 4.7)}, "distance of the object to the boundary of cell 0 is -0.1 m"),
        ({"z": moved(2, 0.32)}, "distance of object angle to its funnel is -0.02 rad or m"),
        ({"z": moved(4, 0.26)}, "distance of robot_1::joint_1 to its funnel is -0.01 rad or m"),
        ({"z": moved(3, -0.35)}, "distance of robot_0::joint_1 to its slice is -0.05 rad or m"),
        ({"z": moved(4, 0.25)}, "distance of robot_1::joint_1 to its funnel is 0 rad or m"),
        ({"grasp_error": 2e-4}, "distance of an end effector to its grasp is 0.0002 m"),
        ({"energy_margin": -1e-3}, "Delta E is -0.001 m^2/s^2"),
        ({"acceleration_error": 2e-9}, "realised less commanded acceleration is 2e-09 m/s^2"),
        ({"measured_wrenches": np.full((2, 3), 1.001)}, "measured less commanded grasp wrench is 0.001 N"),
        ({"acceleration_error": np.nan}, "realised less commanded acceleration is nan m/s^2"),
    ],
)
def test_each_broken_invariant_is_named_with_time_cell_and_amount(invariants, change, message):
    violation = invariants.check(replace(GOOD, **change)).violation
    assert violation.startswith("at t = 1.25 s in cell 0: ")
    assert message in violation


def logged(cells, *robots):
    """A log in which robots have these margins at steps in these cells."""
    log = synthetic_log(case("base"), samples=len(cells))
    return replace(log, cell_index=np.array(cells), ready_margins=np.array(robots, dtype=float).T)


@pytest.mark.parametrize(
    ("cells", "robots", "reports", "announcements"),
    [
        ([0, 0, 1, 1], [[-1, 0, -1, 1], [2, 2, -1, 3]], (2, 2), 2),
        ([0] * 5, [[-1, 1, -1, -2, 1], [-1] * 5], (3, 0), 0),  # what is taken back is told, too
        ([0, 0, 1], [[1, 1, 1], [-1, 1, -1]], (2, 1), 2),  # who is ready on entry says so again
        ([0, 0], [[1.0, 1.0], [-1.0, -1.0]], (1, 0), 0),
        ([0, 0], [[-1.0, -1.0], [-1.0, -1.0]], (0, 0), 0),
    ],
)
def test_reports_are_sent_where_they_change_and_cells_are_announced(cells, robots, reports, announcements):
    statistics = communication(logged(cells, *robots))
    assert (statistics.reports, statistics.announcements) == (reports, announcements)
    assert statistics.messages == sum(reports) + announcements
