"""The component tree moves as the plant does, and its shapes stand where the collision geometry stands."""

import re

import numpy as np
import pytest
from pydrake.multibody.tree import BodyIndex
from shapely import Point

from coop_drake.errors import ScenarioError
from coop_drake.plant import base_poses, read_component_tree, set_configuration
from coop_drake.plant.chain import planar_pose
from coop_drake.plant.problem import core
from coop_drake.scenario import load_scenario
from tests.support.cases import CASES, case
from tests.support.edited_scenario import shipped, team_of, write_edited, write_with_robot
from tests.support.robot_models import Arm


def configurations(tree, count, seed=3):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        joints = rng.uniform(tree.joint_lower, tree.joint_upper)
        yield np.concatenate([rng.uniform(-4.0, 4.0, 3), joints])


def plant_body(team, name):
    model, _, body = name.rpartition("::")
    return team.plant.GetBodyByName(body, team.plant.GetModelInstanceByName(model))


def test_every_body_moves_in_the_tree_as_in_the_plant(team):
    tree = read_component_tree(team)
    context = team.plant.CreateDefaultContext()
    zero = np.zeros(3 + len(tree.joints))
    set_configuration(team, context, zero)
    fixed = {
        body.name: X_LC.inverse() @ planar_pose(plant_body(team, body.name).EvalPoseInWorld(context))
        for X_LC, component in zip(tree.poses(zero), tree.components, strict=True)
        for body in component.bodies
    }
    for z in configurations(tree, 10):
        set_configuration(team, context, z)
        for X_WC, component in zip(tree.poses(z), tree.components, strict=True):
            for body in component.bodies:
                expected = planar_pose(plant_body(team, body.name).EvalPoseInWorld(context))
                found = X_WC @ fixed[body.name]
                assert (found.x, found.y) == pytest.approx((expected.x, expected.y), abs=1e-7)
                turn = found.angle - expected.angle
                assert (np.cos(turn), np.sin(turn)) == pytest.approx((1.0, 0.0), abs=1e-7)


@pytest.mark.parametrize("name", sorted(CASES))
def test_points_are_as_far_from_footprints_as_from_the_geometry(name):
    """All shipped bodies are upright prisms through z = 0.4: distances there are distances in the plane."""
    team, builder = team_of(shipped(name))
    tree = read_component_tree(team)
    root = builder.Build().CreateDefaultContext()
    context = team.plant.GetMyMutableContextFromRoot(root)
    query_port = team.scene_graph.get_query_output_port()
    names = {
        geometry: f"{team.plant.GetModelInstanceName(body.model_instance())}::{body.name()}"
        for body in (team.plant.get_body(BodyIndex(i)) for i in range(team.plant.num_bodies()))
        for geometry in team.plant.GetCollisionGeometriesForBody(body)
    }
    rng = np.random.default_rng(8)
    for z in configurations(tree, 6):
        set_configuration(team, context, z)
        query = query_port.Eval(team.scene_graph.GetMyContextFromRoot(root))
        placed = {
            body.name: (core(body.shapes[0], X_WC), body.shapes[0].radius)
            for X_WC, component in zip(tree.poses(z), tree.components, strict=True)
            for body in component.bodies
        }
        assert sorted(placed) == sorted(names.values())
        for point in z[:2] + rng.uniform(-1.5, 1.5, (40, 2)):
            for seen in query.ComputeSignedDistanceToPoint(np.array([*point, 0.4])):
                solid, radius = placed[names[seen.id_G]]
                distance = solid.distance(Point(point)) - radius
                if seen.distance > 0.0:
                    assert distance == pytest.approx(seen.distance, abs=1e-9)
                else:
                    assert distance <= 0.0


@pytest.mark.parametrize("name", sorted(CASES))
def test_shipped_models_are_the_bodies_of_the_cases(name):
    team, _builder = team_of(shipped(name))
    tree, expected = read_component_tree(team), case(name).tree
    assert tree.joint_lower == pytest.approx(expected.joint_lower)
    assert tree.joint_upper == pytest.approx(expected.joint_upper)
    assert len(tree.collision_pairs) == len(expected.collision_pairs)
    names = {
        body.name: body.name.replace("object::body", "object") for c in tree.components for body in c.bodies
    }
    for z in configurations(tree, 5):
        outlines = [
            {
                names.get(body.name, body.name): (
                    {tuple(p) for p in X.apply(body.shapes[0].vertices).round(9) + 0.0},
                    body.shapes[0].radius,
                )
                for X, component in zip(each.poses(z), each.components, strict=True)
                for body in component.bodies
            }
            for each in (tree, expected)
        ]
        assert outlines[0] == outlines[1]


def test_bases_stand_where_the_plant_says(team):
    tree = read_component_tree(team)
    context = team.plant.CreateDefaultContext()
    for z in configurations(tree, 3):
        set_configuration(team, context, z)
        poses = {
            body.name: X_WC.apply(body.shapes[0].vertices)[0]
            for X_WC, component in zip(tree.poses(z), tree.components, strict=True)
            for body in component.bodies
        }
        for robot, pose in zip(team.robots, base_poses(team, context), strict=True):
            assert poses[f"{robot.name}::base"] == pytest.approx(pose[:2], abs=1e-7)


def test_joints_stand_in_q_from_the_base_outwards(team):
    tree = read_component_tree(team)
    assert tuple(joint.name for joint in tree.joints) == team.joint_names
    for robot in team.robots:
        assert [joint.robot for joint in tree.joints[robot.q_slice]] == [robot.index] * len(robot.joints)


def test_welded_bodies_share_a_component_and_joined_ones_may_overlap():
    team, _builder = team_of(shipped("base"))
    tree = read_component_tree(team)
    assert [[body.name for body in c.bodies] for c in tree.components] == [
        ["object::body", "robot_0::link_2", "robot_1::link_2"],
        ["robot_0::base", "robot_0::link_1"],
        ["robot_1::base", "robot_1::link_1"],
    ]
    named = {
        frozenset((tree.components[i].bodies[j].name, tree.components[k].bodies[m].name))
        for (i, j), (k, m) in tree.collision_pairs
    }
    assert frozenset(("robot_0::link_1", "robot_0::link_2")) not in named
    assert frozenset(("robot_0::base", "robot_0::link_2")) in named
    assert frozenset(("robot_0::base", "robot_1::base")) in named
    assert frozenset(("object::body", "robot_1::link_1")) in named


def test_collision_filter_groups_exempt_pairs(tmp_path):
    group = (
        "- add_collision_filter_group:\n"
        "    name: hand\n    members: ['robot_0::base', 'robot_0::link_2']\n"
        "    ignored_collision_filter_groups: [hand]\n\nobject: object"
    )
    plain, _one = team_of(shipped("base"))
    filtered, _two = team_of(load_scenario(write_edited(tmp_path, ("object: object", group))))
    lost = read_component_tree(filtered).unchecked_pairs - read_component_tree(plain).unchecked_pairs
    assert {frozenset(pair) for pair in lost} == {frozenset(("robot_0::base", "robot_0::link_2"))}


def test_a_revolute_joint_without_limits_is_a_circle(tmp_path):
    arm = Arm(joints=(("revolute", "0 0 1", "<limit/>"),)).text()
    team, _builder = team_of(load_scenario(write_with_robot(tmp_path, arm)))
    tree = read_component_tree(team)
    assert (tree.joints[0].lower, tree.joints[0].upper) == (-np.inf, np.inf)
    assert tree.circular[:2] == (True, True)
    assert tree.joints[0].range == (-np.pi, np.pi)


def test_limits_of_half_a_turn_are_no_circle(tmp_path):
    limits = f"<limit><lower>{-np.pi}</lower><upper>{np.pi}</upper></limit>"
    team, _builder = team_of(
        load_scenario(write_with_robot(tmp_path, Arm(joints=(("revolute", "0 0 1", limits),)).text()))
    )
    assert read_component_tree(team).circular[1] is False


@pytest.mark.parametrize(
    ("limit", "told"), [("<lower>-1</lower>", "lower limit -1"), ("<upper>2</upper>", "upper limit 2")]
)
@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_a_joint_with_one_limit_is_refused_by_name(kind, limit, told, tmp_path):
    axis = "0 0 1" if kind == "revolute" else "1 0 0"
    arm = Arm(joints=((kind, axis, f"<limit>{limit}</limit>"),)).text()
    with pytest.raises(ScenarioError, match=f"robot_0::joint_0.*{told} alone"):
        team_of(load_scenario(write_with_robot(tmp_path, arm)))


def test_bodies_without_any_geometry_are_left_out(tmp_path):
    extra = (
        "<link name='tool'><pose>0.5 0 0.4 0 0 0</pose></link>"
        "<joint name='t' type='fixed'><parent>link_1</parent><child>tool</child></joint>"
    )
    team, _builder = team_of(load_scenario(write_with_robot(tmp_path, Arm(extra=extra).text())))
    names = [body.name for component in read_component_tree(team).components for body in component.bodies]
    assert "robot_0::link_1" in names
    assert "robot_0::tool" not in names


@pytest.mark.parametrize(
    ("extra", "value", "allowed"),
    [
        (
            "<link name='flag'><pose>0 0 0.4 0 0 0</pose><visual name='v'><geometry>"
            "<sphere><radius>0.1</radius></sphere></geometry></visual></link>"
            "<joint name='t' type='fixed'><parent>base</parent><child>flag</child></joint>",
            "robot_0::flag",
            "bodies with collision geometry (this one has visual geometry only)",
        ),
        (
            "<link name='wall'><pose>0 0 0.4 0 0 0</pose><collision name='v'><geometry><plane><normal>0 0 1"
            "</normal></plane></geometry></collision></link>"
            "<joint name='t' type='fixed'><parent>base</parent><child>wall</child></joint>",
            "robot_0::wall",
            "HalfSpace has no bounded footprint",
        ),
    ],
)
def test_bodies_whose_footprint_cannot_be_read_are_refused(extra, value, allowed, tmp_path):
    team, _builder = team_of(load_scenario(write_with_robot(tmp_path, Arm(extra=extra).text())))
    with pytest.raises(ScenarioError, match=re.escape(allowed)) as caught:
        read_component_tree(team)
    assert caught.value.key == "directives[1]"
    assert caught.value.value == value
