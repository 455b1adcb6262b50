"""Obstacles on the floor and the colours of robots."""

import pytest
from pydrake.geometry import Meshcat
from pydrake.systems.framework import DiagramBuilder
from shapely import Polygon, box

from coop_drake.drawing.colours import robot_colour
from coop_drake.plant import build_team_plant
from coop_drake.scenario import load_scenario
from coop_drake.viz.scene import TeamView, hex_colour, illustrations, paint_robots, set_stage
from tests.support.scenarios import MODELS

FLOOR = box(0, 0, 6, 5)


SHELF, PILLAR = Polygon([(1, 1), (3, 1.5), (2.9, 1.9), (0.9, 1.4)]), box(4, 3, 4.4, 3.3)


def staged(floor):
    meshcat = Meshcat()
    set_stage(meshcat, floor, 0.5)
    return meshcat


def test_a_long_obstacle_is_a_shelf_a_short_one_a_pillar_and_one_that_is_not_convex_a_wall():
    def kinds(floor):
        has = staged(floor).HasPath
        found = {f"{kind}/0{k}" for kind in ("shelves", "pillars") for k in (0, 1)}
        return sorted(kind.split("/")[0] for kind in found if has(f"/stage/{kind}"))

    corner = Polygon([(1, 1), (3, 1), (3, 1.2), (1.2, 1.2), (1.2, 3), (1, 3)])
    assert kinds(FLOOR - SHELF - PILLAR) == ["pillars", "shelves"]
    assert kinds(FLOOR - corner - PILLAR) == ["pillars"]


@pytest.fixture
def twins(tmp_path):
    """The shipped team with two robots of the same model."""
    path = tmp_path / "twins.scenario.yaml"
    path.write_text((MODELS / "base.scenario.yaml").read_text().replace("long_orange", "long_blue"))
    return load_scenario(path)


def painted(team, body):
    inspector = team.scene_graph.model_inspector()
    known = [inspector.GetIllustrationProperties(one) for one in illustrations(team, body)]
    return {hex_colour(one.GetProperty("phong", "diffuse")) for one in known}


def test_robots_of_one_model_get_the_colours_of_the_figures(twins):
    builder = DiagramBuilder()
    team = build_team_plant(twins, builder)
    assert [hex_colour(one) for one in paint_robots(team)] == [robot_colour(k).lower() for k in (0, 1)]
    builder.Build()
    first, second = (painted(team, robot.base_body) for robot in team.robots)
    assert robot_colour(0).lower() in first
    assert robot_colour(1).lower() in second
    # The chassis is grey in both.
    assert len(first & second) == 1


def test_the_scene_paints_arrows_and_grasps_alike(twins):
    assert hex_colour(TeamView(twins, Meshcat()).colours[1]) == robot_colour(1).lower()
