"""Plans that are refused by limits of the scenario, and runs that stop in a cell."""

from __future__ import annotations

import json

import pytest

from tests.support.cli import invoke
from tests.support.scenarios import write_scenario

LIMITS = {"min_clearance": 2.0, "max_transition_time": 0.1}


@pytest.fixture(scope="module")
def refused(tmp_path_factory):
    folder = tmp_path_factory.mktemp("refused")
    scenario = write_scenario(folder / "room.scenario.yaml", planner=LIMITS)
    return scenario, folder / "out", invoke("plan", scenario, "--out", folder / "out", "--json")


def test_plan_names_every_limit_and_writes_the_way(refused):
    _, out, result = refused
    assert result.exit_code == 5, result.stderr
    facts = json.loads(result.stdout)
    assert facts["answer"] == "beyond limits"
    assert [one["limit"] for one in facts["refused_by"]] == [f"planner.{name}" for name in LIMITS]
    assert [one["allowed"] for one in facts["refused_by"]] == list(LIMITS.values())
    assert 0.0 < facts["refused_by"][0]["value"] < 2.0
    assert facts["refused_by"][1]["value"] > 0.1
    assert "planner.min_clearance: in cell 0 the object's path or its target has a clearance" in result.stderr
    assert sorted(path.name for path in out.iterdir()) == [".coop_drake_results.json", "way.json"]


def test_the_way_is_verified_and_not_simulated(refused, tmp_path):
    scenario, out, _ = refused
    verified = invoke("verify", out / "way.json", scenario, "--json")
    assert verified.exit_code == 5, verified.stderr
    assert json.loads(verified.stdout)["answer"] == "beyond limits"
    simulated = invoke("simulate", scenario, "--plan", out / "way.json", "--out", tmp_path / "out")
    assert simulated.exit_code == 2
    assert "refused_by" in simulated.stderr
    patient = write_scenario(tmp_path / "room.scenario.yaml")
    assert invoke("verify", out / "way.json", patient).exit_code == 1


def test_why_draws_the_way_and_the_team_where_it_is_refused(refused, tmp_path):
    result = invoke("why", refused[0], "--out", tmp_path)
    assert result.exit_code == 5, result.stderr
    assert (tmp_path / "why.png").stat().st_size > 10_000
