"""Scenario files become values: the shipped ones, short ones, and those that a program writes."""

import dataclasses
import re

import pytest
from shapely import normalize

from coop_drake.answers.problem import PlannerSettings
from coop_drake.laws.gains import FixedGains, ScheduledGains
from coop_drake.scenario import (
    Scenario,
    SimulatorSettings,
    Tolerances,
    dump_scenario,
    load_scenario,
)
from tests.support.cases import CASES, case
from tests.support.edited_scenario import MODELS, shipped, write_edited

SHORT = """
workspace:
  outer: [[0, 0], [4, 0], [4, 4], [0, 4]]
directives:
- add_model: {name: object, file: package://coop_drake_models/object.sdf}
- add_model: {name: left, file: package://coop_drake_models/long_blue.sdf}
- add_model: {name: right, file: package://coop_drake_models/elbow_orange.sdf}
- add_weld: {parent: object::grasp_0, child: left::gripper}
- add_weld: {parent: object::grasp_1, child: right::gripper}
start:
  object: {x: 2, y: 2, theta: 0}
  joints: {left: [0.1], right: [0, 1e-1]}
goal:
  object: {x: 2.5, y: 2, theta: 0}
"""


@pytest.mark.parametrize("name", sorted(CASES))
def test_shipped_floor_start_and_goal_are_those_of_the_case(name):
    scenario, expected = shipped(name), case(name)
    assert scenario.name == name
    assert normalize(scenario.workspace.polygon).equals_exact(expected.workspace, 1e-9)
    start = scenario.start.object
    assert (start.x, start.y, start.theta) == tuple(expected.start[:3])
    assert all(value == 0.0 for values in scenario.start.joints.values() for value in values)
    goal = scenario.goal.object
    assert (goal.x, goal.y, goal.theta) == tuple(expected.goal_pose)
    assert scenario.goal.joints == {}


@pytest.mark.parametrize("name", sorted(CASES))
def test_both_gain_sets_ship_and_the_scheduled_one_is_selected(name):
    scenario = shipped(name)
    assert scenario.selected_gains == "scheduled"
    assert scenario.gain_sets == {"scheduled": ScheduledGains(), "table_2": FixedGains()}


def test_short_file_gets_defaults(tmp_path):
    path = tmp_path / "short.scenario.yaml"
    path.write_text(SHORT)
    scenario = load_scenario(path)
    assert scenario.name == "short"
    assert scenario.object == "object"
    assert scenario.start.joints == {"left": (0.1,), "right": (0.0, 0.1)}
    assert scenario.goal.tolerances == Tolerances()
    assert scenario.planner == PlannerSettings()
    assert scenario.simulator == SimulatorSettings()
    assert sorted(scenario.gain_sets) == ["scheduled", "table_2"]


def test_path_may_be_a_text():
    assert load_scenario(str(MODELS / "base.scenario.yaml")).path.name == "base.scenario.yaml"


@pytest.mark.parametrize("name", sorted(CASES))
def test_written_scenario_reads_back_to_the_same(name, tmp_path):
    scenario = shipped(name)
    copy = tmp_path / "copy.scenario.yaml"
    copy.write_text(dump_scenario(scenario))
    again = load_scenario(copy)
    for field in dataclasses.fields(Scenario):
        if field.name not in ("path", "directives"):
            assert getattr(again, field.name) == getattr(scenario, field.name), field.name
    assert [repr(d.drake) for d in again.directives] == [repr(d.drake) for d in scenario.directives]
    assert dump_scenario(again) == dump_scenario(scenario)


def test_settings_of_every_section_are_read(tmp_path):
    path = write_edited(
        tmp_path,
        ("  selected: scheduled", "  selected: gentle"),
        (
            "gains:",
            "planner: {margin: 0.05, max_slices: 77, strategy: paper}\n"
            "simulator: {max_time: 12, integration_scheme: runge_kutta2}\n"
            "visualization: {wall_height: 1, show_collision: true}\ngains:",
        ),
        ("the paper's", "the paper's\n  sets: {gentle: !ScheduledGains {age_phase: 0.5}}"),
        ("angle: 0.02}", "angle: 0.03}\n  joints: {robot_1: [null]}"),
    )
    scenario = load_scenario(path)
    assert scenario.planner == PlannerSettings(margin=0.05, max_slices=77, strategy="paper")
    assert scenario.simulator == SimulatorSettings(max_time=12.0, integration_scheme="runge_kutta2")
    assert scenario.visualization.wall_height == 1.0
    assert scenario.visualization.show_collision
    assert scenario.gain_sets["gentle"] == ScheduledGains(age_phase=0.5)
    assert sorted(scenario.gain_sets) == ["gentle", "scheduled", "table_2"]
    assert scenario.goal.tolerances.angle == 0.03
    assert scenario.goal.joints == {"robot_1": (None,)}


def test_part_of_a_shipped_gain_set_can_be_changed(tmp_path):
    path = write_edited(tmp_path, ("the paper's", "x\n  sets: {table_2: !FixedGains {damping: 9.0}}"))
    assert load_scenario(path).gain_sets["table_2"] == FixedGains(damping=9.0)


def test_scenario_is_frozen():
    with pytest.raises(dataclasses.FrozenInstanceError, match=re.escape("cannot assign to field 'object'")):
        shipped("base").object = "other"
