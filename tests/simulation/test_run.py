"""Runs, and the invariants that are watched in each of their steps."""

import gc
import logging
import subprocess
import sys
import weakref
from dataclasses import replace
from math import pi

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.systems.framework import Diagram, DiagramBuilder

from coop_drake.errors import FieldError, GeometryError
from coop_drake.harmonic_maps import MapStore
from coop_drake.planning import planner
from coop_drake.plant import build_team_plant, planning_problem
from coop_drake.plant.problem import body_clearance, wall_clearance
from coop_drake.simulation import Invariants, build_maps, communication, run, simulate
from coop_drake.simulation.clearance import TeamClearance, team_distances
from coop_drake.simulation.maps import TOLERANCE
from coop_drake.simulation.run import joint_limits_kept_by_funnels
from coop_drake.simulation.telemetry import Sample
from coop_drake.tree.component_tree import Body, Component, ComponentTree
from tests.support.cases import case, disc, rectangle, team_tree, warehouse
from tests.support.small_loop import small_maps, small_problem
from tests.support.small_plan import ROOM, small_plan
from tests.support.small_scenario import small_scenario
from tests.support.synthetic_log import synthetic_log

# Drake warns once per process, at the first reaction force of a continuous plant whose joints have limits.
RUN = """
from dataclasses import replace
from coop_drake.simulation import simulate
from tests.support.small_loop import small_maps, small_problem
scenario, plan = small_problem("base")
assert simulate(replace(scenario, simulator=replace(scenario.simulator, max_time=0.01)), plan, small_maps())
"""


def test_a_run_does_not_alarm_about_limits_that_the_funnels_keep():
    run = subprocess.run([sys.executable, "-c", RUN], capture_output=True, text=True, check=True)
    assert "joint limits" not in run.stderr


def test_a_joint_that_starts_and_ends_at_its_limit_does_not_leave_it():
    """Its slice goes a little beyond, so that its funnel has two sides; the run does not go there."""
    scenario = small_scenario()
    limit = 1.87
    start = replace(scenario.start, joints={"robot_0": (limit,), "robot_1": (0.0,)})
    at_limit = replace(scenario, start=start, goal=replace(scenario.goal, joints={"robot_0": (limit,)}))
    problem = planning_problem(at_limit, build_team_plant(at_limit, DiagramBuilder()))
    found = planner.plan(problem, at_limit.gain_sets["scheduled"], gain_set_name="scheduled").plan
    assert max(cell.upper[1] for cell in found.cells) > limit
    log = simulate(at_limit, found, build_maps(found))
    assert log.reached
    assert log.joints[:, 0].max() <= limit


def test_other_warnings_are_heard_and_afterwards_all():
    logger = logging.getLogger("drake")

    def heard(text):
        return bool(logger.filter(logging.makeLogRecord({"msg": text})))

    limits = "Currently MultibodyPlant does not handle joint limits for continuous models. However some"
    with joint_limits_kept_by_funnels():
        assert (heard("anything else"), heard(limits)) == (True, False)
    assert heard(limits)


@pytest.fixture(scope="module")
def plan():
    return small_plan(())


def with_targets(plan, *indices):
    """The plan with targets outside of some cells."""
    transitions = list(plan.transitions)
    for index in indices:
        transitions[index] = replace(transitions[index], target=np.array([0.1, 0.1]))
    return replace(plan, transitions=tuple(transitions))


def bits(maps):
    """Everything that evaluating maps depends on, as bytes."""
    return [a_map.solution.flat.tobytes() for a_map in maps]


def test_every_map_is_accurate_to_the_tolerance(plan):
    assert max(a_map.accuracy.error_estimate for a_map in build_maps(plan)) <= TOLERANCE
    assert max(a_map.accuracy.error_estimate for a_map in build_maps(plan, tolerance=1e-9)) <= 1e-9


def test_workers_and_the_store_change_nothing(plan, tmp_path):
    one_by_one = bits(build_maps(plan, workers=1))
    assert bits(build_maps(plan, workers=4)) == one_by_one
    store = MapStore(tmp_path)
    assert bits(build_maps(plan, store=store)) == one_by_one
    assert bits(build_maps(plan, store=store)) == one_by_one
    assert store.found == len(plan.cells)


def test_progress_is_told_in_the_order_of_the_cells(plan):
    told = []
    build_maps(plan, progress=lambda stage, part: told.append((stage, part)))
    assert told == [("mapping", (k + 1) / len(plan.cells)) for k in range(len(plan.cells))]


def test_the_first_cell_that_cannot_be_mapped_is_named(plan):
    with pytest.raises(FieldError, match="cell 1 of 3: "):
        build_maps(with_targets(plan, 1, 2))
    with pytest.raises(FieldError, match=r"cell 0 of 3: .*accurate to about"):
        build_maps(plan, tolerance=1e-17)


def test_an_interrupt_ends_the_building(plan):
    def interrupt(stage, part):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        build_maps(plan, progress=interrupt)


def inside(diagram):
    """A diagram and everything in it."""
    yield diagram
    for system in diagram.GetSystems():
        yield from inside(system) if isinstance(system, Diagram) else [system]


@pytest.fixture
def built(monkeypatch):
    """Weak references to every system of the loops that are built from here on."""
    seen, build = [], run.build_closed_loop

    def watched(*arguments, **options):
        loop = build(*arguments, **options)
        seen.extend(weakref.ref(system) for system in (*inside(loop.diagram), loop.team.plant))
        return loop

    monkeypatch.setattr(run, "build_closed_loop", watched)
    return seen


def test_no_block_diagram_or_plant_outlives_its_run(built):
    scenario, plan = small_problem("base")
    brief = replace(scenario, simulator=replace(scenario.simulator, max_time=0.05))
    maps = small_maps()
    gc.disable()  # What a run makes stays young, and the run itself has to find it.
    try:
        log = simulate(brief, plan, maps)
    finally:
        gc.enable()
    assert len(log.times) > 1
    assert len(built) > 5
    assert [system().get_name() for system in built if system() is not None] == []


def test_a_run_that_breaks_off_leaves_nothing_either(built):
    def stop(stage, part):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(*small_problem("base"), small_maps(), progress=stop)
    gc.collect()
    assert [system().get_name() for system in built if system() is not None] == []


# Clearances, invariants and messages of a run, as they are measured for its log.


CONFIGURATION = st.tuples(
    st.floats(-0.5, 7.0), st.floats(-0.5, 10.0), st.floats(-pi, pi), *[st.floats(-1.87, 1.87)] * 4
)

WORKSPACE = warehouse()

TREE = team_tree(2, 2)

CLEARANCE = TeamClearance(WORKSPACE, TREE)


@settings(max_examples=60)
@given(CONFIGURATION)
def test_distances_are_those_that_shapely_finds_before_a_run(z):
    walls, _, bodies, _ = team_distances(*CLEARANCE.kernel_arguments, np.array(z))
    poses, parts = TREE.poses(z), TREE.components
    to_walls = min(
        wall_clearance(body, pose, WORKSPACE)
        for pose, part in zip(poses, parts, strict=True)
        for body in part.bodies
    )
    between = min(
        body_clearance(parts[i].bodies[j], poses[i], parts[k].bodies[m], poses[k])
        for (i, j), (k, m) in TREE.collision_pairs
    )
    for found, expected in ((walls, to_walls), (bodies, between)):
        assert found == pytest.approx(expected, abs=1e-12) if expected > 0.0 else found <= 0.0


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
    clearance = TeamClearance(room, lone(shape))
    walls, piece, bodies, _ = team_distances(*clearance.kernel_arguments, np.array(z))
    assert walls == pytest.approx(expected, abs=1e-12)
    assert (clearance.wall_place(piece), bodies) == ("object and the walls", np.inf)


def test_a_deep_overlap_of_bodies_is_negative_and_named():
    problem = case("base")
    clearance = TeamClearance(problem.workspace, problem.tree)
    z = problem.start.copy()
    assert team_distances(*clearance.kernel_arguments, z)[2] > 0.0
    z[3:] = (pi - 0.05, 0.0)
    *_, bodies, pair = team_distances(*clearance.kernel_arguments, z)
    assert bodies < 0.0
    assert "robot_0" in clearance.pair_place(pair)


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
