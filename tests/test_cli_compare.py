"""The command compare: margins on the ideal plant and on separate robots, side by side."""

from __future__ import annotations

import json

import pytest

from tests.support.cli import invoke
from tests.support.scenarios import write_scenario

NEAR = {"object": {"x": 2.6, "y": 2.0, "theta": 0.05}}
STEPS = {"time_step": 0.005}


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    folder = tmp_path_factory.mktemp("compare")
    room = write_scenario(folder / "room.scenario.yaml", goal=NEAR, plant=STEPS)
    return folder / "out", invoke("compare", room, "--out", folder / "out", "--json")


def test_both_plants_arrive_and_their_margins_stand_side_by_side(shown):
    out, result = shown
    assert result.exit_code == 0, result.stderr
    facts = json.loads(result.stdout)
    ideal, other = facts["joints"], facts["constraints"]
    assert ideal["reached"]
    assert other["reached"]
    assert ideal["max_grasp_error_m"] == 0.0 < other["max_grasp_error_m"] <= 1e-5
    assert ideal["max_acceleration_error"] < 1e-9 < other["max_acceleration_error"]
    written = json.loads((out / "compare.json").read_text())
    assert written == {plant: facts[plant] for plant in ("joints", "constraints")}
    assert min(facts[plant]["min_delta_e"] for plant in ("joints", "constraints")) > 0.0


def test_people_see_a_table_with_a_column_for_each_plant(shown):
    _, result = shown
    assert "one tree, grasps" in result.stderr  # Headings are broken where the terminal is narrow.
    assert "a tree each, grasps" in result.stderr
    assert "largest grasp error" in result.stderr


def test_a_plant_that_does_not_arrive_is_named(tmp_path):
    room = write_scenario(
        tmp_path / "room.scenario.yaml", goal=NEAR, plant=STEPS, simulator={"max_time": 0.01}
    )
    result = invoke("compare", room, "--out", tmp_path, "--quiet")
    assert result.exit_code == 1
    assert "one tree, grasps rigid: no arrival within max_time = 0.01 s" in result.stderr
    assert "a tree each, grasps constraints: no arrival within max_time = 0.01 s" in result.stderr
