"""Limits of speed are read from models, replaced by the scenario's, kept on disk, refused if impossible."""

import numpy as np
import pytest

from coop_drake.answers.digest import problem_digest
from coop_drake.errors import ScenarioError
from coop_drake.plant import planning_problem
from coop_drake.scenario import load_scenario
from coop_drake.tree.component_tree import point_levers, turn_levers
from tests.support.edited_scenario import check_refusal, shipped, write_edited, write_with_robot
from tests.support.robot_models import Arm, urdf_arm

STATED = '\nlimits:\n  "*": {base_speed: 7, base_turn_rate: 8}'
"""What the shipped scenario says."""


def arm(*more):
    return Arm(joints=tuple(("revolute", "0 0 1", limit) for limit in more))


def limit(velocity, more=""):
    return f"<limit><lower>-1.2</lower><upper>1.5</upper><velocity>{velocity}</velocity>{more}</limit>"


def limits_of(path):
    return planning_problem(load_scenario(path)).limits


def test_velocity_limits_of_sdf_are_read_and_those_without_are_unknown(tmp_path):
    path = write_with_robot(
        tmp_path, arm(limit(0.7), "", limit(-1)).text(), "sdf",
        ("robot_0: [0.0]", "robot_0: [0.0, 0.0, 0.0]"), (STATED, ""),
    )  # fmt: skip
    limits = limits_of(path)
    assert limits.joint_rates.tolist()[:3] == [0.7, np.inf, np.inf]
    assert np.isinf(limits.base_speeds).all()


def test_limits_of_acceleration_and_effort_are_read_and_replaced(tmp_path):
    text = arm(limit(1, "<effort>7</effort><drake:acceleration>3</drake:acceleration>"), limit(1)).text()
    text = text.replace("<sdf ", '<sdf xmlns:drake="drake.mit.edu" ')
    stated = "\nlimits: {robot_1: {joint_accelerations: [4]}}"
    changes = ("robot_0: [0.0]", "robot_0: [0.0, 0.0]"), (STATED, stated)
    limits = limits_of(write_with_robot(tmp_path, text, "sdf", *changes))
    assert limits.joint_accelerations.tolist() == [3.0, np.inf, 4.0]
    assert limits.joint_efforts.tolist() == [7.0, np.inf, np.inf]


def test_limits_of_acceleration_of_urdf_are_read(tmp_path):
    text = urdf_arm().replace('velocity="1"', 'velocity="1" drake:acceleration="3"', 1)
    text = text.replace("<robot ", '<robot xmlns:drake="drake.mit.edu" ')
    limits = limits_of(
        write_with_robot(
            tmp_path, text, "urdf", ("robot_0: [0.0]", "robot_0: [0.0, 0.1]"), ("y: 2,", "y: 1.8,")
        )
    )
    assert limits.joint_accelerations.tolist()[:2] == [3.0, np.inf]
    assert np.isinf(limits.joint_efforts).all()  # no joint has a transmission


def test_velocity_limits_of_urdf_are_read(tmp_path):
    path = write_with_robot(
        tmp_path, urdf_arm(), "urdf", ("robot_0: [0.0]", "robot_0: [0.0, 0.1]"), ("y: 2,", "y: 1.8,")
    )
    assert limits_of(path).joint_rates.tolist()[:2] == [1.0, 1.0]


@pytest.mark.parametrize(
    ("said", "rates"),
    [
        ("{base_speed: 0.5, base_turn_rate: 0.8}", [0.7, 0.6]),
        ("{joint_rates: [0.2]}", [0.2, 0.2]),
        ("{joint_rates: [null, 0.3]}", [0.7, 0.3]),
    ],
)
def test_the_scenario_replaces_what_models_say(said, rates, tmp_path):
    path = write_with_robot(
        tmp_path, arm(limit(0.7), limit(0.6)).text(), "sdf", ("robot_0: [0.0]", "robot_0: [0.0, 0.0]"),
        (STATED, f"\nlimits: {{robot_0: {said}, '*': {{base_speed: 2}}}}"),
    )  # fmt: skip
    limits = limits_of(path)
    assert limits.joint_rates.tolist()[:2] == rates
    assert limits.base_speeds.tolist() == [0.5 if "speed" in said else np.inf, 2.0]
    assert limits.turn_rates.tolist() == [0.8 if "turn" in said else np.inf, np.inf]


@pytest.mark.parametrize("velocity", ["0", "nan"])
def test_an_impossible_limit_is_refused_with_its_joint_or_line(velocity, tmp_path):
    path = write_with_robot(tmp_path, arm(limit(velocity)).text())
    with pytest.raises(ScenarioError) as caught:
        planning_problem(load_scenario(path))
    assert caught.value.key.startswith("directives[")
    assert ("robot_0::joint_0" if velocity == "0" else "'nan' in <velocity>") in str(caught.value)


def test_a_negative_limit_of_urdf_is_refused_before_drake_ends_the_process(tmp_path):
    text = urdf_arm().replace('velocity="1"', 'velocity="-1"', 1)
    with pytest.raises(ScenarioError, match=r"line 2\d: '-1' in velocity of <limit> is negative"):
        planning_problem(load_scenario(write_with_robot(tmp_path, text, "urdf")))


@pytest.mark.parametrize(
    ("said", "key", "allowed"),
    [
        ("{robot_0: {base_speed: 0}}", "limits.robot_0.base_speed", "a positive number"),
        ("{robot_0: {base_speed: .nan}}", "limits.robot_0.base_speed", "a finite number"),
        ("{robot_0: {joint_rates: [-1]}}", "limits.robot_0.joint_rates[0]", "a positive number"),
        ("{'*': {joint_accelerations: [0]}}", "limits.*.joint_accelerations[0]", "a positive number"),
        ("{robot_7: {base_speed: 1}}", "limits.robot_7", "a robot, one of robot_0, robot_1"),
    ],
)
def test_impossible_limits_of_a_scenario_are_refused(said, key, allowed, tmp_path):
    check_refusal(tmp_path, (STATED, f"\nlimits: {said}"), key, ..., allowed)


def test_as_many_limits_as_joints_are_expected(tmp_path):
    for key in ("joint_rates", "joint_accelerations"):
        path = write_edited(tmp_path, (STATED, f'\nlimits: {{"*": {{{key}: [1, 2]}}}}'))
        with pytest.raises(ScenarioError, match=rf"limits\.\*\.{key}: .* a list of 1, for robot_0::"):
            planning_problem(load_scenario(path))


def test_limits_change_the_question(tmp_path):
    stated = '\nlimits: {"*": {base_speed: 0.5, joint_accelerations: [3]}}'
    path = write_edited(tmp_path, (STATED, stated))
    digests = {problem_digest(planning_problem(load_scenario(path)))}
    for less in ("", '\nlimits: {"*": {base_speed: 0.5}}'):
        digests.add(problem_digest(planning_problem(load_scenario(write_edited(tmp_path, (STATED, less))))))
    assert len(digests) == 3


@pytest.mark.parametrize("name", ["base", "elbow", "three"])
def test_levers_bound_how_a_base_moves(name):
    problem = planning_problem(shipped(name))
    tree, limits, step = problem.tree, problem.limits, 1e-6
    generator = np.random.default_rng(1)
    lower, upper = np.array([-np.pi, *tree.joint_lower]), np.array([np.pi, *tree.joint_upper])
    for component, point in zip(limits.base_components, limits.base_points, strict=True):
        levers, turning = point_levers(tree, component, point), turn_levers(tree, component)
        for axis in range(len(levers)):
            for _ in range(5):
                z = np.array([1.0, 2.0, *generator.uniform(lower, upper)])
                moved = z + step * np.eye(len(z))[2 + axis]
                one, other = tree.poses(z)[component], tree.poses(moved)[component]
                distance = np.hypot(*(other.apply(np.array(point)) - one.apply(np.array(point)))) / step
                assert distance <= levers[axis] + 1e-6
                assert abs(other.angle - one.angle) / step == pytest.approx(turning[axis], abs=1e-6)
    straight = np.zeros(3 + len(tree.joints))
    turned = straight + step * np.eye(len(straight))[2]
    ends = [tree.poses(z)[component].apply(np.array(point)) for z in (straight, turned)]
    assert np.hypot(*(ends[1] - ends[0])) / step == pytest.approx(levers[0], rel=1e-3)  # arms are straight
