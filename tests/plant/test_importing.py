"""Robots from elsewhere: meshes become hulls, what cannot be used is left out or mended, and said."""

import json
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
from coop_drake.plant.importing import import_robot, survey_joints
from tests.support.edited_scenario import exchanged, write_edited
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
