"""Models that are no holonomic planar manipulators, or that Drake cannot read, are refused by name."""

import logging
import re

import pytest

from coop_drake.errors import ScenarioError
from coop_drake.plant import read_component_tree
from coop_drake.scenario import load_scenario
from tests.support.edited_scenario import MODELS, exchanged, team_of, write_edited, write_with_robot
from tests.support.robot_models import Arm, urdf_arm

LIMITS = "<limit><lower>-1</lower><upper>1</upper></limit>"
UP = ("revolute", "0 0 1", LIMITS)
ARM, OBJECT = Arm().text(), (MODELS / "object.sdf").read_text()


def jointed(kind, axis="0 0 1", more=LIMITS, **rest):
    return Arm(joints=((kind, axis, more),), **rest).text()


def linked(name, kind, parent, child):
    axis = "" if kind == "fixed" else f"<axis><xyz>0 0 1</xyz>{LIMITS}</axis>"
    return f"<joint name='{name}' type='{kind}'><parent>{parent}</parent><child>{child}</child>{axis}</joint>"


ARMS = [
    (jointed("revolute", "0 0.1 1"), "joint_0", "a vertical axis, not (0, -0.0995, 0.995)"),
    (jointed("revolute", "1 0 0"), "joint_0", "a vertical axis, not (-1, "),
    (jointed("prismatic", "0 0 1"), "joint_0", "an axis in the floor's plane"),
    (jointed("prismatic", "1 0 0", "<limit/>"), "joint_0", "two finite limits"),
    (
        jointed("revolute", more="<limit><lower>1</lower><upper>1</upper></limit>"),
        "joint_0",
        "a lower limit below the upper one, not 1.0 and 1.0",
    ),
    (jointed("ball"), "joint_0", "fixed, revolute or prismatic joints, not ball_rpy"),
    (jointed("screw"), "joint_0", "fixed, revolute or prismatic joints, not screw"),
    (Arm(extra=linked("anchor", "fixed", "world", "base")).text(), "anchor", "no joint ties to the world"),
    (Arm(extra=linked("rail", "prismatic", "world", "base")).text(), "rail", "no joint ties to the world"),
    (
        Arm(extra="<link name='loose'/>").text(),
        "base, robot_0::loose",
        "one body that no joint leads to: the",
    ),
    (
        Arm(joints=(UP, UP), extra=linked("again", "revolute", "base", "link_2")).text(),
        "again",
        "exactly one joint that leads to robot_0::link_2",
    ),
]


@pytest.mark.parametrize(("text", "value", "allowed"), ARMS)
def test_other_mechanisms_are_refused(text, value, allowed, tmp_path):
    scenario = load_scenario(write_with_robot(tmp_path, text))
    with pytest.raises(ScenarioError, match=re.escape(allowed)) as caught:
        team_of(scenario)
    assert (caught.value.key, caught.value.value) == ("directives[1]", f"robot_0::{value}")


REPLACED = "Using default value"
"""What Drake says where it takes another value than the file's."""

BROKEN = [
    ("hello", "line 1: syntax error"),
    (ARM[:300], "line 1: unclosed token"),
    ("<sdf version='1.9'/>", "must have a single <model>"),
    (Arm(extra="<blah/>").text(), "not defined in SDF"),
    (exchanged(ARM, ("<mass>6.0", "<mass>-6")), "central inertia"),
    (exchanged(ARM, ("<izz>0.6", "<izz>9")), "triangle inequality"),
    (exchanged(ARM, ("<radius>0.2", "<radius>-0.2")), REPLACED),
    (exchanged(ARM, ("<size>0.4", "<size>0")), REPLACED),
    (jointed("revolute", "0 0 0"), "norm of the xyz vector cannot be zero"),
    (
        jointed("revolute", more="<limit><lower>1</lower><upper>-1</upper></limit>"),
        "lower limit must be lower",
    ),
    (
        re.sub(
            "<geometry>.*?</geometry>", "<geometry><mesh><uri>no.obj</uri></mesh></geometry>", ARM, count=1
        ),
        "which does not exist",
    ),
    (exchanged(ARM, ("<mass>6.0", "<mass>nan")), "'nan' in <mass> is no finite number"),
    (
        jointed("revolute", more="<limit><lower>nan</lower><upper>1</upper></limit>"),
        "'nan' in <lower> is no finite number",
    ),
    (exchanged(ARM, ("<radius>0.2", "<radius>inf")), "'inf' in <radius> is no finite number"),
    (Arm(extra="<static>true</static>").text(), "Only fixed joints are permitted in static models"),
]


@pytest.fixture
def drake_logger():
    """Drake's logger; its state and that of all logging is put back."""
    logger = logging.getLogger("drake")
    level, disabled, switched_off = logger.level, logger.disabled, logging.root.manager.disable
    yield logger
    logger.disabled = disabled
    logger.setLevel(level)
    logging.disable(switched_off)


@pytest.mark.parametrize(("text", "complaint"), BROKEN)
def test_files_that_drake_cannot_read_are_refused(text, complaint, tmp_path, drake_logger):
    """Also where Drake's logger is told to keep silent, as the command line does."""
    drake_logger.setLevel(logging.ERROR)
    scenario = load_scenario(write_with_robot(tmp_path, text))
    with pytest.raises(ScenarioError, match=re.escape(complaint)) as caught:
        team_of(scenario)
    assert (caught.value.key, caught.value.value) == ("directives[1]", str(tmp_path / "other.sdf"))
    assert drake_logger.level == logging.ERROR


@pytest.mark.parametrize("silence", ["nothing", "its logger", "all logging", "a filter"])
def test_values_that_drake_would_replace_are_refused_whatever_was_switched_off(
    silence, tmp_path, drake_logger, monkeypatch
):
    drake_logger.disabled = silence == "its logger"
    if silence == "all logging":
        logging.disable(logging.CRITICAL)
    elif silence == "a filter":
        monkeypatch.setattr(drake_logger, "filters", [lambda _: False])
    before = (drake_logger.disabled, drake_logger.filters, logging.root.manager.disable)
    text = exchanged(ARM, ("<size>0.4", "<size>0"))
    with pytest.raises(ScenarioError, match=REPLACED):
        team_of(load_scenario(write_with_robot(tmp_path, text)))
    assert (drake_logger.disabled, drake_logger.filters, logging.root.manager.disable) == before


COUPLED = urdf_arm(mimic="<mimic joint='reach' multiplier='2'/>")


@pytest.mark.parametrize(
    ("text", "value", "allowed"),
    [
        (urdf_arm("planar"), "robot_0::yaw", "fixed, revolute or prismatic joints, not planar"),
        (urdf_arm("floating"), "robot_0::base, robot_0::boom", "one body that no joint leads to"),
        (COUPLED, "constraints in the models", "joints that are not coupled to one another"),
        (urdf_arm()[:-30], "other.urdf", "unclosed token"),
    ],
)
def test_urdf_robots_are_refused_alike(text, value, allowed, tmp_path):
    scenario = load_scenario(write_with_robot(tmp_path, text, "urdf"))
    with pytest.raises(ScenarioError, match=re.escape(allowed)) as caught:
        team_of(scenario)
    assert caught.value.value.endswith(value)


FRAME = "- add_frame: {name: object::body, X_PF: {base_frame: object::body}}\n- add_weld"
GROUP = "- add_collision_filter_group: {name: g, members: ['robot_0::wing']}\nobject: object\n"


@pytest.mark.parametrize(
    ("old", "new", "place", "value", "complaint"),
    [
        ("object::grasp_0", "object::grasp_9", 3, "object::grasp_9, robot_0::gripper", "grasp_9"),
        ("- add_weld", FRAME, 3, "object::body", "already contains a frame named 'body'"),
        ("object: object\n", GROUP, 5, "g", "body with name 'robot_0::wing' not found"),
    ],
)
def test_directives_that_drake_cannot_follow_are_refused_at_their_key(
    old, new, place, value, complaint, tmp_path
):
    scenario = load_scenario(write_edited(tmp_path, (old, new)))
    with pytest.raises(ScenarioError, match=re.escape(complaint)) as caught:
        team_of(scenario)
    assert (caught.value.key, caught.value.value) == (f"directives[{place}]", value)


@pytest.mark.parametrize("tilt", ["0.02", "-0.0001", "3.141592653589793"])
def test_bases_that_do_not_stand_upright_when_grasped_are_refused(tilt, tmp_path):
    text = Arm().text().replace("0 0 3.141592653589793", f"{tilt} 0 3.141592653589793")
    scenario = load_scenario(write_with_robot(tmp_path, text))
    with pytest.raises(ScenarioError, match="a base whose z axis points up when grasped") as caught:
        team_of(scenario)
    assert caught.value.value == "robot_0::base"


def test_tilt_that_is_round_off_in_the_file_passes(tmp_path):
    """Half a turn written with six digits is off by 3.7e-6 rad."""
    mounted = Arm(roll=3.14159).text()
    team, _builder = team_of(load_scenario(write_with_robot(tmp_path, mounted)))
    assert team.robots[0].joint_names == ("robot_0::joint_0",)


@pytest.mark.parametrize(
    ("more", "value", "allowed"),
    [
        (linked("nail", "fixed", "world", "body"), "nail", "no joint ties to the world"),
        ("<link name='loose'/>", "body, object::loose", "whose bodies hang together"),
        (
            "<link name='lid'/>" + linked("hinge", "revolute", "body", "lid"),
            "hinge",
            "rigid: fixed joints only",
        ),
    ],
)
def test_objects_that_are_not_one_rigid_body_are_refused(more, value, allowed, tmp_path):
    thing = ("package://coop_drake_models/object.sdf", "thing.sdf")
    path = write_edited(tmp_path, thing, thing_sdf=exchanged(OBJECT, ("</link>", "</link>" + more)))
    with pytest.raises(ScenarioError, match=re.escape(allowed)) as caught:
        team_of(load_scenario(path))
    assert (caught.value.key, caught.value.value) == ("object", f"object::{value}")


def test_bodies_without_inertia_that_move_on_their_own_are_refused(tmp_path):
    text = urdf_arm().replace('<mass value="1"/>', '<mass value="0"/>')
    text = text.replace('ixx="0.1" iyy="0.1" izz="0.1"', 'ixx="0" iyy="0" izz="0"')
    text = re.sub(
        r'<mass value="6"/>\s*<inertia[^>]*>',
        '<mass value="0"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>',
        text,
    )
    with pytest.raises(ScenarioError, match=r"resist every motion|tree of bodies"):
        team_of(load_scenario(write_with_robot(tmp_path, text, "urdf")))


def test_robots_far_from_their_joints_are_refused(tmp_path):
    text = exchanged(Arm().text(), ("<radius>0.2", "<radius>1e5"))
    team, _builder = team_of(load_scenario(write_with_robot(tmp_path, text)))
    with pytest.raises(ScenarioError, match=r"bounded footprint \(it reaches 1e\+05 m"):
        read_component_tree(team)


def test_masses_beyond_computing_are_refused(tmp_path):
    text = exchanged(Arm().text(), ("<pose>0.3 0 0.4", "<pose>1e250 0 0.4"))
    with pytest.raises(
        ScenarioError,
        match=r"infinite or undefined inertia.* finite masses and lengths",
    ):
        team_of(load_scenario(write_with_robot(tmp_path, text)))


def test_robots_and_objects_that_nobody_can_run_into_are_refused(tmp_path):
    bare = re.sub(r"<collision.*?</collision>", "", Arm().text())
    team, _builder = team_of(load_scenario(write_with_robot(tmp_path, bare)))
    with pytest.raises(ScenarioError, match="a robot with collision geometry") as caught:
        read_component_tree(team)
    assert (caught.value.key, caught.value.value) == ("directives[1]", "robot_0")
    ghost = re.sub(r"<(collision|visual).*?</\1>", "", OBJECT, flags=re.DOTALL)
    thing = ("package://coop_drake_models/object.sdf", "thing.sdf")
    team, _builder = team_of(load_scenario(write_edited(tmp_path, thing, thing_sdf=ghost)))
    with pytest.raises(ScenarioError, match="an object with collision geometry") as caught:
        read_component_tree(team)
    assert (caught.value.key, caught.value.value) == ("object", "object")
