"""Wrong model directives are refused with file, key, value and what is allowed."""

import pytest

from coop_drake.errors import ScenarioError
from coop_drake.scenario import load_scenario
from tests.support.edited_scenario import check_refusal, write_edited

WELD = "{parent: object::grasp_0, child: robot_0::gripper}"
MODEL = "{name: robot_0, file: package://coop_drake_models/long_blue.sdf}"

CASES = {
    "huge weld": (
        (WELD, WELD[:-1] + ", X_PC: {translation: [0.1, 1.0e+9, 0]}}"),
        "directives[3].add_weld.X_PC.translation[1]",
        1e9,
        "between -1e+06 and 1e+06",
    ),
    "object": (("object: object", "object: box"), "object", "box", "one of object, robot_0, robot_1"),
    "directive": (("add_weld", "add_wold"), "directives[3].add_wold", ..., "one of the keys add_model"),
    "empty directive": (("- add_weld: " + WELD, "- {}"), "directives[3]", [], "exactly one of add_model"),
    "two directives in one": (
        ("add_model: " + MODEL, "add_model: " + MODEL + "\n  add_model_instance: {name: x}"),
        "directives[1]",
        ["add_model", "add_model_instance"],
        "exactly one of",
    ),
    "model without name": (
        (MODEL, MODEL.replace("robot_0", "''")),
        "directives[1].add_model.name",
        "",
        "required",
    ),
    "model name": (
        (MODEL, MODEL.replace("robot_0", "'a::b'")),
        "directives[1].add_model.name",
        "a::b",
        "without",
    ),
    "model name with a path": (
        (MODEL, MODEL.replace("robot_0", "/../../ESCAPED")),
        "directives[1].add_model.name",
        "/../../ESCAPED",
        "at most 80 of letters, digits, blanks",
    ),
    "long model name": (
        (MODEL, MODEL.replace("robot_0", "r" * 81)),
        "directives[1].add_model.name",
        "r" * 81,
        "at most 80 of letters",
    ),
    "model twice": (
        (MODEL, MODEL.replace("robot_0", "object")),
        "directives[1].add_model.name",
        "object",
        "a name that no other model has",
    ),
    "unknown package": (
        (MODEL, "{name: robot_0, file: package://nowhere/arm.sdf}"),
        "directives[1].add_model.file",
        "package://nowhere/arm.sdf",
        "a package among",
    ),
    "missing model": (
        (MODEL, "{name: robot_0, file: arm.sdf}"),
        "directives[1].add_model.file",
        "arm.sdf",
        "a file that exists (looked for ",
    ),
    "model format": (
        (MODEL, "{name: robot_0, file: arm.stl}"),
        "directives[1].add_model.file",
        "arm.stl",
        "an .sdf or .urdf file",
    ),
    "default pose": (
        (MODEL, MODEL[:-1] + ", default_free_body_pose: {base: {}}}"),
        "directives[1].add_model.default_free_body_pose",
        ["base"],
        "poses and joints stand under start",
    ),
    "default joints": (
        (MODEL, MODEL[:-1] + ", default_joint_positions: {elbow: [1]}}"),
        "directives[1].add_model.default_joint_positions",
        ["elbow"],
        "poses and joints stand under start",
    ),
    "grasps nothing": (
        ("- add_weld: " + WELD, ""),
        "directives[1].add_model.name",
        "robot_0",
        "exactly one add_weld to a frame of object (found 0)",
    ),
    "grasps twice": (
        (WELD, WELD + "\n- add_weld: {parent: object::grasp_2, child: robot_0::base}"),
        "directives[1].add_model.name",
        "robot_0",
        "exactly one add_weld to a frame of object (found 2)",
    ),
    "robots welded together": (
        (WELD, WELD + "\n- add_weld: {parent: robot_0::base, child: robot_1::base}"),
        "directives[1].add_model.name",
        "robot_0",
        "(found 2)",
    ),
    "weld within a model": (
        (WELD, WELD + "\n- add_weld: {parent: robot_0::base, child: robot_0::link_2}"),
        "directives[4].add_weld.child",
        "robot_0::link_2",
        "a frame of another model than robot_0",
    ),
    "weld to the world": (
        (WELD, WELD + "\n- add_weld: {parent: world, child: robot_0::base}"),
        "directives[4].add_weld.parent",
        "world",
        "one of object, robot_0, robot_1",
    ),
    "weld to nobody": (
        (WELD, "{parent: object::grasp_0, child: robot_7::gripper}"),
        "directives[3].add_weld.child",
        "robot_7::gripper",
        "one of object, robot_0, robot_1",
    ),
    "random weld": (
        (WELD, WELD[:-1] + ", X_PC: {rotation: !Uniform {}}}"),
        "directives[3].add_weld.X_PC",
        ...,
        "one pose, not a distribution",
    ),
    "weld with base frame": (
        (WELD, WELD[:-1] + ", X_PC: {base_frame: object::body}}"),
        "directives[3].add_weld.X_PC.base_frame",
        "object::body",
        "the pose is in the weld's parent frame",
    ),
    "weld in the plane": (
        (WELD, WELD[:-1] + ", X_PC: {translation: [0.1, 0]}}"),
        "directives[3].add_weld.X_PC",
        ...,
        "a vector of the wrong size",
    ),
    "weld not finite": (
        (WELD, WELD[:-1] + ", X_PC: {translation: [0.1, .inf, 0]}}"),
        "directives[3].add_weld.X_PC.translation[1]",
        float("inf"),
        "a finite number",
    ),
    "frame without base": (
        (WELD, WELD + "\n- add_frame: {name: robot_0::tip, X_PF: {translation: [0, 0, 0]}}"),
        "directives[4].add_frame.X_PF.base_frame",
        "",
        "model::frame",
    ),
}


@pytest.mark.parametrize("name", sorted(CASES))
def test_wrong_file_is_refused_with_key_value_and_what_is_allowed(name, tmp_path):
    check_refusal(tmp_path, *CASES[name])


def test_one_robot_is_not_enough(tmp_path):
    path = write_edited(
        tmp_path,
        ("- add_model: {name: robot_1, file: package://coop_drake_models/long_orange.sdf}\n", ""),
        ("- add_weld: {parent: object::grasp_1, child: robot_1::gripper}\n", ""),
    )
    with pytest.raises(ScenarioError, match="two or more robots beside the object") as caught:
        load_scenario(path)
    assert caught.value.value == ["robot_0"]
