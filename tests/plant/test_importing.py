"""Robots from elsewhere: what is imported, and which models are refused."""

import json
import logging
import re
from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml
from shapely import Point, Polygon
from typer.testing import CliRunner

from coop_drake.cli import app
from coop_drake.cli.task import read_task
from coop_drake.errors import ScenarioError
from coop_drake.plant import read_component_tree
from coop_drake.plant.importing import import_robot, survey_joints
from coop_drake.scenario import load_scenario
from tests.support.edited_scenario import MODELS, exchanged, team_of, write_edited, write_with_robot
from tests.support.robot_models import Arm, urdf_arm
from tests.support.turret import URDF

LINK = """<link name="{name}">
  <inertial><mass value="{mass}"/><inertia ixx="{ixx}" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  {shapes}
</link>"""


CAST = """<{kind}><geometry>
  <mesh filename="package://maker/meshes/{file}" scale="0.001 0.001 0.001"/>
</geometry></{kind}>"""


ROBOT = """<robot name="maker">
{links}
<link name="tool"/>
<joint name="wheel" type="continuous"><parent link="base"/><child link="wheel"/><axis xyz="0 1 0"/></joint>
<joint name="lift" type="prismatic"><parent link="base"/><child link="mast"/><axis xyz="0 0 1"/>
  <limit lower="0" upper="1" effort="100" velocity="1"/><dynamics friction="1" damping="0"/></joint>
<joint name="arm" type="revolute"><parent link="mast"/><child link="arm"/><axis xyz="0 0 1"/>
  <origin xyz="0.3 0 0.5"/>
  <limit lower="-1" upper="1" effort="100" velocity="1"/><mimic joint="lift"/></joint>
<joint name="grip" type="fixed"><parent link="arm"/><child link="tool"/>
  <origin xyz="0.4 0 0" rpy="0 0 3.14159"/></joint>
<transmission name="drive"/><gazebo/>
</robot>"""


SDF = """<sdf version="1.9"><model name="maker">
  <link name="base"><collision name="disc"><geometry><cylinder>
    <radius>0.25</radius><length>0.3</length></cylinder></geometry></collision></link>
  <link name="arm"><pose>0.3 0 0.5 0 0 0</pose><collision name="bar"><geometry><box>
    <size>0.1 0.1 0.1</size></box></geometry></collision></link>
  <joint name="turn" type="revolute"><parent>base</parent><child>arm</child>
    <axis><xyz>0 0 1</xyz><limit><lower>-1</lower><upper>1</upper></limit></axis></joint>
</model></sdf>"""


def model_of(kind, maker, folder):
    """The robot of the maker, or a simpler one in SDF whose arm begins at the same place."""
    path = folder / "simple.sdf"
    path.write_text(SDF)
    return maker if kind == "urdf" else path


@pytest.fixture(scope="module")
def maker(tmp_path_factory):
    """A robot as makers publish it: STL meshes in millimetres, addressed by a package."""
    folder = tmp_path_factory.mktemp("other") / "maker"
    meshes = folder / "meshes"
    meshes.mkdir(parents=True)
    trimesh.creation.cylinder(radius=250.0, height=300.0, sections=48).export(meshes / "base.stl")
    trimesh.creation.box((400.0, 80.0, 60.0)).apply_translation((200.0, 0.0, 0.0)).export(meshes / "arm.stl")
    trimesh.creation.annulus(60.0, 100.0, 40.0).export(meshes / "wheel.stl")
    links = [
        LINK.format(name="base", mass=20, ixx=1, shapes=CAST.format(kind="collision", file="base.stl")),
        LINK.format(name="wheel", mass=1, ixx=1, shapes=CAST.format(kind="visual", file="wheel.stl")),
        LINK.format(name="mast", mass=2, ixx=5, shapes=""),
        LINK.format(
            name="arm",
            mass=2,
            ixx=1,
            shapes=CAST.format(kind="visual", file="arm.stl") + CAST.format(kind="collision", file="arm.stl"),
        ),
    ]
    path = folder / "urdf" / "maker.urdf"
    path.parent.mkdir()
    path.write_text(ROBOT.format(links="\n".join(links)))
    return path


def test_what_was_changed_is_said(maker):
    notes = import_robot(maker).notes
    assert "left out: friction, gazebo, mimic, transmission" in notes
    assert "made solid by their pictures' hulls: wheel" in notes
    assert "impossible inertia made round: mast" in notes
    assert "1 angles within 1e-05 rad of a right angle made right" in notes
    assert b'rpy="0 0 3.141592653589793"' in import_robot(maker).files["maker.urdf"]


def test_hulls_enclose_their_meshes(maker):
    robot = import_robot(maker)
    for name, source in (("arm_collision_0", "arm"), ("base_collision_0", "base")):
        lines = robot.files[f"meshes/{name}.obj"].decode().splitlines()
        corners = np.array([line.split()[1:] for line in lines if line.startswith("v")], dtype=float)
        mesh = trimesh.load_mesh(maker.parents[1] / "meshes" / f"{source}.stl")
        hull = trimesh.Trimesh(corners).convex_hull
        assert hull.bounds == pytest.approx(mesh.bounds / 1000.0, abs=1e-6)
        assert hull.volume == pytest.approx(mesh.convex_hull.volume / 1e9, rel=1e-5)


def test_joints_are_judged_where_others_are_fixed(maker, tmp_path):
    robot = import_robot(maker)
    for name, content in robot.files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(content)
    verdicts = {joint.name: joint.verdict for joint in survey_joints(tmp_path / robot.name, {"wheel": 0.0})}
    assert verdicts == {"wheel": "fixed", "lift": "fix it", "arm": "planar"}
    with pytest.raises(ScenarioError, match="a joint that can be fixed, one of wheel, lift, arm"):
        survey_joints(tmp_path / robot.name, {"hand": 0.0})


def test_what_cannot_be_read_is_refused(maker, tmp_path):
    text = maker.read_text()
    cases = {
        "cut.urdf": (text[:-40], "a readable URDF or SDF model"),
        "bomb.urdf": ('<!DOCTYPE a [<!ENTITY b "c">]>' + text, "a readable URDF or SDF model"),
        "where.urdf": (text.replace("maker/meshes", "lost/meshes"), "say --package lost=FOLDER"),
        "gone.urdf": (exchanged(text, ("package://maker/meshes/base.stl", "gone.stl")), "a file that exists"),
        "empty.urdf": ("<robot name='a'/>", "a model with links"),
        "robot.xacro": (text, r"a .urdf or .sdf file"),
        "rpy.urdf": (exchanged(text, ('rpy="0 0 3.14159"', 'rpy="0 0 ${pi}"')), "rpy: .*a finite number"),
        "friction.urdf": (exchanged(text, ('friction="1"', 'friction="nan"')), "dynamics: .*a finite number"),
    }
    for name, (content, allowed) in cases.items():
        (tmp_path / name).write_text(content)
        with pytest.raises(ScenarioError, match=allowed):
            import_robot(tmp_path / name)
    heavy = LINK.format(name="base", mass=1, ixx="1.0e", shapes="")
    (tmp_path / "inertia.urdf").write_text(ROBOT.format(links=heavy))
    with pytest.raises(ScenarioError, match=r"ixx of base: .*a finite number"):
        import_robot(tmp_path / "inertia.urdf")
    broken = tmp_path / "broken.stl"
    broken.write_text("no mesh at all")
    (tmp_path / "mesh.urdf").write_text(exchanged(text, ("package://maker/meshes/base.stl", "broken.stl")))
    with pytest.raises(ScenarioError, match="a readable mesh"):
        import_robot(tmp_path / "mesh.urdf", {"maker": maker.parents[1]})


@pytest.mark.parametrize("ending", ["urdf", "sdf"])
@pytest.mark.parametrize(
    ("kind", "limits", "note"),
    [
        ("continuous", True, "limits of continuous joints .*: turret_joint$"),
        ("revolute", False, "revolute joints without limits are circles, as continuous ones: turret_joint"),
        ("continuous", False, None),
        ("revolute", True, None),
    ],
)
def test_a_joint_whose_kind_and_limits_differ_is_named(ending, kind, limits, note, tmp_path):
    path = tmp_path / f"turret.{ending}"
    said = 'lower="-6.28" upper="6.28"' if limits else ""
    text = URDF.format(kind=kind, limits=said)
    if ending == "sdf":
        said = "<limit><lower>-6.28</lower><upper>6.28</upper></limit>" if limits else ""
        text = exchanged(SDF, ('type="revolute"', f'type="{kind}"'), ('"turn"', '"turret_joint"'))
        text = exchanged(text, ("<limit><lower>-1</lower><upper>1</upper></limit>", said))
    path.write_text(text)
    found = [one for one in import_robot(path).notes if "limits" in one]
    assert len(found) == (note is not None)
    assert note is None or re.search(note, found[0])
    (joint,) = survey_joints(path)
    counted = limits and (ending, kind) != ("sdf", "continuous")
    assert joint.limits == ("-6.28 to 6.28" if counted else "no limits, a circle")
    assert joint.verdict == "planar"


def test_a_joint_with_one_limit_has_to_be_fixed(tmp_path):
    path = tmp_path / "turret.urdf"
    path.write_text(URDF.format(kind="revolute", limits='upper="2"'))
    (joint,) = survey_joints(path)
    assert (joint.limits, joint.verdict) == ("-inf to 2", "fix it")


def prepared(model, folder, *options):
    """The outcome of `coop-drake robot`."""
    return CliRunner().invoke(app, ["robot", str(model), "--out", str(folder), *options])


def base_in(path):
    """Collision shapes of the first robot's base, and names of all bodies, in the question of a scenario."""
    bodies = {body.name: body for c in read_task(path, None).problem.tree.components for body in c.bodies}
    return bodies["robot_0::base"].shapes, bodies.keys()


def test_it_becomes_one_folder_that_a_team_can_be_built_of(maker, tmp_path):
    done = prepared(maker, tmp_path / "maker")
    assert done.exit_code == 0, done.output
    path = write_edited(
        tmp_path,
        ("package://coop_drake_models/long_blue.sdf", "maker/maker.urdf"),
        ("child: robot_0::gripper", "child: robot_0::tool"),
        ("robot_0: [0.0]", "robot_0: [0.1]"),
    )
    path.write_text(path.read_text() + '\nfixed_joints: {robot_0: {"*": 0, arm: null}}\n')
    (shape,), names = base_in(path)
    outline = Polygon(shape.vertices)
    disc = Point(0.5 * (outline.bounds[0] + outline.bounds[2]), outline.centroid.y).buffer(0.2485, 64)
    assert outline.covers(disc)  # The disc, in metres, less what 48 sides leave of it.
    assert outline.area < np.pi * 0.254**2
    assert len(shape.vertices) <= 32
    assert "robot_0::wheel" not in names  # Its shadow lies within the base's.
    assert "robot_0::arm" in names


@pytest.mark.parametrize("kind", ["urdf", "sdf"])
def test_the_gripper_frame_and_the_lines_for_a_scenario_make_a_team(maker, tmp_path, kind):
    done = prepared(model_of(kind, maker, tmp_path), tmp_path / "mine", "--gripper", "arm", "--json")
    assert done.exit_code == 0, done.output
    lines = yaml.safe_load(json.loads(done.stdout)["scenario_lines"])
    model, weld = lines["directives"]
    assert weld == {"add_weld": {"parent": "object::grasp_0", "child": "robot_0::gripper"}}
    file = Path(model["add_model"]["file"]).relative_to(tmp_path)
    path = write_edited(
        tmp_path,
        ("package://coop_drake_models/long_blue.sdf", str(file)),
        ("robot_0: [0.0]", f"robot_0: {lines['start']['joints']['robot_0']}"),
    )
    path.write_text(path.read_text() + yaml.safe_dump({"fixed_joints": lines.get("fixed_joints", {})}))
    corners = base_in(path)[0][0].vertices
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    assert middle == pytest.approx([0.3, 0.0], abs=1e-3)  # Outside, seen from the grasp.


def test_the_command_never_overwrites_and_refuses_wrong_words(maker, tmp_path):
    mine = tmp_path / "maker.urdf"
    mine.write_text("mine")
    assert prepared(maker, tmp_path).exit_code == 2
    assert mine.read_text() == "mine"
    assert prepared(maker, tmp_path, "--force").exit_code == 0
    for wrong in ("arm", "arm=up"):
        assert prepared(maker, tmp_path, "--force", "--fix", wrong).exit_code == 2
    done = prepared(maker, tmp_path, "--force", "--gripper", "hand")
    assert done.exit_code == 2
    assert "a link of the model, one of base, wheel, mast, arm" in " ".join(done.output.split())


# Models that are no holonomic planar manipulators, or that Drake cannot read, are refused by name.


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
    ('<!DOCTYPE sdf [<!ENTITY a "b">]>' + ARM, "the entity a is declared"),
    (Arm(extra="<blah/>").text(), "not defined in SDF"),
    ("<robot name='arm'/>", "<robot> is the root; a .sdf file has <sdf>"),
    (Arm(extra=200 * "<a>" + 200 * "</a>").text(), "more than 100 elements inside each other"),
    (exchanged(ARM, ("<mass>6.0", "<mass>heavy")), "'heavy' in <mass> is no finite number"),
    (exchanged(ARM, ("<pose>0.3 0 0.4 0 0 0", "<pose>0.3 0")), "<pose> has 2 numbers, not 6"),
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
        (exchanged(urdf_arm(), ("<origin xyz", "<orign xyz")), "other.urdf", "origin is meant?"),
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
