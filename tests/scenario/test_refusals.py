"""Wrong files are refused with file, key, value and what is allowed."""

import pytest
import yaml

from coop_drake.errors import ScenarioError
from coop_drake.scenario import load_scenario
from tests.support.edited_scenario import check_refusal, write_edited
from tests.support.scenarios import ROOM, write_scenario

POSE = "object: {x: 0.9, y: 2, theta: 1.57}"
CORNERS = "[0, 0], [1.8, 0], [1.8, 3.6]"
MODEL = "{name: robot_0, file: package://coop_drake_models/long_blue.sdf}"
WELD = "{parent: object::grasp_0, child: robot_0::gripper}"
NAMES = "one of object, robot_0, robot_1"


def start(keys):
    return POSE, f"object: {{{keys}}}"


def corners(first):
    return CORNERS, f"{first}, [1.8, 0], [1.8, 3.6]"


END = "angle: 0.02}\n"


def gains(text):
    return END, f"{END}gains: {text}\n"


def sets(text):
    return gains(f"{{sets: {text}}}")


@pytest.mark.parametrize(
    ("edit", "key", "value", "allowed"),
    [
        ((END, f"{END}gain: {{selected: fast}}"), "gain", {"selected": "fast"}, "one of the keys workspace"),
        (("object: object\n\nstart:", "object: object\n\nbegin:"), "begin", ..., "one of the keys"),
        (start(f"x: {10**400}, y: 2, theta: 1"), "start.object.x", 10**400, "a number between"),
        (("robot_0: [0.0]", "1: [0.0]"), "start.joints.1", 1, "a text as the name"),
        (corners("[1.0e+12, 0]"), "workspace.outer[0][0]", 1e12, "between -1e+06 and"),
        (gains("{selected: fast}"), "gains.selected", "fast", "one of scheduled, table_2"),
        (sets("{mine: !Gains {}}"), "gains.sets.mine", "!Gains", "one of !FixedGains, !ScheduledGains"),
        (sets("{scheduled: {age_phase: 0.5}}"), "gains.sets.scheduled", {"age_phase": 0.5}, "one of !Fixed"),
        (sets("{mine: !FixedGains {stifness: 3}}"), "gains.sets.mine.stifness", 3, "the keys stiffness"),
    ],
)
def test_a_wrong_value_is_refused_with_its_key_and_what_is_allowed(edit, key, value, allowed, tmp_path):
    check_refusal(tmp_path, edit, key, value, allowed)


@pytest.mark.parametrize(
    ("sections", "key", "allowed"),
    [
        ("{load_shares: {robot_7: 1.0}}", "load_shares.robot_7", "a robot, one of robot_0, robot_1"),
        ("{load_shares: {robot_0: 1.0}}", "load_shares.robot_1", "a share for every robot, or for none"),
        ("{load_shares: {robot_0: 0.5, robot_1: 0.6}}", "load_shares", "shares that sum to 1, not to 1.1"),
        ("{load_shares: {robot_0: -0.5, robot_1: 1.5}}", "load_shares.robot_0", "between 0 and 1"),
        ("{limits: {nobody: {base_speed: 1.0}}}", "limits.nobody", "a robot, one of robot_0, robot_1"),
        ("{limits: {object: {base_speed: 1.0}}}", "limits.object.base_speed", "only the limit acceleration"),
        ("{limits: {robot_0: {acceleration: 1.0}}}", "limits.robot_0.acceleration", "only limits.object"),
        ("{simulator: {integration_scheme: euler}}", "simulator.integration_scheme", "one of runge_kutta3"),
        (
            "{gains: {selected: scheduled}\ncontrol: {hold: {silence: 0.1}}}",
            "control.hold.silence",
            "without deployment.control_rate",
        ),
        ("{deployment: {control_rate: 0.5}}", "deployment.control_rate", "between 1 and 10000, or null"),
        (
            "{deployment: {actuators: {base_force: 0}}}",
            "deployment.actuators.base_force",
            "a positive number",
        ),
        (
            "{deployment: {measurements: {angle_noise: 0.1}}}",
            "deployment.measurements.angle_noise",
            "0 without",
        ),
        ("{deployment: {measurements: {delay: 0.1}}}", "deployment.measurements.delay", "0 without"),
        ("{deployment: {messages: {loss: 0.1}}}", "deployment.messages.loss", "0 without"),
        ("{deployment: {robots: {nobody: {}}}}", "deployment.robots.nobody", "a robot, one of robot_0"),
        (
            "{deployment: {robots: {robot_0: {switch_delay: 0.1}}}}",
            "deployment.robots.robot_0.switch_delay",
            "0 or null without deployment.control_rate",
        ),
        (
            "{deployment: {control_rate: 200, robots: {robot_0: {sample_offset: 0.01}}}}",
            "deployment.robots.robot_0.sample_offset",
            "a time shorter than the control period of 0.005 s",
        ),
        (
            "{deployment: {pushes: [{body: nobody, force: [1, 2], time: 1, duration: 1}]}}",
            "deployment.pushes[0].body",
            NAMES,
        ),
        (
            "{deployment: {pushes: [{body: object, force: [1, 2], time: 1, duration: 0.001}]}}",
            "deployment.pushes[0].duration",
            "a step might miss a shorter one",
        ),
        (
            "{gains: {sets: {mine: !ScheduledGains {min_stiffness: 9, max_stiffness: 3}}}}",
            "gains.sets.mine.min_stiffness",
            "",
        ),
    ],
)
def test_values_that_do_not_fit_together_are_refused(sections, key, allowed, tmp_path):
    path = tmp_path / "room.scenario.yaml"
    path.write_text(yaml.safe_dump(ROOM) + sections[1:-1])
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    assert caught.value.key == key
    assert allowed in caught.value.allowed


def model(name="robot_0", file="package://coop_drake_models/long_blue.sdf", more=""):
    return MODEL, f"{{name: {name}, file: {file}{more}}}"


def pose(text):
    return WELD, f"{WELD[:-1]}, X_PC: {text}}}"


def also(directive):
    return WELD, f"{WELD}\n- {directive}"


@pytest.mark.parametrize(
    ("edit", "key", "value", "allowed"),
    [
        (model("''"), "name", "", "required"),
        (model("'a::b'"), "name", "a::b", "without"),
        (model("/../../ESCAPED"), "name", "/../../ESCAPED", "at most 80 of letters, digits, blanks"),
        (model("r" * 81), "name", "r" * 81, "at most 80 of letters"),
        (model("object"), "name", "object", "a name that no other model has"),
        (model("[1, 2]"), "name", [1, 2], "a text"),
        (model(file="package://nowhere/arm.sdf"), "file", "package://nowhere/arm.sdf", "a package among"),
        (model(file="'package://'"), "file", ..., ""),
        (model(file="arm.sdf"), "file", "arm.sdf", "a file that exists (looked for "),
        (model(file="file:///no/such/robot.urdf"), "file", ..., "a file that exists"),
        (model(file="https://example.org/robot.sdf"), "file", ..., ""),
        (model(file='"robot.sdf\\0"'), "file", ..., ""),
        (model(file="arm.stl"), "file", "arm.stl", "an .sdf or .urdf file"),
        (model(file="."), "file", ".", "an .sdf or .urdf file"),
        (
            model(more=", default_free_body_pose: {base: {}}"),
            "default_free_body_pose",
            ["base"],
            "poses and joints stand under start",
        ),
        (
            model(more=", default_joint_positions: {elbow: [1]}"),
            "default_joint_positions",
            ["elbow"],
            "poses and joints stand under start",
        ),
        ((f"- add_weld: {WELD}", ""), "name", "robot_0", "one add_weld to a frame of object (found 0)"),
        (also("add_weld: {parent: object::grasp_2, child: robot_0::base}"), "name", "robot_0", "(found 2)"),
        (also("add_weld: {parent: robot_0::base, child: robot_1::base}"), "name", "robot_0", "(found 2)"),
    ],
)
def test_a_wrong_model_is_refused_with_its_key(edit, key, value, allowed, tmp_path):
    check_refusal(tmp_path, edit, f"directives[1].add_model.{key}", value, allowed)


@pytest.mark.parametrize(
    ("edit", "key", "value", "allowed"),
    [
        (("object: object", "object: box"), "object", "box", NAMES),
        (("add_weld", "add_wold"), "directives[3].add_wold", ..., "one of the keys add_model"),
        ((f"- add_weld: {WELD}", "- {}"), "directives[3]", [], "exactly one of add_model"),
        ((f"- add_weld: {WELD}", "- add_weld"), "directives[3]", "add_weld", "a mapping"),
        ((f"add_weld: {WELD}", f"add_weld: [{WELD}]"), "directives[3].add_weld", ..., "a mapping"),
        (
            (f"add_model: {MODEL}", f"add_model: {MODEL}\n  add_model_instance: {{name: x}}"),
            "directives[1]",
            ["add_model", "add_model_instance"],
            "exactly one of",
        ),
        ((WELD, "{parent: object::grasp_0}"), "directives[3].add_weld.child", ..., "required"),
        ((WELD, f"{WELD[:-1]}, colour: 1}}"), "directives[3].add_weld.colour", 1, "one of the keys"),
        (pose("{translation: [0.1, 1.0e+9, 0]}"), "X_PC.translation[1]", 1e9, "between -1e+06 and 1e+06"),
        (pose("{translation: [0.1, .inf, 0]}"), "X_PC.translation[1]", ..., "a finite number"),
        (pose("{translation: [0.1, 0]}"), "X_PC", ..., "a vector of the wrong size"),
        (pose("{rotation: !Uniform {}}"), "X_PC", ..., "one pose, not a distribution"),
        (pose("{rotation: !Spin {deg: 3.0}}"), "X_PC", ..., ""),
        (pose("{base_frame: object::body}"), "X_PC.base_frame", "object::body", "the weld's parent frame"),
        (
            (WELD, "{parent: object::grasp_0, child: robot_7::gripper}"),
            "directives[3].add_weld.child",
            "robot_7::gripper",
            NAMES,
        ),
        (
            also("add_weld: {parent: robot_0::base, child: robot_0::link_2}"),
            "directives[4].add_weld.child",
            "robot_0::link_2",
            "a frame of another model than robot_0",
        ),
        (
            also("add_weld: {parent: world, child: robot_0::base}"),
            "directives[4].add_weld.parent",
            "world",
            NAMES,
        ),
        (
            also("add_frame: {name: robot_0::tip, X_PF: {translation: [0, 0, 0]}}"),
            "directives[4].add_frame.X_PF.base_frame",
            "",
            "model::frame",
        ),
        (also("add_directives: {file: none.dmd.yaml}"), "directives[4].add_directives.file", ..., ""),
    ],
)
def test_a_wrong_directive_is_refused_with_its_key(edit, key, value, allowed, tmp_path):
    key = f"directives[3].add_weld.{key}" if key.startswith("X_PC") else key
    check_refusal(tmp_path, edit, key, value, allowed)


@pytest.mark.parametrize(
    ("kept", "allowed"),
    [
        ([], "add_model for the object and for two or more robots"),
        ([0], "two or more robots beside the object"),
        ([0, 1, 3], "two or more robots beside the object"),
        ([0, 1, 2], "exactly one add_weld to a frame of object (found 0)"),
    ],
)
def test_models_and_welds_that_make_no_team_are_refused(kept, allowed, tmp_path):
    directives = [ROOM["directives"][index] for index in kept]
    path = write_scenario(tmp_path / "team.scenario.yaml", directives=directives)
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    assert caught.value.key.startswith(("directives", "object"))
    assert allowed in caught.value.allowed


SQUARE = [[0, 0], [6, 0], [6, 4], [0, 4]]
PILLAR = [[1, 3], [1.5, 3], [1.5, 3.5], [1, 3.5]]
AROUND = [[-1, -1], [7, -1], [7, 5], [-1, 5]]
APART = "a hole apart from workspace.holes[0]"


@pytest.mark.parametrize(
    ("outer", "holes", "key", "allowed"),
    [
        ([[0, 0], [6, 4], [6, 0], [0, 4]], [], "outer[0]", "corners 0 and 2 meet at (3, 2)"),
        ([[0, 0], [6, 0], [6, 4], [6, 7], [6, 4], [0, 4]], [], "outer[1]", "touch itself"),
        ([[0, 0], [6, 0], [6, 4], [3, 0], [0, 4]], [], "outer[0]", "meet at (3, 0)"),
        ([[0, 0], [6, 0], [6, 4], [0, 0], [0, 4]], [], "outer[0]", "touch itself"),
        ([[0, 0], [6, 0], [3, 0]], [], "outer[0]", "touch itself"),
        ([[0, 0], [1e-9, 0], [0, 1e-9]], [], "outer", "a ring with an area of 1e-09 m^2 or more"),
        ([[0, 0], [6, 0], [0, 0]], [], "outer", "three or more different corners"),
        ([], [], "outer", ""),
        (SQUARE, [[[8, 8], [9, 8], [9, 9]]], "holes[0]", "not outside it"),
        (SQUARE, [[[5, 3], [7, 3], [7, 3.5]]], "holes[0]", "not across it"),
        (SQUARE, [AROUND], "holes[0]", "not across it"),
        (SQUARE, [SQUARE], "", ""),
        (SQUARE, [PILLAR, [[1, 1], [2, 2], [2, 1], [1, 2]]], "holes[1][0]", "meet at (1.5, 1.5)"),
        (SQUARE, [PILLAR, [[1.2, 3.2], [2, 3.2], [2, 3.8]]], "holes[1]", APART),
        (SQUARE, [PILLAR, [[1.1, 3.1], [1.3, 3.1], [1.3, 3.3]]], "holes[1]", APART),
        (SQUARE, [PILLAR, PILLAR], "holes[1]", APART),
        (SQUARE, [[[0, 2], [3, 1], [3, 3]], [[6, 2], [3, 1], [3.0, 0.5]]], "", "one piece"),
    ],
)
def test_rings_that_enclose_no_floor_are_refused_at_the_corner_to_blame(outer, holes, key, allowed, tmp_path):
    path = write_scenario(tmp_path / "rings.scenario.yaml", workspace={"outer": outer, "holes": holes})
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    assert caught.value.key == f"workspace.{key}".removesuffix(".")
    assert allowed in caught.value.allowed


@pytest.mark.parametrize("outer", [SQUARE, SQUARE[::-1], [*SQUARE, SQUARE[0]], [[0, 0], [3, 0], *SQUARE[1:]]])
def test_sense_closing_corner_and_straight_corners_do_not_matter(outer, tmp_path):
    path = write_scenario(tmp_path / "rings.scenario.yaml", workspace={"outer": outer, "holes": [PILLAR]})
    assert load_scenario(path).workspace.polygon.area == pytest.approx(23.75)


def test_all_faults_of_a_file_are_said_at_once(tmp_path):
    """Those of single values first, then those of values that do not fit together."""
    path = write_edited(tmp_path, gains("{selectd: scheduled}"), ("angle: 0.02", "angle: -1"))
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    lines = str(caught.value).splitlines()
    assert "gains.selectd: 'scheduled' is not allowed; expected one of the keys selected, sets" in lines[0]
    assert lines[0].endswith("did you mean selected?")
    assert lines[1] == (f"{path}: goal.tolerances.angle: -1 is not allowed; expected a positive number")
    unfit = "load_shares: {robot_7: 1.0}\ndeployment: {clock_error: 0.1}\n"
    path = write_edited(tmp_path, gains("{selected: fast}"), ("object: object\n", unfit))
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
