"""Robots of one model have different colours in the scene; those of different models keep theirs."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydrake.geometry import Meshcat
from pydrake.systems.framework import DiagramBuilder

from coop_drake.drawing.colours import robot_colour
from coop_drake.plant import build_team_plant
from coop_drake.scenario import load_scenario
from coop_drake.viz.scene import TeamView, hex_colour, illustrations, paint_robots

BASE = Path(__file__).parents[2] / "models" / "base.scenario.yaml"


@pytest.fixture
def twins(tmp_path):
    """The shipped team with two robots of the same model."""
    path = tmp_path / "twins.scenario.yaml"
    path.write_text(BASE.read_text().replace("long_orange", "long_blue"))
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


def test_robots_of_different_models_keep_their_colours():
    builder = DiagramBuilder()
    team = build_team_plant(load_scenario(BASE), builder)
    before = [painted(team, robot.base_body) for robot in team.robots]
    colours = [hex_colour(one) for one in paint_robots(team)]
    builder.Build()
    assert [painted(team, robot.base_body) for robot in team.robots] == before
    assert len(set(colours)) == 2
