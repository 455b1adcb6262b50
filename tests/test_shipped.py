"""Scenarios that ship: found by name from anywhere, and carried by the wheel."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from pydrake.systems.framework import DiagramBuilder

from coop_drake.errors import ScenarioError
from coop_drake.planning import Channel, find_channel
from coop_drake.plant import build_team_plant, planning_problem
from coop_drake.scenario import load_scenario
from coop_drake.shipped import SHIPPED, scenario_file, shipped_scenarios

ROOT = Path(__file__).parents[1]


def test_shipped_scenarios_are_found_by_name_from_anywhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert {"base", "closed", "elbow", "three", "tight", "warehouse"} <= set(shipped_scenarios())
    assert load_scenario("base").path == SHIPPED / "base.scenario.yaml"
    assert load_scenario("base").name == "base"


def test_a_file_of_that_name_comes_first(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert scenario_file("base") == SHIPPED / "base.scenario.yaml"
    (tmp_path / "base").write_text("mine", encoding="utf-8")
    assert scenario_file("base") == Path("base")


def test_a_folder_stands_for_the_only_scenario_in_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "base").mkdir()
    assert scenario_file("base") == SHIPPED / "base.scenario.yaml"
    (tmp_path / "base" / "mine.scenario.yaml").write_text("one", encoding="utf-8")
    assert scenario_file("base") == Path("base/mine.scenario.yaml")
    (tmp_path / "base").rename("both")
    (tmp_path / "both" / "other.scenario.yaml").write_text("two", encoding="utf-8")
    with pytest.raises(
        ScenarioError, match=r"both: the file: a folder; expected .* just one \*.scenario.yaml"
    ):
        load_scenario("both")


@pytest.mark.parametrize("name", ["bace", "models/none.scenario.yaml"])
def test_what_is_neither_is_refused_with_the_names_there_are(name):
    with pytest.raises(ScenarioError, match=r"a readable file, or a shipped scenario: base, closed,"):
        load_scenario(name)


def test_there_is_a_way_through_the_warehouse_and_shelves_stand_beside_it():
    scenario = load_scenario("warehouse")
    problem = planning_problem(scenario, build_team_plant(scenario, DiagramBuilder()))
    way, _ = find_channel(problem)
    assert isinstance(way, Channel)
    assert len(problem.workspace.interiors) == 5


def test_the_wheel_carries_models_where_the_package_looks_for_them():
    wheel = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["hatch"]["build"][
        "targets"
    ]["wheel"]
    assert wheel["packages"] == ["coop_drake"]
    assert wheel["force-include"] == {SHIPPED.name: f"coop_drake/{SHIPPED.name}"}
    assert SHIPPED == ROOT / "models"
