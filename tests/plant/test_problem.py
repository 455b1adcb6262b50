"""The planner's question: start, goal and settings from the file, bodies from the models."""

import re

import numpy as np
import pytest

from coop_drake.errors import ScenarioError
from coop_drake.plant import planning_problem
from coop_drake.scenario import load_scenario
from tests.support.cases import CASES, case
from tests.support.edited_scenario import shipped, team_of, write_edited

START = "object: {x: 0.9, y: 2, theta: 1.57}"
GOAL = "object: {x: 5, y: 8, theta: 4.663}  # joints are free"


def problem_of(scenario):
    team, _builder = team_of(scenario)
    return planning_problem(scenario, team)


@pytest.mark.parametrize("name", sorted(CASES))
def test_shipped_problem_is_that_of_the_case(name):
    problem, expected = problem_of(shipped(name)), case(name)
    assert problem.start == pytest.approx(expected.start)
    assert problem.goal_pose == pytest.approx(expected.goal_pose)
    assert problem.goal_joints == expected.goal_joints
    assert problem.settings == expected.settings
    assert (problem.position_tolerance, problem.angle_tolerance) == (0.01, 0.02)
    assert problem.workspace.symmetric_difference(expected.workspace).area == pytest.approx(0.0, abs=1e-9)


def test_joints_and_settings_go_through(tmp_path):
    path = write_edited(
        tmp_path,
        ("robot_1: [0.0]", "robot_1: [-0.25]"),
        (GOAL, "object: {x: 5, y: 8, theta: 4.663}\n  joints: {robot_1: [-1.6]}"),
        ("angle: 0.02}", "angle: 0.05, joint: 0.1}"),
        ("gains:", "planner: {margin: 0.02}\ngains:"),
    )
    problem = problem_of(load_scenario(path))
    assert problem.start == pytest.approx([0.9, 2.0, 1.57, 0.0, -0.25])
    assert problem.goal_joints == (None, -1.6)
    assert (problem.angle_tolerance, problem.joint_tolerance) == (0.05, 0.1)
    assert problem.settings.margin == 0.02


REFUSALS = {
    "unknown robot": (
        ("robot_0: [0.0]", "robot_7: [0.0]"),
        "start.joints.robot_7",
        "robot_7",
        "one of robot_0, robot_1",
    ),
    "missing robot": (
        ("    robot_0: [0.0]\n", ""),
        "start.joints.robot_0",
        None,
        "a list of 1, the values of robot_0::elbow",
    ),
    "too many joints": (
        ("robot_0: [0.0]", "robot_0: [0.0, 1.0]"),
        "start.joints.robot_0",
        [0.0, 1.0],
        "a list of 1",
    ),
    "too few joints": (("robot_0: [0.0]", "robot_0: []"), "start.joints.robot_0", [], "a list of 1"),
    "start beyond limits": (
        ("robot_1: [0.0]", "robot_1: [1.9]"),
        "start.joints.robot_1[0]",
        1.9,
        "robot_1::elbow between its limits -1.87 and 1.87",
    ),
    "goal beyond limits": (
        (GOAL, GOAL.split("  #")[0] + "\n  joints: {robot_0: [-2]}"),
        "goal.joints.robot_0[0]",
        -2.0,
        "robot_0::elbow between its limits -1.87 and 1.87",
    ),
    "goal of an unknown robot": (
        (GOAL, GOAL.split("  #")[0] + "\n  joints: {arm: [0]}"),
        "goal.joints.arm",
        "arm",
        "one of robot_0, robot_1",
    ),
    "goal with too many joints": (
        (GOAL, GOAL.split("  #")[0] + "\n  joints: {robot_0: [0, null]}"),
        "goal.joints.robot_0",
        [0.0, None],
        "a list of 1",
    ),
    "start in a wall": (
        (START, "object: {x: 0.9, y: 0.9, theta: 1.57}"),
        "start",
        [0.9, 0.9, 1.57, 0.0, 0.0],
        "robot_1::base touches the walls, clearance -0.5000 m",
    ),
    "start outside": (
        (START, "object: {x: 20, y: 2, theta: 1.57}"),
        "start",
        ...,
        "touches the walls, clearance -13",
    ),
    "start on the wall": (
        (START, "object: {x: 0.9, y: 1.4, theta: 1.5707963267948966}"),
        "start",
        ...,
        "robot_1::base touches the walls, clearance",
    ),
    "goal in a pillar": (
        (GOAL, "object: {x: 4.1, y: 9.6, theta: 0}"),
        "goal.object",
        [4.1, 9.6, 0.0],
        "object::body touches the walls",
    ),
    "goal outside": (
        (GOAL, "object: {x: -5, y: 9.6, theta: 0}"),
        "goal.object",
        [-5.0, 9.6, 0.0],
        "touches the walls",
    ),
}


@pytest.mark.parametrize("name", sorted(REFUSALS))
def test_nonsense_is_refused_with_key_value_and_what_is_allowed(name, tmp_path):
    pair, key, value, allowed = REFUSALS[name]
    scenario = load_scenario(write_edited(tmp_path, pair))
    with pytest.raises(ScenarioError, match=re.escape(allowed)) as caught:
        problem_of(scenario)
    assert caught.value.key == key
    if value is not ...:
        assert caught.value.value == value


def test_start_in_which_the_team_touches_itself_is_refused(tmp_path):
    path = write_edited(
        tmp_path,
        ("robot_2: [0.0]", "robot_2: [1.87]"),
        ("object: {x: 1.6, y: 2, theta: 1.57}", "object: {x: 1.3, y: 1.8, theta: 1.57}"),
        case="three",
    )
    gap = 0.25 + 0.35 * np.cos(1.87) - 0.25
    with pytest.raises(ScenarioError, match=f"object::body touches robot_2::base, clearance {gap:.4f} m"):
        problem_of(load_scenario(path))


def test_goal_needs_only_the_object_inside(tmp_path):
    """Whether the arms find room there is the planner's question."""
    path = write_edited(tmp_path, (GOAL, "object: {x: 6.3, y: 9.5, theta: 1.5707963}"))
    assert problem_of(load_scenario(path)).goal_pose == pytest.approx(np.array([6.3, 9.5, 1.5707963]))


def test_goal_may_be_beyond_a_wall_or_a_limit_by_its_tolerances(tmp_path):
    """The object is half a metre wide, its middle 0.245 m from the wall, the limit of a joint 1.87 rad."""
    goal = "object: {x: 6.355, y: 8, theta: 1.5707963}\n  joints: {robot_0: [1.885]}"
    path = write_edited(tmp_path, (GOAL.split("  #")[0], goal))
    assert problem_of(load_scenario(path)).goal_joints == (1.885, None)
    given = "tolerances: {position: 0.01, angle: 0.02}"
    for tolerances, message in (
        ("tolerances: {position: 0.001, angle: 0.001}", "object::body touches the walls"),
        ("tolerances: {joint: 0.01}", r"between its limits -1\.87 and 1\.87, or beyond one by"),
    ):
        path = write_edited(tmp_path, (GOAL.split("  #")[0], goal), (given, tolerances))
        with pytest.raises(ScenarioError, match=message):
            problem_of(load_scenario(path))
