"""Wrong files are refused with file, key, value and what is allowed."""

import pytest

from coop_drake.errors import ScenarioError
from coop_drake.scenario import load_scenario
from tests.support.edited_scenario import check_refusal

START = "object: {x: 0.9, y: 2, theta: 1.57}"
OUTER = "[0, 0], [1.8, 0], [1.8, 3.6]"

CASES = {
    "unknown section": (("gains:", "gain:"), "gain", {"selected": "scheduled"}, "one of the keys workspace"),
    "unknown key": ((START, START[:-1] + ", z: 1}"), "start.object.z", 1, "one of the keys x, y, theta"),
    "missing section": (
        ("object: object\n\nstart:", "object: object\n\nbegin:"),
        "begin",
        ...,
        "one of the keys",
    ),
    "missing key": ((START, "object: {x: 0.9, y: 2}"), "start.object.theta", None, "this key is required"),
    "missing joints": (("  joints:", "  joint:"), "start.joint", ..., "one of the keys object, joints"),
    "text for number": (
        (START, "object: {x: left, y: 2, theta: 1}"),
        "start.object.x",
        "left",
        "a finite number",
    ),
    "bool for number": (
        (START, "object: {x: yes, y: 2, theta: 1}"),
        "start.object.x",
        True,
        "a finite number",
    ),
    "list for number": (
        (START, "object: {x: [1], y: 2, theta: 1}"),
        "start.object.x",
        [1],
        "a finite number",
    ),
    "number for mapping": ((START, "object: 3"), "start.object", 3, "a mapping with the keys x, y, theta"),
    "not a number": ((START, "object: {x: .nan, y: 2, theta: 1}"), "start.object.x", ..., "a finite number"),
    "infinite": (
        (START, "object: {x: 1, y: -.inf, theta: 1}"),
        "start.object.y",
        -float("inf"),
        "a finite number",
    ),
    "huge": ((START, "object: {x: 1e300, y: 2, theta: 1}"), "start.object.x", 1e300, "between -1e+06 and"),
    "whole number too long for a float": (
        (START, "object: {x: 1" + 400 * "0" + ", y: 2, theta: 1}"),
        "start.object.x",
        10**400,
        "a number between",
    ),
    "coarse maps": (("gains:", "maps: {tolerance: 0.1}\ngains:"), "maps.tolerance", 0.1, "less than 0.01"),
    "maps without error": (
        ("gains:", "maps: {tolerance: 0}\ngains:"),
        "maps.tolerance",
        0.0,
        "a positive number",
    ),
    "coarse accuracy": (
        ("gains:", "simulator: {accuracy: 1}\ngains:"),
        "simulator.accuracy",
        1.0,
        "less than 1",
    ),
    "long steps of the plant": (
        ("gains:", "plant: {grasps: constraints, time_step: 0.02}\ngains:"),
        "plant.time_step",
        0.02,
        "a positive number, at most 0.01",
    ),
    "no time between the plant's steps": (
        ("gains:", "plant: {time_step: 0}\ngains:"),
        "plant.time_step",
        0.0,
        "a positive number",
    ),
    "unknown kind of grasps": (
        ("gains:", "plant: {grasps: glue}\ngains:"),
        "plant.grasps",
        "glue",
        "one of joints, constraints",
    ),
    "fraction of slices": (
        ("gains:", "planner: {max_slices: 1.5}\ngains:"),
        "planner.max_slices",
        1.5,
        "a whole",
    ),
    "text for joints": (("robot_0: [0.0]", "robot_0: zero"), "start.joints.robot_0", "zero", "a list"),
    "number for joints": (("robot_0: [0.0]", "robot_0: 0.0"), "start.joints.robot_0", 0.0, "a list"),
    "joints without names": (("robot_0: [0.0]", "1: [0.0]"), "start.joints.1", 1, "a text as the name"),
    "corner of three": (
        (OUTER, "[0, 0, 0], [1.8, 0], [1.8, 3.6]"),
        "workspace.outer[0]",
        [0, 0, 0],
        "a list of 2",
    ),
    "corner not finite": ((OUTER, "[0, .nan], [1.8, 0]"), "workspace.outer[0][1]", ..., "a finite number"),
    "zero tolerance": (
        ("position: 0.01", "position: 0"),
        "goal.tolerances.position",
        0.0,
        "a positive number",
    ),
    "negative tolerance": (("angle: 0.02", "angle: -1"), "goal.tolerances.angle", -1.0, "a positive number"),
    "negative margin": (
        ("gains:", "planner: {margin: -0.1}\ngains:"),
        "planner.margin",
        -0.1,
        "zero or a positive",
    ),
    "large overlap": (
        ("gains:", "planner: {slice_overlap: 2}\ngains:"),
        "planner.slice_overlap",
        2.0,
        "between 0 and 1",
    ),
    "unknown strategy": (
        ("gains:", "planner: {strategy: random}\ngains:"),
        "planner.strategy",
        "random",
        "portfolio",
    ),
    "no time": (
        ("gains:", "simulator: {max_time: 0}\ngains:"),
        "simulator.max_time",
        0.0,
        "a positive number",
    ),
    "integrator": (
        ("gains:", "simulator: {integration_scheme: euler}\ngains:"),
        "simulator.integration_scheme",
        "euler",
        "one of runge_kutta3, runge_kutta5",
    ),
    "slow control": (
        ("object: object\n", "deployment: {control_rate: 0.5}\n"),
        "deployment.control_rate",
        0.5,
        "between 1 and 10000, or null",
    ),
    "massless model": (
        ("object: object\n", "deployment: {mass_error: -1.0}\n"),
        "deployment.mass_error",
        -1.0,
        "between -0.9 and 10",
    ),
    "noise without samples": (
        ("object: object\n", "deployment: {measurements: {angle_noise: 0.1}}\n"),
        "deployment.measurements.angle_noise",
        0.1,
        "0 without deployment.control_rate",
    ),
    "report lost too often": (
        ("object: object\n", "deployment: {control_rate: 100, messages: {loss: 1.5}}\n"),
        "deployment.messages.loss",
        1.5,
        "a number between 0 and 1",
    ),
    "negative delay": (
        ("object: object\n", "deployment: {control_rate: 100, measurements: {delay: -0.1}}\n"),
        "deployment.measurements.delay",
        -0.1,
        "between 0 and 10",
    ),
    "endless delay": (
        ("object: object\n", "deployment: {control_rate: 100, messages: {delay: 100.0}}\n"),
        "deployment.messages.delay",
        100.0,
        "between 0 and 10",
    ),
    "powerless motors": (
        ("object: object\n", "deployment: {actuators: {base_force: 0.0}}\n"),
        "deployment.actuators.base_force",
        0.0,
        "a positive number, or null",
    ),
    "negative seed": (
        ("object: object\n", "deployment: {seed: -1}\n"),
        "deployment.seed",
        -1,
        "zero or a positive whole number",
    ),
    "share of a stranger": (
        ("object: object\n", "load_shares: {robot_7: 1.0}\n"),
        "load_shares.robot_7",
        "robot_7",
        "a robot, one of robot_0, robot_1",
    ),
    "negative share": (
        ("object: object\n", "load_shares: {robot_0: -0.5, robot_1: 1.5}\n"),
        "load_shares.robot_0",
        -0.5,
        "between 0 and 1",
    ),
    "share left out": (
        ("object: object\n", "load_shares: {robot_0: 1.0}\n"),
        "load_shares.robot_1",
        None,
        "a share for every robot, or for none",
    ),
    "shares of more than all": (
        ("object: object\n", "load_shares: {robot_0: 0.5, robot_1: 0.6}\n"),
        "load_shares",
        {"robot_0": 0.5, "robot_1": 0.6},
        "shares that sum to 1, not to 1.1",
    ),
    "gain set": (
        ("selected: scheduled", "selected: fast"),
        "gains.selected",
        "fast",
        "one of scheduled, table_2",
    ),
    "gain tag": (
        ("the paper's", "x\n  sets: {mine: !Gains {}}"),
        "gains.sets.mine",
        "!Gains",
        "one of !FixedGains, !ScheduledGains",
    ),
    "no gain tag": (
        ("the paper's", "x\n  sets: {scheduled: {age_phase: 0.5}}"),
        "gains.sets.scheduled",
        {"age_phase": 0.5},
        "one of !FixedGains, !ScheduledGains",
    ),
    "gain key": (
        ("the paper's", "x\n  sets: {mine: !FixedGains {stifness: 3}}"),
        "gains.sets.mine.stifness",
        3,
        "one of the keys stiffness",
    ),
    "gain value": (
        ("the paper's", "x\n  sets: {mine: !FixedGains {stiffness: -3}}"),
        "gains.sets.mine.stiffness",
        -3.0,
        "positive",
    ),
}


@pytest.mark.parametrize("name", sorted(CASES))
def test_wrong_file_is_refused_with_key_value_and_what_is_allowed(name, tmp_path):
    check_refusal(tmp_path, *CASES[name])


@pytest.mark.parametrize(
    ("text", "place", "problem"),
    [
        ("workspace:\n  outer: [[0, 0]\nstart: 3\n", "line 3, column 1", "did not find expected"),
        ("workspace: {}\nworkspace: {}\n", "line 2, column 1", "workspace"),
        ("\tworkspace: {}\n", "line 1, column 1", "cannot start any token"),
        ("workspace: {}\n3: {}\n", "3", "3"),
        ("~: {}\n", "None", "None"),
        ("? [1, 2]\n: {}\n", "line 1, column 3", "found unhashable key"),
        ("workspace: !!int floor\n", "the file", "invalid literal for int"),
        ("workspace: 2026-13-41\n", "the file", "month must be in 1..12"),
        ("workspace: &floor {outer: *floor}\n", "line 1, column 12", "a circular reference"),
        ("workspace: " + 2000 * "[" + 2000 * "]", "line 1, column 61", "too deep nesting"),
    ],
)
def test_text_that_does_not_parse_is_refused_with_its_line(text, place, problem, tmp_path):
    path = tmp_path / "broken.scenario.yaml"
    path.write_text(text)
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    assert caught.value.key == place
    assert problem in str(caught.value.value)


@pytest.mark.parametrize("text", ["", "- 1\n- 2\n", "just words"])
def test_file_without_mapping_is_refused(text, tmp_path):
    path = tmp_path / "list.scenario.yaml"
    path.write_text(text)
    with pytest.raises(ScenarioError, match="a mapping with the keys workspace, directives, start, goal"):
        load_scenario(path)


def test_missing_and_unreadable_files_are_refused(tmp_path):
    with pytest.raises(ScenarioError, match="a readable file"):
        load_scenario(tmp_path / "nowhere.scenario.yaml")
    binary = tmp_path / "binary.scenario.yaml"
    binary.write_bytes(b"\xff\xfe\xff")
    with pytest.raises(ScenarioError, match="a readable file"):
        load_scenario(binary)
