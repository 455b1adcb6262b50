"""The component tree of a team, and models that are written from polygons."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid, Mesh, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
from shapely import MultiPoint, Polygon, box, points, union_all
from typer.testing import CliRunner

from coop_drake.cli import app
from coop_drake.errors import GeometryError, ScenarioError
from coop_drake.plant import planning_problem, read_component_tree, set_configuration
from coop_drake.plant.chain import planar_pose
from coop_drake.plant.component_tree import hull, project
from coop_drake.plant.model_writing import convex_parts, planar_mass, polygon_body_files, write_polygon_body
from coop_drake.plant.problem import body_clearance, core, wall_clearance
from coop_drake.scenario import load_scenario
from coop_drake.tree.component_tree import Body, ConvexShape, PlanarPose
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


@pytest.mark.parametrize(
    ("limits", "circular", "upper"),
    [
        ("<limit/>", True, np.inf),
        ("<limit><lower>-1e16</lower><upper>1e16</upper></limit>", True, np.inf),
        (f"<limit><lower>{-np.pi}</lower><upper>{np.pi}</upper></limit>", False, np.pi),
    ],
)
def test_only_a_revolute_joint_without_limits_is_a_circle(limits, circular, upper, tmp_path):
    """Limits as far as files write for none count as none; those of half a turn do not."""
    arm = Arm(joints=(("revolute", "0 0 1", limits),)).text()
    team, _builder = team_of(load_scenario(write_with_robot(tmp_path, arm)))
    tree = read_component_tree(team)
    assert tree.joints[0].lower == -tree.joints[0].upper == -upper
    assert tree.joints[0].range == (-np.pi, np.pi)
    assert tree.circular[:2] == (True, circular)


TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 0.7 0\nv 0 0 0.5\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def ball(count=40):
    polar, azimuth = np.meshgrid(np.linspace(0.0, np.pi, count), np.linspace(0.0, 2.0 * np.pi, 2 * count))
    return np.stack(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1
    ).reshape(-1, 3)


def rims(radius, length, count=400):
    angle = np.linspace(0.0, 2.0 * np.pi, count)
    rim = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(count)], axis=-1)
    up = np.array([0.0, 0.0, 0.5 * length])
    return np.concatenate([rim + up, rim - up])


def corners(size):
    return np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * size


@pytest.fixture(scope="module")
def tetrahedron(tmp_path_factory):
    path = tmp_path_factory.mktemp("mesh") / "tetrahedron.obj"
    path.write_text(TETRAHEDRON)
    return str(path)


def solids(mesh):
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 0.7, 0], [0, 0, 0.5]], dtype=float)
    return {
        "sphere": (Sphere(0.3), 0.3 * ball()),
        "box": (Box(0.4, 0.2, 0.7), corners([0.4, 0.2, 0.7])),
        "cylinder": (Cylinder(0.2, 0.6), rims(0.2, 0.6)),
        "capsule": (
            Capsule(0.2, 0.6),
            np.concatenate([0.2 * ball() + [0, 0, 0.3], 0.2 * ball() - [0, 0, 0.3]]),
        ),
        "ellipsoid": (Ellipsoid(0.3, 0.2, 0.5), ball(80) * [0.3, 0.2, 0.5]),
        "convex": (Convex(mesh, 1.0), vertices),
        "mesh": (Mesh(mesh, 1.0), vertices),
    }


NAMES = ("sphere", "box", "cylinder", "capsule", "ellipsoid", "convex", "mesh")

angles = st.floats(-3.2, 3.2)


@settings(max_examples=25)
@given(name=st.sampled_from(NAMES), roll=angles, pitch=angles, yaw=angles, x=st.floats(-2, 2))
def test_footprint_is_the_shadow_and_a_hair(tetrahedron, name, roll, pitch, yaw, x):
    shape, surface = solids(tetrahedron)[name]
    X_CG = RigidTransform(RollPitchYaw(roll, pitch, yaw), [x, 0.5, 3.0])
    found = project(shape, X_CG)
    shadow = X_CG.multiply(surface.T).T[:, :2]
    solid = core(found, PlanarPose())
    assert solid.distance(points(shadow)).max() <= found.radius + 1e-9
    grown = solid.buffer(found.radius, quad_segs=64)
    assert grown.area <= 1.006 * MultiPoint(shadow).convex_hull.area + 1e-7


@pytest.mark.parametrize(
    ("shape", "roll", "vertices", "radius"),
    [
        (Cylinder(0.25, 0.5), 0.0, [[1, 2]], 0.25),
        (Cylinder(0.25, 0.5), np.pi, [[1, 2]], 0.25),
        (Cylinder(0.25, 0.5), np.pi / 2, [[0.75, 1.75], [1.25, 1.75], [1.25, 2.25], [0.75, 2.25]], 0.0),
        (Capsule(0.1, 0.6), 0.0, [[1, 2]], 0.1),
        (Capsule(0.1, 0.6), np.pi / 2, [[1, 1.7], [1, 2.3]], 0.1),
        (Sphere(0.3), 0.4, [[1, 2]], 0.3),
        (Ellipsoid(0.3, 0.3, 0.1), 0.0, [[1, 2]], 0.3),
        (Box(0.4, 0.2, 0.6), 0.0, [[0.8, 1.9], [1.2, 1.9], [1.2, 2.1], [0.8, 2.1]], 0.0),
        (Box(0.4, 0.2, 0.6), np.pi / 2, [[0.8, 1.7], [1.2, 1.7], [1.2, 2.3], [0.8, 2.3]], 0.0),
    ],
)
def test_upright_and_lying_shapes_are_exact(shape, roll, vertices, radius):
    found = project(shape, RigidTransform(RollPitchYaw(roll, 0.0, 0.0), [1.0, 2.0, 3.0]))
    assert found.radius == pytest.approx(radius)
    order = np.lexsort(found.vertices.round(9).T)
    expected = np.array(vertices, dtype=float)
    assert found.vertices[order] == pytest.approx(expected[np.lexsort(expected.T)], abs=1e-9)


def test_hulls_are_counter_clockwise():
    ring = hull(np.array([[0, 0], [0, 1], [1, 1], [1, 0], [0.5, 0.5]])).vertices
    x, y = ring.T
    assert len(ring) == 4
    assert 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) == pytest.approx(1.0)


def test_flat_hull_keeps_a_thickness():
    found = hull(np.array([[0, 0], [1, 0], [0.5, 0]]))
    assert found.vertices.tolist() == [[0, 0], [1, 0]]
    assert 0.0 < found.radius <= 1e-6


ROOM = Polygon(box(0.0, 0.0, 4.0, 3.0).exterior, [box(2.0, 1.0, 2.5, 1.5).exterior.coords])

DISC = Body("disc", 0, (ConvexShape(np.array([[0.1, 0.0]]), 0.2),))

BAR = Body("bar", 0, (ConvexShape(np.array([[-0.5, 0.0], [0.5, 0.0]]), 0.1),))

PAIR = Body("pair", 0, (ConvexShape(np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])), *DISC.shapes))


@pytest.mark.parametrize(
    ("body", "pose", "clearance"),
    [
        (DISC, PlanarPose(0.9, 1.0, 0.0), 0.8),
        (DISC, PlanarPose(1.0, 0.6, -np.pi / 2), 0.3),
        (DISC, PlanarPose(1.5, 1.2, 0.0), 0.2),
        (DISC, PlanarPose(0.0, 1.2, 0.0), -0.1),
        (DISC, PlanarPose(-1.1, 1.2, 0.0), -1.2),
        (DISC, PlanarPose(2.15, 1.25, 0.0), -0.45),
        (BAR, PlanarPose(1.0, 0.8, np.pi / 2), 0.2),
        (BAR, PlanarPose(2.25, 0.7, 0.0), 0.2),
        (BAR, PlanarPose(0.3, 1.0, 0.0), -0.3),
        (PAIR, PlanarPose(0.05, 1.9, 0.0), -0.05),
        (PAIR, PlanarPose(0.4, 1.7, 0.0), 0.3),
        (Body("frame", 0, ()), PlanarPose(-9.0, 0.0, 0.0), np.inf),
    ],
)
def test_clearance_to_the_walls(body, pose, clearance):
    assert wall_clearance(body, pose, ROOM) == pytest.approx(clearance)


@pytest.mark.parametrize(
    ("first", "second", "pose", "clearance"),
    [
        (DISC, DISC, PlanarPose(1.0, 0.0, 0.0), 0.6),
        (DISC, DISC, PlanarPose(0.2, 0.0, np.pi), -0.4),
        (DISC, BAR, PlanarPose(0.1, 0.6, 0.0), 0.3),
        (PAIR, BAR, PlanarPose(2.0, 0.5, 0.0), 0.4),
        (PAIR, PAIR, PlanarPose(0.5, 0.5, 0.3), -0.2),
    ],
)
def test_clearance_between_bodies(first, second, pose, clearance):
    assert body_clearance(first, PlanarPose(), second, pose) == pytest.approx(clearance)


# Generated models of polygonal bodies: convex parts, exact mass, and a transport that can carry them.


U_SHAPE = [
    (-0.5, -0.3),
    (0.5, -0.3),
    (0.5, 0.3),
    (0.1, 0.3),
    (0.1, 0.0),
    (-0.1, 0.0),
    (-0.1, 0.3),
    (-0.5, 0.3),
]


L_SHAPE = [(0, 0), (0.6, 0), (0.6, 0.2), (0.2, 0.2), (0.2, 0.5), (0, 0.5)]


@st.composite
def stars(draw):
    """Star-shaped outlines about a point off the origin, often non-convex."""
    radii = draw(st.lists(st.floats(0.1, 1.0), min_size=3, max_size=12))
    angle = 2.0 * np.pi * np.arange(len(radii)) / len(radii)
    centre = np.array([draw(st.floats(-2.0, 2.0)), draw(st.floats(-2.0, 2.0))])
    return centre + np.column_stack([radii * np.cos(angle), radii * np.sin(angle)])


@settings(max_examples=60)
@given(outline=stars())
def test_parts_are_convex_and_make_up_the_outline(outline):
    polygon = Polygon(outline)
    parts = convex_parts(polygon)
    assert union_all(parts).symmetric_difference(polygon).area <= 1e-9
    assert sum(part.area for part in parts) == pytest.approx(polygon.area, rel=1e-9)
    corners = {tuple(corner) for corner in np.asarray(polygon.exterior.coords)}
    for part in parts:
        assert part.area == pytest.approx(part.convex_hull.area, rel=1e-9)
        assert {tuple(corner) for corner in np.asarray(part.exterior.coords)} <= corners


@pytest.mark.parametrize(
    ("outline", "count"), [([(0, 0), (1, 0), (1, 1), (0, 1)], 1), (L_SHAPE, 2), (U_SHAPE, 3)]
)
def test_parts_are_few(outline, count):
    assert len(convex_parts(Polygon(outline))) == count


@settings(max_examples=40)
@given(outline=stars(), height=st.floats(0.05, 0.5))
def test_mass_properties_are_those_of_the_triangles(outline, height):
    """Oracle: triangles from the centre, each a lamina with known second moments."""
    found = planar_mass(outline.tolist(), 2.0, height)
    polygon = Polygon(outline)
    total, first, second = 0.0, np.zeros(2), np.zeros((2, 2))
    centre = outline.mean(axis=0)
    for a, b in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        u, v = a - centre, b - centre
        area = 0.5 * (u[0] * v[1] - u[1] * v[0])
        total += area
        first += area * (u + v) / 3.0
        second += area * (np.outer(u, u) + np.outer(v, v) + np.outer(u + v, u + v)) / 12.0
    mean = first / total
    spread = 2.0 * (second / total - np.outer(mean, mean))
    assert found.centroid == pytest.approx(np.array(polygon.centroid.coords[0]), abs=1e-9)
    assert found.centroid == pytest.approx(centre + mean, abs=1e-9)
    assert found.inertia[2, 2] == pytest.approx(np.trace(spread), rel=1e-6, abs=1e-9)
    assert found.inertia[0, 1] == pytest.approx(-spread[0, 1], rel=1e-6, abs=1e-9)
    assert found.inertia[0, 0] == pytest.approx(spread[1, 1] + 2.0 * height**2 / 12.0, rel=1e-6, abs=1e-9)


def test_mass_of_a_rectangle_by_hand():
    found = planar_mass([(0, 0), (0.8, 0), (0.8, 0.5), (0, 0.5)], 3.0, 0.2)
    assert found.centroid == pytest.approx([0.4, 0.25])
    assert np.diag(found.inertia) == pytest.approx(
        [3 * (0.5**2 + 0.2**2) / 12, 3 * (0.8**2 + 0.2**2) / 12, 3 * (0.8**2 + 0.5**2) / 12]
    )
    assert planar_mass([(0, 0), (0.8, 0), (0.8, 0.5), (0, 0.5)], 3.0, 0.2, 1.5).inertia[
        2, 2
    ] == pytest.approx(1.5)


@pytest.mark.parametrize("outline", [U_SHAPE, U_SHAPE[::-1]])
def test_team_carries_a_non_convex_object(outline, tmp_path):
    files = polygon_body_files(outline, 2.5, "plank", grasps=[(0.5, 0, 0), (-0.5, 0, np.pi)])
    write_polygon_body(files, tmp_path)
    scenario = load_scenario(write_edited(tmp_path, ("package://coop_drake_models/object.sdf", "plank.sdf")))
    team, _builder = team_of(scenario)
    problem = planning_problem(scenario, team)
    carried = problem.tree.components[0].bodies[0]
    footprint = union_all([core(shape, PlanarPose()) for shape in carried.shapes])
    assert footprint.symmetric_difference(Polygon(U_SHAPE)).area <= 1e-9
    assert len(carried.shapes) == 3
    expected = planar_mass(U_SHAPE, 2.5, 0.2)
    assert team.object_inertia.mass == pytest.approx(2.5)
    assert team.object_inertia.inertia_about_com == pytest.approx(expected.inertia[2, 2])
    assert team.object_inertia.p_LLcm == pytest.approx(expected.centroid, abs=1e-12)
    assert team.robots[1].X_LE.x == pytest.approx(-0.5)


@pytest.mark.parametrize(
    ("outline", "changes", "complaint"),
    [
        ([(0, 0), (1, 1), (1, 0), (0, 1)], {}, "crosses or touches itself"),
        ([(0, 0), (1, 0), (2, 0)], {}, "crosses or touches itself, or has no area"),
        ([(0, 0), (1, 0), (1, np.nan)], {}, "three or more corners"),
        (L_SHAPE, {"height": 0.0}, "height must be a positive number, got 0.0"),
        (L_SHAPE, {"inertia": -1.0}, "inertia must be a positive number, got -1.0"),
        (L_SHAPE, {"mass": float("inf")}, "mass must be a positive number, got inf"),
    ],
)
def test_impossible_bodies_are_refused(outline, changes, complaint):
    with pytest.raises(GeometryError, match=re.escape(complaint)):
        polygon_body_files(outline, **{"mass": 1.0, "name": "x", **changes})


def called(folder, name="x", corners="0 0, 1 0, 1 1", mass="1", *more):
    arguments = [name, "--corners", corners, "--mass", mass, *more, "--out", str(folder)]
    return CliRunner().invoke(app, ["new", "object", *arguments])


def test_command_line_writes_the_same_files_and_replaces_none(tmp_path):
    corners, grasps = ", ".join(f"{x} {y}" for x, y in U_SHAPE), "-0.5 0 3.14, 0.5 0 0"
    arguments = tmp_path / "made", "u", corners, "2", "--height", "0.3", "--grasps", grasps
    done = called(*arguments)
    assert done.exit_code == 0, done.output
    assert "- add_weld: {parent: object::grasp_1, child: robot_1::gripper}" in done.output
    expected = polygon_body_files(U_SHAPE, 2.0, "u", 0.3, grasps=[(-0.5, 0, 3.14), (0.5, 0, 0)])
    assert {file.name: file.read_text() for file in (tmp_path / "made").iterdir()} == expected
    assert called(*arguments).exit_code == 2


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"corners": "0 0, 1 0"}, "three or more corners"),
        ({"corners": "0 0, 1 0, 1"}, "should be 2 numbers"),
        ({"corners": "0 0, 1 0, one"}, "could not convert"),
        ({"mass": "0"}, "mass must be a positive number, got 0.0"),
        ({"name": "../x"}, "no name of letters"),
    ],
)
def test_command_line_says_what_is_wrong(changes, complaint, tmp_path):
    done = called(tmp_path, **changes)
    assert done.exit_code == 2
    assert complaint in " ".join(done.output.replace("│", " ").split())
    assert list(tmp_path.iterdir()) == []
