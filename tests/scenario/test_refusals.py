"""Wrong files are refused with file, key, value and what is allowed."""

import pytest

from coop_drake.errors import ScenarioError
from coop_drake.scenario import load_scenario
from tests.support.edited_scenario import check_refusal, write_edited

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
    "number for mapping": ((START, "object: 3"), "start.object", 3, "a mapping with the keys x, y, theta"),
    "not a number": ((START, "object: {x: .nan, y: 2, theta: 1}"), "start.object.x", ..., "a finite number"),
    "huge": ((START, "object: {x: 1e300, y: 2, theta: 1}"), "start.object.x", 1e300, "between -1e+06 and"),
    "whole number too long for a float": (
        (START, "object: {x: 1" + 400 * "0" + ", y: 2, theta: 1}"),
        "start.object.x",
        10**400,
        "a number between",
    ),
    "fraction of slices": (
        ("gains:", "planner: {max_slices: 1.5}\ngains:"),
        "planner.max_slices",
        1.5,
        "a whole",
    ),
    "text for joints": (("robot_0: [0.0]", "robot_0: zero"), "start.joints.robot_0", "zero", "a list"),
    "joints without names": (("robot_0: [0.0]", "1: [0.0]"), "start.joints.1", 1, "a text as the name"),
    "corner of three": (
        (OUTER, "[0, 0, 0], [1.8, 0], [1.8, 3.6]"),
        "workspace.outer[0]",
        [0, 0, 0],
        "a list of 2",
    ),
    "corner not finite": ((OUTER, "[0, .nan], [1.8, 0]"), "workspace.outer[0][1]", ..., "a finite number"),
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
    "noise without samples": (
        ("object: object\n", "deployment: {measurements: {angle_noise: 0.1}}\n"),
        "deployment.measurements.angle_noise",
        0.1,
        "0 without deployment.control_rate",
    ),
    "powerless motors": (
        ("object: object\n", "deployment: {actuators: {base_force: 0.0}}\n"),
        "deployment.actuators.base_force",
        0.0,
        "a positive number, or null",
    ),
    "share of a stranger": (
        ("object: object\n", "load_shares: {robot_7: 1.0}\n"),
        "load_shares.robot_7",
        "robot_7",
        "a robot, one of robot_0, robot_1",
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
}


@pytest.mark.parametrize("name", sorted(CASES))
def test_wrong_file_is_refused_with_key_value_and_what_is_allowed(name, tmp_path):
    check_refusal(tmp_path, *CASES[name])


def test_all_faults_of_a_file_are_said_at_once(tmp_path):
    """Those of single values first, then those of values that do not fit together."""
    path = write_edited(tmp_path, ("selected: scheduled", "selectd: scheduled"), ("angle: 0.02", "angle: -1"))
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    lines = str(caught.value).splitlines()
    assert "gains.selectd: 'scheduled' is not allowed; expected one of the keys selected, sets" in lines[0]
    assert lines[0].endswith("did you mean selected?")
    assert lines[1] == (f"{path}: goal.tolerances.angle: -1 is not allowed; expected a positive number")
    unfit = "load_shares: {robot_7: 1.0}\ndeployment: {clock_error: 0.1}\n"
    path = write_edited(tmp_path, ("selected: scheduled", "selected: fast"), ("object: object\n", unfit))
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    others = {"load_shares.robot_7", "load_shares.robot_0", "load_shares.robot_1", "deployment.clock_error"}
    assert caught.value.key == "gains.selected"
    assert {key for key, _, _ in caught.value.others} == others


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
