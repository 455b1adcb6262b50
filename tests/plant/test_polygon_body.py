"""Generated models of polygonal bodies: convex parts, exact mass, and a transport that can carry them."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon, union_all
from typer.testing import CliRunner

from coop_drake.cli import app
from coop_drake.errors import GeometryError
from coop_drake.plant import planning_problem
from coop_drake.plant.model_writing import convex_parts, planar_mass, polygon_body_files, write_polygon_body
from coop_drake.plant.problem import core
from coop_drake.scenario import load_scenario
from coop_drake.tree.component_tree import PlanarPose
from tests.support.edited_scenario import team_of, write_edited

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
