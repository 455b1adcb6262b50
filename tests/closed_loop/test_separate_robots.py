"""Robots that are trees of their own, held at the object by constraints: the same controllers carry it."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

from coop_drake.diagram import build_closed_loop
from coop_drake.plant import base_poses, build_separate_team, build_team_plant, set_configuration
from coop_drake.scenario import Deployment, Floor, PlantSettings, Push
from coop_drake.simulation import build_maps, simulate
from tests.support.run_checks import verified_run
from tests.support.small_loop import small_maps, small_problem
from tests.support.small_plan import ANGLE_TOLERANCE, POSITION_TOLERANCE, plan_by_hand
from tests.support.small_scenario import small_scenario
from tests.support.system_checks import port_sizes

SEPARATE = PlantSettings(grasps="constraints")


@pytest.fixture(scope="module")
def logs():
    """A short way through two cells, and how the ideal plant and the other carry the object there."""
    scenario, plan = small_problem("base")
    start, goal = np.array([4.25, 3.65, 0.42, 0.1, 0.2]), np.array([4.75, 3.6, 0.6])
    plan = plan_by_hand(plan.cells[1:], start, goal, plan.joint_names)
    maps = build_maps(plan)
    return plan, *(
        simulate(replace(scenario, plant=plant), plan, maps) for plant in (PlantSettings(), SEPARATE)
    )


@pytest.mark.slow
def test_the_log_is_verified_up_to_what_grasps_yield(logs):
    plan, _, log = logs
    scenario = replace(small_problem("base")[0], plant=SEPARATE)
    assert verified_run(scenario, plan, log).answer == "arrived"


def test_the_object_arrives_in_steps_of_a_millisecond_with_all_margins_positive(logs):
    plan, _, log = logs
    assert (log.reached, log.violation) == (True, "")
    np.testing.assert_allclose(np.diff(log.times), 0.001, atol=1e-9)
    for name in ("workspace_clearance", "body_clearance", "cell_clearance", "funnel_margin", "slice_margin"):
        assert getattr(log, name).min() > 0.0, name
    assert log.energy_margin.min() > 0.0
    assert np.linalg.norm(log.object_pose[-1, :2] - plan.goal_pose[:2]) < POSITION_TOLERANCE
    assert abs(log.object_pose[-1, 2] - plan.goal_pose[2]) < ANGLE_TOLERANCE


def test_until_the_first_switch_it_goes_as_on_the_ideal_plant_but_for_one_step(logs):
    """Later, the ideal plant's longer steps switch later."""
    _, ideal, log = logs
    switch = min(one.times[np.diff(one.cell_index).argmax()] for one in (ideal, log))
    before = ideal.times[ideal.times <= switch]
    poses = [np.interp(before, log.times, log.object_pose[:, axis]) for axis in range(3)]
    away = np.abs(np.transpose(poses) - ideal.object_pose[: len(before)]).max()
    assert len(before) > 10
    assert away < SEPARATE.time_step * np.abs(ideal.object_twist).max()


def test_the_law_holds_but_for_the_constraints_give(logs):
    """What departs is far below the 10 m/s^2 and 100 N that are commanded; it is not nothing."""
    _, ideal, log = logs
    assert ideal.grasp_error.max() == 0.0
    assert log.grasp_error[0] < 1e-12
    assert 0.0 < log.grasp_error.max() <= 1e-5
    assert 1e-9 < log.acceleration_error.max() < 0.01
    assert 1e-8 < log.wrench_error.max() < 0.1
    assert 0.0 < log.governor_spread.max() < 1e-3


@pytest.mark.parametrize("team", ["elbow", "three"])
def test_every_hand_starts_at_its_grasp_wherever_the_object_is_and_moves(team):
    """Positions by the frames' distance, rates by the same distance a moment later."""
    scenario = small_scenario(team)
    builder = DiagramBuilder()
    robots = build_separate_team(scenario, builder)
    tree, keep = build_team_plant(scenario, DiagramBuilder()), builder.Build()
    context, rng = keep.CreateDefaultContext(), np.random.default_rng(2)
    plant_context, other = (
        robots.plant.GetMyMutableContextFromRoot(context),
        tree.plant.CreateDefaultContext(),
    )
    z, rates = rng.uniform(-0.8, 0.8, (2, 3 + len(robots.joints)))
    set_configuration(robots, plant_context, z, rates)
    set_configuration(tree, other, z, rates)
    np.testing.assert_allclose(base_poses(robots, plant_context), base_poses(tree, other), atol=1e-12)
    assert robots.grasps.errors(plant_context).max() < 1e-12
    plant, step = robots.plant, 1e-5
    moved = plant.GetPositions(plant_context) + step * plant.GetVelocities(plant_context)
    plant.SetPositions(plant_context, moved)
    assert robots.grasps.errors(plant_context).max() < 10.0 * step**2


def test_controllers_are_the_same_and_know_nothing_of_it():
    scenario, plan = small_problem("base")
    ideal, other = (
        build_closed_loop(replace(scenario, plant=plant), plan, small_maps())
        for plant in (PlantSettings(), SEPARATE)
    )
    assert other.team.plant.num_constraints() == len(other.controllers)
    assert ideal.team.plant.num_constraints() == 0
    for one, another in zip(ideal.controllers, other.controllers, strict=True):
        assert port_sizes(one) == port_sizes(another)
        assert [s.get_name() for s in one.GetSystems()] == [s.get_name() for s in another.GetSystems()]


def test_wrenches_at_the_grasps_are_those_of_one_tree_under_friction_and_pushes():
    """Of a team that is pushed, on bases that rub: read from constraints, and from joints."""
    scenario, plan = small_problem("base")
    deployment = Deployment(
        floor=Floor(20.0, 5.0, 0.05), pushes=(Push("robot_0", (30.0, 10.0), time=0.0, duration=1.0),)
    )
    deployed = replace(scenario, deployment=deployment, simulator=replace(scenario.simulator, max_time=0.1))
    tree, separate = (
        simulate(replace(deployed, plant=plant), plan, small_maps()) for plant in (PlantSettings(), SEPARATE)
    )
    times = np.array([0.02, 0.05, 0.08])
    for robot in range(2):
        for axis in range(3):
            found, expected = (
                np.interp(times, log.times, log.measured_wrenches[:, robot, axis]) for log in (separate, tree)
            )
            np.testing.assert_allclose(found, expected, atol=0.5)
    assert np.abs(tree.measured_wrenches[1:] - tree.commanded_wrenches[1:]).max() > 10.0
