"""Where models come from and who is who: packages, paths, nested directives, robots of several models."""

import shutil

import pytest

from coop_drake.errors import ScenarioError
from coop_drake.scenario import assemble, load_scenario, package_map
from tests.support.edited_scenario import MODELS, shipped, write_edited

PACKAGE = "<package format='2'><name>{}</name></package>"
WELD = "- add_weld: {parent: object::grasp_0, child: robot_0::gripper}\n"
MODEL = "{name: robot_0, file: package://coop_drake_models/long_blue.sdf}"


def test_packages_beside_and_above_the_scenario_are_found_nearest_first(tmp_path):
    near = tmp_path / "far" / "near"
    near.mkdir(parents=True)
    (tmp_path / "package.xml").write_text(PACKAGE.format("mine"))
    (near / "package.xml").write_text(PACKAGE.format("mine"))
    (tmp_path / "far" / "package.xml").write_text(PACKAGE.format("other"))
    packages = package_map(near / "some.scenario.yaml")
    assert packages.GetPath("mine").rstrip("/") == str(near)
    assert packages.GetPath("other").rstrip("/") == str(tmp_path / "far")
    assert packages.GetPath("coop_drake_models").rstrip("/") == str(MODELS)
    assert packages.Contains("drake")


def test_package_without_a_name_is_refused(tmp_path):
    (tmp_path / "package.xml").write_text("<package/>")
    path = write_edited(tmp_path)
    with pytest.raises(ScenarioError, match=r"a package\.xml that names its package"):
        load_scenario(path)


@pytest.mark.parametrize("address", ["mine/arm.sdf", "{folder}/mine/arm.sdf", "file://{folder}/mine/arm.sdf"])
def test_models_may_stand_beside_the_scenario(address, tmp_path):
    (tmp_path / "mine").mkdir()
    shutil.copy(MODELS / "long_blue.sdf", tmp_path / "mine" / "arm.sdf")
    address = address.format(folder=tmp_path)
    path = write_edited(tmp_path, ("package://coop_drake_models/long_blue.sdf", address))
    files = [d.add_model.file for d in assemble(load_scenario(path)).directives if d.add_model]
    assert files[1] == f"file://{tmp_path}/mine/arm.sdf"


def test_robots_and_grasps_of_a_shipped_team():
    assembly = assemble(shipped("three"))
    assert assembly.object_model == "object"
    assert [robot.name for robot in assembly.robots] == ["robot_0", "robot_1", "robot_2"]
    assert [robot.object_frame for robot in assembly.robots] == [f"object::grasp_{k}" for k in range(3)]
    assert [robot.gripper_frame for robot in assembly.robots] == [f"robot_{k}::gripper" for k in range(3)]
    assert assembly.of_robot(1) == (2,)


def test_grasp_may_be_written_from_the_robot_to_the_object(tmp_path):
    turned = (
        "- add_weld: {parent: robot_0::gripper, child: object::grasp_0, X_PC: {translation: [0.1, 0, 0]}}\n"
    )
    assembly = assemble(load_scenario(write_edited(tmp_path, (WELD, turned))))
    weld = assembly.directives[3].add_weld
    assert (weld.parent, weld.child) == ("object::grasp_0", "robot_0::gripper")
    assert weld.X_PC.GetDeterministicValue().translation() == pytest.approx([-0.1, 0.0, 0.0])
    assert assembly.robots[0].gripper_frame == "robot_0::gripper"


def test_directives_may_stand_in_other_files(tmp_path):
    (tmp_path / "parts").mkdir()
    shutil.copy(MODELS / "long_blue.sdf", tmp_path / "parts" / "arm.sdf")
    (tmp_path / "parts" / "arm.dmd.yaml").write_text(
        "directives:\n- add_model: {name: robot_0, file: arm.sdf}\n"
    )
    path = write_edited(tmp_path, (f"add_model: {MODEL}", "add_directives: {file: parts/arm.dmd.yaml}"))
    assembly = assemble(load_scenario(path))
    assert assembly.keys[1] == "directives[1].add_directives[0]"
    assert assembly.directives[1].add_model.file == f"file://{tmp_path}/parts/arm.sdf"


@pytest.mark.parametrize(
    ("nested", "key", "allowed"),
    [
        ("directives: 3\n", "directives", "a list"),
        ("directives:\n- add_weld: {parent: a, child: ''}\n", "directives[0].add_weld.child", "required"),
        (
            "directives:\n- add_directives: {file: loop.dmd.yaml}\n",
            "directives[1].add_directives[0]",
            "itself",
        ),
    ],
)
def test_wrong_nested_files_are_refused(nested, key, allowed, tmp_path):
    (tmp_path / "loop.dmd.yaml").write_text(nested)
    path = write_edited(tmp_path, (f"add_model: {MODEL}", "add_directives: {file: loop.dmd.yaml}"))
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    assert caught.value.key.startswith(key)
    assert allowed in caught.value.allowed


def test_namespaces_are_refused(tmp_path):
    entry = "add_directives: {file: x.dmd.yaml, model_namespace: left}"
    with pytest.raises(ScenarioError, match="model_namespace: 'left' is not allowed; expected no namespace"):
        load_scenario(write_edited(tmp_path, (f"add_model: {MODEL}", entry)))


def test_robot_may_be_made_of_several_models(tmp_path):
    path = write_edited(
        tmp_path,
        (f"add_model: {MODEL}", f"add_model: {MODEL}\n- add_model: {{name: hand, file: hand.sdf}}"),
        (
            WELD,
            WELD.replace("robot_0::gripper", "hand::tip")
            + "- add_weld: {parent: robot_0::gripper, child: hand::palm}\n",
        ),
        hand_sdf="<sdf version='1.9'><model name='hand'><link name='palm'/><frame name='tip'/></model></sdf>",
    )
    assembly = assemble(load_scenario(path))
    assert assembly.robots[0].name == "robot_0"
    assert assembly.robots[0].models == ("robot_0", "hand")
    assert [assembly.keys[i] for i in assembly.of_robot(0)] == [
        "directives[1]",
        "directives[2]",
        "directives[5]",
    ]


def test_frames_may_be_added_for_a_grasp(tmp_path):
    path = write_edited(
        tmp_path,
        (WELD, WELD.replace("object::grasp_0", "corner")),
        (
            "- add_weld",
            "- add_frame: {name: corner, X_PF: {base_frame: object::body}}\n- add_weld",
        ),
    )
    assert assemble(load_scenario(path)).robots[0].object_frame == "corner"
